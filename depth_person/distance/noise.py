"""How far from its true place a network marks a keypoint."""
from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

#: Spread of a sure keypoint: a part fixed in pixels, and a part that grows with the person.
SIGMA_PX = 0.8
SIGMA_OF_SIZE = 0.008
#: Scores below this are no less sure than it.
LOWEST_SCORE = 0.05


def keypoint_sigma(keypoints: NDArray[np.floating]) -> NDArray[np.float64]:
    """
    Return the standard deviation of each keypoint's u, and of its v.

    A keypoint of score 1 has sqrt(0.8^2 + (0.008 size)^2) pixels, where size is the diagonal of
    the box round the person's keypoints; a lower score divides that by its square root.

    :param keypoints: (n, 18, 3): u, v, score; NaN where missing.
    :returns: (n, 18) pixels; NaN where the keypoint is missing.
    """
    keypoints = np.asarray(keypoints, np.float64)
    pixels, scores = keypoints[..., :2], keypoints[..., 2]
    known = np.isfinite(keypoints).all(axis=-1)
    with np.errstate(all='ignore'):
        highest = np.where(known[..., None], pixels, -np.inf).max(axis=1)
        lowest = np.where(known[..., None], pixels, np.inf).min(axis=1)
        size = np.hypot(*(highest - lowest).T)
        sure = np.hypot(SIGMA_PX, SIGMA_OF_SIZE * size)
        sigma = sure[:, None] / np.sqrt(np.clip(scores, LOWEST_SCORE, 1.0))
    return np.where(known, sigma, np.nan)
