"""The lens of a camera: which intrinsics a frame has, and the size it is brought to."""
from __future__ import annotations

from dataclasses import dataclass, replace

import cv2

from depth_person.camera.frame import Frame
from depth_person.camera.intrinsics import Intrinsics
from depth_person.errors import DepthPersonError

#: Two sizes are of one shape when their ratios of width to height differ by less than this.
_SAME_SHAPE = 0.01

Size = tuple[int, int]


class Uncalibrated(DepthPersonError):  # noqa: N818 - a state
    """Nothing is known of the lens."""


@dataclass(frozen=True)
class Optics:
    """
    What is known of a camera's lens, and how wide its frames shall be.

    :ivar calibration: comes before the field of view and before what frames bring themselves.
    :ivar horizontal_fov: degrees; None where it is not known.
    :ivar width: frames that are wider are scaled down to it, pixels; None leaves them.
    :ivar rescale: whether a calibration of another size may be scaled to the frames'.
    """

    calibration: Intrinsics | None = None
    horizontal_fov: float | None = None
    width: int | None = None
    rescale: bool = False

    def shrink(self, frame: Frame) -> Frame:
        """Return a frame scaled down to the width wished for; its intrinsics are left as are."""
        height, width = frame.image.shape[:2]
        if self.width is None or width <= self.width:
            return frame
        size = (self.width, max(round(height * self.width / width), 1))
        return replace(frame, image=cv2.resize(frame.image, size, interpolation=cv2.INTER_AREA))

    def intrinsics(self, frame: Frame, *, taken: Size) -> Intrinsics:
        """
        Return the intrinsics of a frame after shrink.

        :param taken: width and height before it.
        :raises Uncalibrated: when nothing is known.
        :raises DepthPersonError: when what is known belongs to another size.
        """
        height, width = frame.image.shape[:2]
        known = self.calibration
        if known is None and self.horizontal_fov is not None:
            return Intrinsics.from_horizontal_fov(self.horizontal_fov, width=width, height=height)
        known = known or frame.intrinsics
        if known is None:
            raise Uncalibrated(
                'the camera is uncalibrated, so no distance can be had; set camera_info_url to a '
                'calibration file or a preset, or horizontal_fov')
        size = (known.width, known.height)
        if size == (width, height):
            return known
        if size != taken:
            self._check_rescaling(size, taken)
        return known.scaled(width=width, height=height)

    def _check_rescaling(self, size: Size, taken: Size) -> None:
        """Raise that a calibration is of another size, unless it may and can be rescaled."""
        said = (f'the calibration is for {size[0]}x{size[1]} px, the images have '
                f'{taken[0]}x{taken[1]}; calibrate the camera at this resolution')
        same_shape = abs(size[0] * taken[1] / (size[1] * taken[0]) - 1) < _SAME_SHAPE
        if not same_shape:
            raise DepthPersonError(
                f'{said}: another shape means that one of the two is cropped, so that the '
                'calibration cannot be rescaled')
        if not self.rescale:
            raise DepthPersonError(
                f'{said}, or set rescale_calibration if both show the same field of view')
