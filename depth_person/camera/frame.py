from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depth_person.camera.intrinsics import Intrinsics
from depth_person.errors import DepthPersonError


@dataclass(frozen=True, eq=False)
class Frame:
    """
    One image of a camera with all that later stages need to know of it.

    :ivar image: (height, width, 3) uint8, BGR; shared between stages, so never written to.
    :ivar stamp_ns: capture time, nanoseconds of the source's clock.
    :ivar frame_id: name of the camera's optical frame.
    :ivar intrinsics: of this image's resolution; None while the camera is uncalibrated.
    """

    image: NDArray[np.uint8]
    stamp_ns: int
    frame_id: str
    intrinsics: Intrinsics | None = None

    def __post_init__(self) -> None:
        shape = self.image.shape
        if len(shape) != 3 or shape[2] != 3 or self.image.dtype != np.uint8 or 0 in shape:
            raise DepthPersonError(
                f'a frame needs a non-empty uint8 image of 3 channels, not {self.image.dtype} '
                f'of shape {shape}; check the source')
