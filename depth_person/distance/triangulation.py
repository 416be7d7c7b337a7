"""Depth from the images of two shoulders and the neck between them."""
from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def shoulder_depth(
    left: ArrayLike, right: ArrayLike, neck: ArrayLike | None, *,
    focal_length: ArrayLike, shoulder_width: ArrayLike,
) -> NDArray[np.float64]:
    """
    Return the depth of the point midway between two shoulders a known width apart.

    This is Algorithm 1 of the source paper. With O the camera's centre, L and R the shoulders'
    images as points (x, y, f), beta = angle OLR, gamma = pi - angle ORL, theta = angle ROL and l
    the width, the parallel to LR through the neck is split by it into a and b as LR is by its
    image, and

    - cot(alpha) = ((a/b) sin(beta) / sin(gamma) - cos(theta)) / sin(theta),
    - a = l/2 sin(alpha + theta) / sin(beta), b = l/2 sin(alpha) / sin(gamma),
    - depth = (a + b) / |LR| f.

    (The paper prints a = 1/2 ..., which lacks the length l.) With a/b = s / (1 - s), where s
    is how far along LR the neck appears, and the sines in the triangle OLR, the three lines
    are one, which is what is computed:

        depth = f l / (2 |(1 - s) L - s R|)

    It is the same whichever shoulder is called the left, needs none of the paper's four cases,
    and has no 0/0 where rays are nearly parallel. Given the true image of the midpoint it is
    exact, for a shoulder line in any place and any direction, rolled and pitched ones included,
    since all of it lies in the plane OLR. With the midpoint of the images instead (s = 1/2) it is
    f l / |LR|, exact only for a shoulder line parallel to the image plane, and otherwise too far:
    by 1 / cos(yaw) on the axis.

    A neck beside the line LR counts as its foot on the line. No neck can appear on a shoulder or
    beyond it, so one whose foot lies there gives NaN instead of being moved.

    :param left: (..., 2) undistorted pixels from the principal point.
    :param right: (..., 2) likewise; all arguments are broadcast together.
    :param neck: (..., 2) likewise; None for the midpoint of the two images.
    :param focal_length: (...) pixels; 1 where coordinates are those on the plane z = 1.
    :param shoulder_width: (...) metres.
    :returns: (...) metres along the optical axis; NaN where a value is not finite, the shoulders
        coincide, or the geometry has no solution.
    """
    left, right = np.asarray(left, np.float64), np.asarray(right, np.float64)
    focal_length = np.asarray(focal_length, np.float64)
    with np.errstate(all='ignore'):
        split = np.float64(0.5) if neck is None else _split(left, right, np.asarray(neck))
        across = (1 - split)[..., None] * left - split[..., None] * right
        along = (1 - 2 * split) * focal_length
        norm = np.sqrt(across[..., 0] ** 2 + across[..., 1] ** 2 + along ** 2)
        depth = focal_length * np.asarray(shoulder_width, np.float64) / (2 * norm)
    return np.where(np.isfinite(depth) & (depth > 0), depth, np.nan)


def _split(
    left: NDArray[np.float64], right: NDArray[np.float64], neck: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return how far from left (0) to right (1) the foot of the neck lies; NaN if not between."""
    line = right - left
    split = ((neck - left) * line).sum(-1) / (line * line).sum(-1)
    return np.where((split > 0) & (split < 1), split, np.nan)
