"""What skeletons tell of bodies in the image: how large they are, and which are the same."""
from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from depth_person.pose.skeleton import Keypoint

Array = NDArray[np.float32]

#: Distance of two marks of one keypoint at which they are half alike, over the body's size.
_MARK_SPREAD = 0.05
#: Lengths between pairs of keypoints, and how often each goes into a person's height. Rather too
#: often: a length that is seen at an angle is too short.
_PARTS = (
    (Keypoint.R_SHOULDER, Keypoint.L_SHOULDER, 4.6),
    (Keypoint.R_EAR, Keypoint.L_EAR, 9.0),
    (Keypoint.R_EYE, Keypoint.L_EYE, 18.0),
    (Keypoint.R_SHOULDER, Keypoint.R_HIP, 3.0),
    (Keypoint.L_SHOULDER, Keypoint.L_HIP, 3.0),
    (Keypoint.NOSE, Keypoint.NECK, 6.5),
    (Keypoint.R_HIP, Keypoint.R_KNEE, 3.6),
    (Keypoint.L_HIP, Keypoint.L_KNEE, 3.6),
)
_FROM, _TO = (np.array([part[index] for part in _PARTS]) for index in (0, 1))
_TIMES = np.array([times for _, _, times in _PARTS], np.float32)
#: Times the longer side of the box around all keypoints, which ends at eyes and ankles.
_BOX_TIMES = np.float32(1.12)


def boxes(points: Array) -> Array:
    """
    Return the boxes x0, y0, x1, y1 around the keypoints that there are.

    :param points: (..., k, 2), NaN where missing; one at least is not.
    """
    low = np.where(np.isnan(points), np.inf, points).min(-2)
    high = np.where(np.isnan(points), -np.inf, points).max(-2)
    return np.concatenate([low, high], -1)


def body_sizes(points: Array) -> Array:
    """
    Return about how high each person would stand in the image, pixels.

    The longest that any part of the body tells: foreshortening makes lengths only shorter. It is
    meant for people of whom a few keypoints or all are seen.

    :param points: (n, 18, 2), NaN where missing; one at least is not.
    """
    parts = points[:, _FROM] - points[:, _TO]
    told = np.nan_to_num(np.hypot(parts[..., 0], parts[..., 1]) * _TIMES)
    around = boxes(points)
    longer = (around[:, 2:] - around[:, :2]).max(-1) * _BOX_TIMES
    return np.maximum(longer, told.max(1)).astype(np.float32)


def likeness(first: Array, second: Array, first_sizes: Array, second_sizes: Array) -> Array:
    """
    Return (n, m) how alike skeletons are: 1 the same, 0 nothing in common.

    :param first: (n, 18, 2), NaN where missing.
    :param second: (m, 18, 2).
    :param first_sizes: (n,) as body_sizes tells them; the smaller of two counts.
    """
    size = np.minimum(first_sizes[:, None], second_sizes[None])
    apart = first[:, None] - second[None]
    apart = np.hypot(apart[..., 0], apart[..., 1]) / (_MARK_SPREAD * size)[..., None]
    near = np.exp2(-np.nan_to_num(apart, nan=np.inf) ** 2)
    seen, other_seen = (np.isfinite(each[..., 0]).sum(1) for each in (first, second))
    return near.sum(2) / np.maximum(np.minimum(seen[:, None], other_seen[None]), 1)
