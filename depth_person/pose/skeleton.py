"""The keypoint layout of the package: OpenPose COCO-18; right and left are the person's own."""
from __future__ import annotations

from enum import IntEnum

import numpy as np
from numpy.typing import NDArray


class Keypoint(IntEnum):
    """Rows of a skeleton, in the order of OpenPose COCO-18."""

    NOSE = 0
    NECK = 1
    R_SHOULDER = 2
    R_ELBOW = 3
    R_WRIST = 4
    L_SHOULDER = 5
    L_ELBOW = 6
    L_WRIST = 7
    R_HIP = 8
    R_KNEE = 9
    R_ANKLE = 10
    L_HIP = 11
    L_KNEE = 12
    L_ANKLE = 13
    R_EYE = 14
    L_EYE = 15
    R_EAR = 16
    L_EAR = 17


N_KEYPOINTS = len(Keypoint)

#: For each COCO-18 row, its row in COCO-17 (nose, l/r eye, l/r ear, l/r shoulder, ...); the neck
#: has none and holds -1.
COCO17_ROWS = np.array([0, -1, 6, 8, 10, 5, 7, 9, 12, 14, 16, 11, 13, 15, 2, 1, 4, 3])

#: Pairs of keypoints that a drawing joins.
LIMBS = (
    (1, 2), (2, 3), (3, 4), (1, 5), (5, 6), (6, 7), (1, 8), (8, 9), (9, 10), (1, 11), (11, 12),
    (12, 13), (1, 0), (0, 14), (14, 16), (0, 15), (15, 17),
)


def from_coco17(keypoints: NDArray[np.floating]) -> NDArray[np.float32]:
    """
    Return COCO-18 keypoints for COCO-17 ones, with the neck at the shoulders' midpoint.

    The neck's score is the lower of the shoulders' two; where either shoulder is missing (NaN)
    so is the neck.

    :param keypoints: (n, 17, 3): u, v, score.
    :returns: (n, 18, 3) float32.
    """
    result = np.asarray(keypoints, np.float32)[:, COCO17_ROWS]
    right, left = result[:, Keypoint.R_SHOULDER], result[:, Keypoint.L_SHOULDER]
    result[:, Keypoint.NECK, :2] = (right[:, :2] + left[:, :2]) / 2
    result[:, Keypoint.NECK, 2] = np.minimum(right[:, 2], left[:, 2])
    return result
