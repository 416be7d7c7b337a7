"""What the fields of sensor_msgs say, whichever library made the message."""
from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depth_person.camera.encodings import decode_compressed, to_bgr
from depth_person.camera.intrinsics import Intrinsics


def picture(message: Any) -> NDArray[np.uint8]:
    """
    Return the (height, width, 3) BGR picture of an Image or a CompressedImage.

    Its pixels are shared with the message where they can be.

    :raises DepthPersonError: when the message holds no picture.
    """
    if not hasattr(message, 'encoding'):
        return decode_compressed(message.data, message.format)
    return to_bgr(
        message.data, encoding=message.encoding, height=message.height, width=message.width,
        step=message.step, is_bigendian=bool(message.is_bigendian))


def calibration(message: Any) -> Intrinsics | None:
    """
    Return the intrinsics of the raw images that come with a CameraInfo; None if uncalibrated.

    K belongs to the full resolution; the images are what a region of interest and binning leave
    of it (REP 104).

    :raises DepthPersonError: when the values cannot belong to a camera, NaN for one.
    """
    intrinsics = Intrinsics.from_camera_info_fields(
        message.width, message.height, message.distortion_model, d=message.d, k=message.k)
    if intrinsics is None:
        return None
    roi = message.roi
    if roi.width and roi.height:
        intrinsics = replace(
            intrinsics, width=roi.width, height=roi.height, cx=intrinsics.cx - roi.x_offset,
            cy=intrinsics.cy - roi.y_offset)
    binning_x, binning_y = max(message.binning_x, 1), max(message.binning_y, 1)
    if binning_x == binning_y == 1:
        return intrinsics
    return intrinsics.scaled(
        width=intrinsics.width // binning_x, height=intrinsics.height // binning_y)


def stamp_ns(header: Any) -> int:
    """Return the stamp of a header in nanoseconds."""
    return header.stamp.sec * 10 ** 9 + header.stamp.nanosec
