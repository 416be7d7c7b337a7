"""What skeletons tell of bodies in the image: how large they are, and which are the same."""
from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from depth_person.pose.skeleton import Keypoint

Array = NDArray[np.float32]
Bools = NDArray[np.bool_]

#: Spread of marks where sizes are those that body_sizes tells, see likeness.
_MARK_SPREAD = 0.05
#: Two skeletons more alike than this are the same person.
_SAME_PERSON = 0.45
#: So are two that lie this near, over the smaller one's size, and differ less in size.
_SAME_PLACE = 0.18
_SAME_SIZE = 1.7
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
    low, high = np.fmin.reduce(points, -2), np.fmax.reduce(points, -2)  # which ignore NaN
    return np.concatenate([low, high], -1)


def body_sizes(points: Array) -> Array:
    """
    Return about how high each person would stand in the image, pixels.

    The longest that any part of the body tells: foreshortening makes lengths only shorter. It is
    meant for people of whom a few keypoints or all are seen.

    :param points: (n, 18, 2), NaN where missing; one at least is not.
    """
    parts = points[:, _FROM] - points[:, _TO]
    told = np.hypot(parts[..., 0], parts[..., 1]) * _TIMES
    around = boxes(points)
    longer = (around[:, 2:] - around[:, :2]).max(-1) * _BOX_TIMES
    return np.fmax(longer, np.fmax.reduce(told, 1, initial=0)).astype(np.float32)


def mean_apart(points: Array, others: Array) -> NDArray[np.floating]:
    """Return (n, m) the mean distance of the keypoints that two have; infinite for none."""
    distance = points[:, None] - others[None]
    return mean_known(np.hypot(distance[..., 0], distance[..., 1]))


def mean_known(values: Array) -> NDArray[np.floating]:
    """Return the means along the last axis of what is known, not NaN; infinite for none."""
    known = np.isfinite(values)
    count = known.sum(-1)
    mean = np.where(known, values, np.float32(0)).sum(-1) / np.maximum(count, 1)
    return np.where(count > 0, mean, np.inf)


def likeness(
    first: Array, second: Array, first_sizes: Array, second_sizes: Array, *,
    spread: float = _MARK_SPREAD,
) -> Array:
    """
    Return (n, m) how alike skeletons are: 1 the same, 0 nothing in common.

    :param first: (n, k, 2), NaN where missing.
    :param second: (m, k, 2).
    :param first_sizes: (n,) of the bodies; the smaller of two counts.
    :param spread: distance of two marks of one keypoint at which they are half alike, over the
        body's size.
    """
    size = np.minimum(first_sizes[:, None], second_sizes[None])
    apart = first[:, None] - second[None]
    apart = np.hypot(apart[..., 0], apart[..., 1]) / (spread * size)[..., None]
    near = np.exp2(-np.square(apart))
    near[np.isnan(near)] = 0
    seen, other_seen = (np.isfinite(each[..., 0]).sum(1) for each in (first, second))
    return near.sum(2) / np.maximum(np.minimum(seen[:, None], other_seen[None]), 1)


def same_people(points: Array, sizes: Array, *, strict: Bools | None = None) -> Bools:
    """
    Return (n, n) whether two skeletons are of one person, none being the same as itself.

    :param points: (n, 18, 2), NaN where missing.
    :param sizes: (n,) as body_sizes tells them.
    :param strict: (n,) of whom it is known that they are somebody: two of them are the same
        only when they are alike keypoint by keypoint.
    """
    alike = likeness(points, points, sizes, sizes) > _SAME_PERSON
    middles = points[:, None] - points[None]
    common = np.isfinite(middles[..., 0])
    shift = np.where(common[..., None], middles, 0).sum(2) / np.maximum(
        common.sum(2), 1)[..., None]
    smaller = np.minimum(sizes[:, None], sizes[None])
    near = (np.hypot(shift[..., 0], shift[..., 1]) < _SAME_PLACE * smaller) & common.any(2)
    near &= np.maximum(sizes[:, None], sizes[None]) < _SAME_SIZE * smaller
    if strict is not None:
        near &= ~(strict[:, None] & strict[None])
    same = alike | near
    np.fill_diagonal(same, False)
    return same
