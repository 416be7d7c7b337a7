"""Frames from the messages of one camera, as bags hold them."""
from __future__ import annotations

import logging
from typing import Any

from depth_person.camera.frame import Frame
from depth_person.camera.intrinsics import Intrinsics
from depth_person.camera.message_fields import calibration, picture, stamp_ns
from depth_person.errors import DepthPersonError

LOG = logging.getLogger(__name__)


class FrameMaker:
    """
    Turns Image and CompressedImage messages into frames with their intrinsics.

    The intrinsics are those of the last CameraInfo that was taken.

    :param where: the bag, for messages.
    :param info_topic: where the CameraInfo comes from, for messages; None where there is none.
    :param frame_id: for images that name none.
    :ivar bad_camera_infos: how many CameraInfo messages could not be used, or belonged to images
        of another resolution.
    """

    def __init__(self, where: str, *, info_topic: str | None, frame_id: str) -> None:
        self._where = where
        self._info_topic = info_topic
        self._frame_id = frame_id
        self._intrinsics: Intrinsics | None = None
        self.bad_camera_infos = 0

    def take_camera_info(self, message: Any) -> None:
        """Take the intrinsics of the images from now on."""
        try:
            self._intrinsics = calibration(message)
        except DepthPersonError as error:
            self._intrinsics = None
            self._note(f'a CameraInfo on {self._info_topic} cannot be used: {error}')

    def frame(self, message: Any, time_ns: int) -> Frame:
        """
        Return the frame of an image message.

        :param time_ns: of recording, which stands for a stamp of zero.
        :raises DepthPersonError: when the message holds no picture.
        """
        image = picture(message)
        intrinsics = self._intrinsics
        if intrinsics is not None and not intrinsics.fits(image):
            height, width = image.shape[:2]
            self._note(
                f'images of {width}x{height} px, but {self._info_topic} is for '
                f'{intrinsics.width}x{intrinsics.height} px: they are taken as uncalibrated')
            intrinsics = None
        return Frame(
            image, stamp_ns(message.header) or time_ns,
            message.header.frame_id or self._frame_id, intrinsics)

    def _note(self, fault: str) -> None:
        self.bad_camera_infos += 1
        if self.bad_camera_infos == 1:
            LOG.warning('%s: %s', self._where, fault)
