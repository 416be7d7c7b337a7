"""Where the crops lie on which people are marked."""
from __future__ import annotations

import numpy as np

from depth_person.pose.bodies import Array, boxes

#: Sides of crops: around the keypoints, and at least and at most, over the body's size.
_CROP_AROUND, _LEAST_CROP, _MOST_CROP = 1.15, 0.75, 1.05
#: Least side of a crop that holds all of a person that is inside the frame.
_LEAST_IN_FRAME = 0.3


def crops_around(
    points: Array, sizes: Array, *, width: int, height: int,
) -> tuple[Array, Array]:
    """
    Return the centres (n, 2) and sides (n,) of the crops on which people are marked.

    A body that fills the crop is marked best; one of which part is hidden may show more next,
    unless what is missing is outside the frame.

    :param points: (n, 18, 2) where keypoints are expected, NaN where nobody knows.
    :param sizes: (n,) of the bodies.
    :param width: of the frame, pixels.
    """
    around = boxes(points)
    low, high = around[:, :2], around[:, 2:]
    around_sides = _CROP_AROUND * (high - low).max(1)
    sides = np.minimum(np.maximum(around_sides, _LEAST_CROP * sizes), _MOST_CROP * sizes)
    middles, frame = (low + high) / 2, np.array([width, height]) - 0.5
    halves = sides[:, None] / 2
    low = np.minimum(np.maximum(middles - halves, -0.5), frame)
    high = np.minimum(np.maximum(middles + halves, -0.5), frame)
    sides = np.minimum(np.maximum((high - low).max(1), _LEAST_IN_FRAME * sizes), sides)
    return ((low + high) / 2).astype(np.float32), sides.astype(np.float32)
