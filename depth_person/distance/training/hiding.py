"""Which keypoints of a training person a network does not find, and which it mixes up."""
from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from depth_person.distance.canonical import LEFT, RIGHT
from depth_person.pose.skeleton import Keypoint, N_KEYPOINTS

_EYES_AND_NOSE = [Keypoint.NOSE, Keypoint.R_EYE, Keypoint.L_EYE]
_EARS = [Keypoint.R_EAR, Keypoint.L_EAR]
_FACE = [*_EYES_AND_NOSE, *_EARS]
_ARMS = [Keypoint.R_ELBOW, Keypoint.R_WRIST, Keypoint.L_ELBOW, Keypoint.L_WRIST]
_HIPS = [Keypoint.R_HIP, Keypoint.L_HIP]
_ANKLES = [Keypoint.R_ANKLE, Keypoint.L_ANKLE]
_LEGS = [Keypoint.R_KNEE, Keypoint.L_KNEE, *_ANKLES]
_BELOW_SHOULDERS = [*_ARMS, *_HIPS, *_LEGS]
_BODY = [Keypoint.NECK, Keypoint.R_SHOULDER, Keypoint.L_SHOULDER, *_BELOW_SHOULDERS]

#: What may be hidden at once, and how often it is.
PATTERNS: tuple[tuple[float, Sequence[int]], ...] = (
    (0.34, []),
    (0.06, _ANKLES),
    (0.08, _LEGS),
    (0.10, [*_LEGS, *_HIPS]),
    (0.09, _BELOW_SHOULDERS),
    (0.10, _BODY),
    (0.03, _FACE),
    (0.03, [*_FACE, *_LEGS]),
    (0.04, _ARMS),
)
#: What is left is cut by an edge across the image: a border, a wall, a doorpost.
_EDGE = 1.0 - sum(share for share, _ in PATTERNS)


def visible(
    rng: np.random.Generator, points: NDArray[np.floating], yaw: NDArray[np.floating],
) -> NDArray[np.bool_]:
    """
    Return (n, 18) which keypoints a network might find.

    :param points: (n, 18, 2) in the image, y down.
    :param yaw: (n,) radians; 0 faces the camera.
    """
    n = len(points)
    shown = np.ones((n, N_KEYPOINTS), bool)
    shares = [*(share for share, _ in PATTERNS), _EDGE]
    drawn = rng.choice(len(shares), n, p=np.array(shares))
    for index, (_, rows) in enumerate(PATTERNS):
        shown[np.ix_(drawn == index, rows)] = False
    shown &= ~((drawn == len(PATTERNS))[:, None] & _beyond_edge(rng, points))
    shown &= _not_behind_itself(rng, yaw)
    shown &= rng.random((n, N_KEYPOINTS)) > rng.choice([0.0, 0.06, 0.25], (n, 1), p=[.5, .35, .15])
    shown[:, Keypoint.NECK] &= rng.random(n) < 0.2  # few networks mark a neck of their own
    return shown


def _beyond_edge(
    rng: np.random.Generator, points: NDArray[np.floating],
) -> NDArray[np.bool_]:
    """Return (n, 18) which keypoints lie beyond a random straight edge, mostly an upright one."""
    n = len(points)
    turn = rng.choice([0.0, 0.5, 1.0], n, p=[0.4, 0.2, 0.4]) * np.pi + rng.normal(0, 0.15, n)
    along = points[..., 0] * np.cos(turn)[:, None] + points[..., 1] * np.sin(turn)[:, None]
    order = np.sort(along, axis=1)
    cut = order[np.arange(n), rng.integers(5, N_KEYPOINTS, n)]
    return along > cut[:, None]


def _not_behind_itself(
    rng: np.random.Generator, yaw: NDArray[np.floating],
) -> NDArray[np.bool_]:
    """Return (n, 18) which keypoints the person's own body lets be found."""
    n = len(yaw)
    shown = np.ones((n, N_KEYPOINTS), bool)
    facing, side = np.cos(yaw), np.sin(yaw)
    strict = rng.random(n) < 0.6  # the others are found or guessed all the same
    shown[:, _EYES_AND_NOSE] &= ~(strict & (facing < -0.3))[:, None]
    ears = rng.random(n) < 0.4
    shown[:, _EARS] &= ~(ears & (facing > 0.9))[:, None]
    for rows, far in ((RIGHT, side > 0.6), (LEFT, side < -0.6)):
        hidden = (strict & far)[:, None] & (rng.random((n, len(rows))) < 0.6)
        shown[:, rows] &= ~hidden
    return shown


def swapped(rng: np.random.Generator, yaw: NDArray[np.floating]) -> NDArray[np.bool_]:
    """Return (n, 18) which keypoints a network takes for those of the other side."""
    n = len(yaw)
    share = np.where(np.cos(yaw) < -0.2, 0.3, 0.02)
    whole = rng.random(n) < 0.7 * share
    limbs = rng.random((n, len(LEFT))) < (0.2 * share)[:, None]
    result = np.zeros((n, N_KEYPOINTS), bool)
    result[:, LEFT] = result[:, RIGHT] = whole[:, None] | limbs
    return result
