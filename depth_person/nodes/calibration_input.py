"""The intrinsics that depth_node gets over camera_info, and whether they can be believed."""
from __future__ import annotations

from sensor_msgs.msg import CameraInfo

from depth_person.camera.intrinsics import Intrinsics
from depth_person.errors import DepthPersonError
from depth_person.nodes.image_messages import decode_camera_info
from depth_person.nodes.monitor import Level, Monitor

_FAULT = 'camera_info'


class CalibrationInput:
    """
    Holds the newest camera_info and the size of the images that it should belong to.

    :param topic: for messages.
    """

    def __init__(self, monitor: Monitor, *, topic: str) -> None:
        self._monitor = monitor
        self._topic = topic
        self._message: CameraInfo | None = None
        self._intrinsics: Intrinsics | None = None
        self._fault = f'no message on {topic} yet; without one no distance can be had'
        self._image_size: tuple[int, int] | None = None

    def take(self, message: CameraInfo) -> bool:
        """Take the newest message; return whether it differs from the one before."""
        if self._message is not None and _same_camera(message, self._message):
            return False
        self._message, self._intrinsics, self._fault = message, None, ''
        try:
            self._intrinsics = decode_camera_info(message)
        except DepthPersonError as error:
            self._fault = f'{self._topic}: {error}'
            return True
        if self._intrinsics is None:
            self._fault = (
                f'{self._topic} says that the camera is uncalibrated, so no distance can be had; '
                "calibrate it, or give the camera's horizontal field of view")
        return True

    def take_image_size(self, width: int, height: int) -> None:
        """Take the size of an image that comes with the messages."""
        self._image_size = (width, height)

    def intrinsics_for(self, frame_id: str) -> Intrinsics | None:
        """Return the intrinsics of images of this frame; None, reported, if there are none."""
        fault = self._fault or self._size_fault()
        if fault:
            self._monitor.fault(_FAULT, Level.ERROR, fault)
            return None
        if self._message is not None and self._message.header.frame_id != frame_id:
            self._monitor.fault(
                _FAULT, Level.WARN,
                f'{self._topic} is of frame {self._message.header.frame_id!r}, the keypoints of '
                f'{frame_id!r}; check that both come from one camera')
        else:
            self._monitor.clear(_FAULT)
        return self._intrinsics

    def _size_fault(self) -> str:
        intrinsics, size = self._intrinsics, self._image_size
        if intrinsics is None or size in (None, (intrinsics.width, intrinsics.height)):
            return ''
        assert size is not None
        return (
            f'{self._topic} is for {intrinsics.width}x{intrinsics.height} px, the images have '
            f'{size[0]}x{size[1]}; calibrate the camera at this resolution')


def _same_camera(one: CameraInfo, other: CameraInfo) -> bool:
    """Return whether two messages differ in nothing but their stamps."""
    return (
        one.header.frame_id == other.header.frame_id
        and (one.width, one.height) == (other.width, other.height)
        and one.distortion_model == other.distortion_model
        and list(one.d) == list(other.d) and one.k.tolist() == other.k.tolist()
        and (one.binning_x, one.binning_y) == (other.binning_x, other.binning_y)
        and one.roi == other.roi)
