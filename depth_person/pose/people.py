from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from depth_person.pose.skeleton import N_KEYPOINTS


@dataclass(frozen=True, eq=False)
class People:
    """
    The people that the pose stage found in one frame.

    :ivar keypoints: (n, 18, 3) float32: u and v in raw (distorted) pixels with pixel centres at
        integers, score 0 to 1. The order is OpenPose COCO-18; a missing keypoint is all NaN.
    :ivar track_ids: (n,) int32, stable over time, never reused.
    :ivar neck_measured: whether the network marked the neck itself; otherwise keypoint 1 is the
        midpoint of the shoulders, and tells nothing that they do not.
    :ivar convention: where the network marks keypoints: a name of
        depth_person.distance.conventions; `coco` for a network that nobody has measured.
    """

    keypoints: NDArray[np.float32]
    track_ids: NDArray[np.int32] = field(default_factory=lambda: np.empty(0, np.int32))
    neck_measured: bool = False
    convention: str = 'coco'

    def __post_init__(self) -> None:
        if self.keypoints.shape[1:] != (N_KEYPOINTS, 3):
            raise ValueError(f'keypoints of shape {self.keypoints.shape}, not (n, 18, 3)')
        if self.track_ids.shape != self.keypoints.shape[:1]:
            raise ValueError(f'{self.track_ids.size} track ids for {len(self)} people')

    def __len__(self) -> int:
        return len(self.keypoints)

    @classmethod
    def nobody(cls) -> People:
        """Return the people of an empty frame."""
        return cls(np.empty((0, N_KEYPOINTS, 3), np.float32))
