"""Images and their intrinsics as sensor_msgs."""
from __future__ import annotations

from array import array

import cv2
import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import CameraInfo, CompressedImage, Image
from std_msgs.msg import Header

from depth_person.camera.frame import Frame
from depth_person.camera.intrinsics import Intrinsics
from depth_person.camera.message_fields import calibration, picture
from depth_person.camera.message_fields import stamp_ns as stamp_ns

NANOSECONDS = 1_000_000_000


def header(*, stamp_ns: int, frame_id: str) -> Header:
    """Return the header that an image of this stamp and frame has."""
    result = Header(frame_id=frame_id)
    result.stamp.sec, result.stamp.nanosec = divmod(stamp_ns, NANOSECONDS)
    return result


def byte_array(data: NDArray[np.generic]) -> array[int]:
    """Return the bytes of an array, in the one type that messages take over without a loop."""
    result = array('B')
    result.frombytes(np.ascontiguousarray(data).reshape(-1).view(np.uint8).data)
    return result


def encode_image(image: NDArray[np.uint8], image_header: Header) -> Image:
    """
    Return a BGR image as a message; its pixels are copied once.

    :param image: (height, width, 3) uint8.
    """
    height, width = image.shape[:2]
    return Image(
        header=image_header, height=height, width=width, encoding='bgr8', is_bigendian=0,
        step=3 * width, data=byte_array(image))


def encode_jpeg(
    image: NDArray[np.uint8], image_header: Header, *, quality: int,
) -> CompressedImage:
    """
    Return a BGR image as a JPEG message.

    :param quality: 1 to 100.
    """
    _, jpeg = cv2.imencode('.jpg', image, (cv2.IMWRITE_JPEG_QUALITY, quality))
    return CompressedImage(
        header=image_header, format='bgr8; jpeg compressed bgr8', data=byte_array(jpeg))


def encode_camera_info(
    intrinsics: Intrinsics | None, image_header: Header, *, width: int, height: int,
) -> CameraInfo:
    """Return the intrinsics of an image as a message; None makes an uncalibrated one, K[0] 0."""
    message = CameraInfo(header=image_header, width=width, height=height)
    if intrinsics is None:
        return message
    message.distortion_model = intrinsics.distortion_model
    message.d = list(intrinsics.distortion)
    matrix = intrinsics.matrix
    message.k = matrix.ravel()
    message.r = np.eye(3).ravel()
    message.p = np.hstack([matrix, np.zeros((3, 1))]).ravel()
    return message


def decode_camera_info(message: CameraInfo) -> Intrinsics | None:
    """
    Return the intrinsics of the raw images that come with a CameraInfo; None if uncalibrated.

    :raises DepthPersonError: when the values cannot belong to a camera, NaN for one.
    """
    return calibration(message)


def decode_image(message: Image | CompressedImage) -> Frame:
    """
    Return the frame of an image message, uncalibrated; its pixels are shared where they can be.

    :raises DepthPersonError: when the message holds no picture.
    """
    return Frame(picture(message), stamp_ns(message.header), message.header.frame_id)


def image_size(message: Image | CompressedImage) -> tuple[int, int]:
    """
    Return the width and height of an image message.

    :raises DepthPersonError: when a compressed one holds no picture.
    """
    if isinstance(message, Image):
        return message.width, message.height
    height, width = picture(message).shape[:2]
    return width, height
