"""From the bytes of image messages to BGR arrays, without ROS."""
from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from depth_person.camera.opencv import decode_image
from depth_person.errors import DepthPersonError

Image = NDArray[np.uint8]

#: sensor_msgs encodings: channels, dtype and the OpenCV conversion to BGR (None: is BGR).
PACKED = {
    'bgr8': (3, np.uint8, None),
    '8UC3': (3, np.uint8, None),
    'rgb8': (3, np.uint8, cv2.COLOR_RGB2BGR),
    'bgra8': (4, np.uint8, cv2.COLOR_BGRA2BGR),
    '8UC4': (4, np.uint8, cv2.COLOR_BGRA2BGR),
    'rgba8': (4, np.uint8, cv2.COLOR_RGBA2BGR),
    'mono8': (1, np.uint8, cv2.COLOR_GRAY2BGR),
    '8UC1': (1, np.uint8, cv2.COLOR_GRAY2BGR),
    'mono16': (1, np.uint16, cv2.COLOR_GRAY2BGR),
    '16UC1': (1, np.uint16, cv2.COLOR_GRAY2BGR),
    'uyvy': (2, np.uint8, cv2.COLOR_YUV2BGR_UYVY),
    'yuv422': (2, np.uint8, cv2.COLOR_YUV2BGR_UYVY),
    'yuyv': (2, np.uint8, cv2.COLOR_YUV2BGR_YUYV),
    'yuv422_yuy2': (2, np.uint8, cv2.COLOR_YUV2BGR_YUYV),
    # ROS names a Bayer pattern by its first row, OpenCV by the second row from its second pixel.
    'bayer_rggb8': (1, np.uint8, cv2.COLOR_BayerBG2BGR),
    'bayer_bggr8': (1, np.uint8, cv2.COLOR_BayerRG2BGR),
    'bayer_gbrg8': (1, np.uint8, cv2.COLOR_BayerGR2BGR),
    'bayer_grbg8': (1, np.uint8, cv2.COLOR_BayerGB2BGR),
}
#: A full-size plane of Y above a half-height plane of interleaved U and V.
PLANAR = {'nv12': cv2.COLOR_YUV2BGR_NV12, 'nv21': cv2.COLOR_YUV2BGR_NV21}
#: Encodings in which two neighbours in a row have one colour between them.
SHARED_COLOURS = {'uyvy', 'yuv422', 'yuyv', 'yuv422_yuy2', *PLANAR}


def to_bgr(
    data: Any, *, encoding: str, height: int, width: int, step: int, is_bigendian: bool = False,
) -> Image:
    """
    Return the picture of a sensor_msgs/Image.

    :param data: its bytes, in anything that has a buffer.
    :param step: bytes from one row to the next; what exceeds the row itself is skipped.
    :returns: (height, width, 3) uint8 BGR, which nobody may write to: for bgr8 without padding
        it is a view of data.
    :raises DepthPersonError: when the fields do not describe a picture.
    """
    if height <= 0 or width <= 0:
        raise DepthPersonError(
            f'an image of {width}x{height} px is empty; check the camera driver')
    if (encoding in PLANAR and height % 2) or (encoding in SHARED_COLOURS and width % 2):
        raise DepthPersonError(
            f'an image of {width}x{height} px is not possible in encoding {encoding}, where '
            'neighbours share their colour; check the camera driver')
    if encoding in PACKED:
        channels, dtype, conversion = PACKED[encoding]
        rows = _rows(data, height, width * channels * np.dtype(dtype).itemsize, step)
        if dtype is np.uint16:
            rows = _high_bytes(rows, is_bigendian)
        picture = rows.reshape(height, width, channels)
    elif encoding in PLANAR:
        conversion, picture = PLANAR[encoding], _rows(data, height + height // 2, width, step)
    else:
        raise DepthPersonError(
            f'image encoding {encoding!r} is not supported; set the camera driver to one of '
            f'{", ".join([*PACKED, *PLANAR])}')
    if conversion is None:
        return np.ascontiguousarray(picture)
    return cv2.cvtColor(picture, conversion)


def decode_compressed(data: Any, encoding: str = '') -> Image:
    """
    Return the picture of a sensor_msgs/CompressedImage.

    :param data: its bytes, in anything that has a buffer.
    :param encoding: the message's format, such as 'jpeg' or 'bgr8; jpeg compressed bgr8'.
    :returns: (height, width, 3) uint8 BGR.
    :raises DepthPersonError: when the picture is torn, or of a kind that OpenCV cannot decode.
    """
    buffer = np.frombuffer(data, np.uint8)
    if _torn_jpeg(buffer):  # OpenCV would return it, grey from the tear on
        raise DepthPersonError(
            f'a JPEG image of {buffer.size} bytes is torn: its end is missing')
    picture = decode_image(buffer)
    if picture is None:
        kind = f' (format {encoding!r})' if encoding else ''
        raise DepthPersonError(
            f'a compressed image of {buffer.size} bytes{kind} cannot be decoded; it is corrupt, '
            'or no JPEG, PNG or other still picture')
    return picture


def _rows(data: Any, height: int, row_bytes: int, step: int) -> Image:
    """Return the (height, row_bytes) bytes of the rows without their padding, as a view."""
    if step < row_bytes:
        raise DepthPersonError(
            f'image step {step} is smaller than its row of {row_bytes} bytes; check the camera '
            'driver')
    buffer = np.frombuffer(data, np.uint8)
    if buffer.size < height * step:
        raise DepthPersonError(
            f'image data of {buffer.size} bytes is too short for {height} rows of {step} bytes')
    return buffer[:height * step].reshape(height, step)[:, :row_bytes]


def _high_bytes(rows: Image, is_bigendian: bool) -> Image:
    """Return the more significant byte of every 16-bit value."""
    return np.ascontiguousarray(rows[:, 0 if is_bigendian else 1::2])


def _torn_jpeg(buffer: Image) -> bool:
    """Return whether the data begins as JPEG but lacks its end marker."""
    if buffer[:2].tobytes() != b'\xff\xd8':
        return False
    # Some cameras pad their pictures, with a few bytes of anything or with many zeros.
    end = buffer[-1024:].tobytes()
    return b'\xff\xd9' not in end and not buffer.tobytes().rstrip(b'\0').endswith(b'\xff\xd9')
