"""A skeleton freed of where in the image it stands, how it is rolled and how large it is."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depth_person.distance.vectors import unit
from depth_person.pose.skeleton import Keypoint, N_KEYPOINTS

_Array = NDArray[np.float64]

#: Left and right keypoints, pair by pair.
LEFT = np.array([row for row in Keypoint if row.name.startswith('L_')])
RIGHT = np.array([Keypoint['R_' + Keypoint(row).name[2:]] for row in LEFT])
#: For each keypoint the one that it becomes in a mirror.
MIRRORED = np.arange(N_KEYPOINTS)
MIRRORED[LEFT], MIRRORED[RIGHT] = RIGHT, LEFT


def _template() -> _Array:
    """Return the (18, 2) keypoints of an upright average adult: across and down, metres."""
    half = {'SHOULDER': (0.13, 0.0), 'ELBOW': (0.19, 0.25), 'WRIST': (0.19, 0.48),
            'HIP': (0.08, 0.5), 'KNEE': (0.09, 0.88), 'ANKLE': (0.10, 1.27),
            'EYE': (0.025, -0.21), 'EAR': (0.055, -0.2)}
    points = np.zeros((N_KEYPOINTS, 2))
    points[Keypoint.NOSE] = 0.0, -0.18
    for name, (across, down) in half.items():
        points[Keypoint['L_' + name]] = across, down
        points[Keypoint['R_' + name]] = -across, down
    return points


TEMPLATE = _template()
_WIDTH = TEMPLATE[LEFT, 0]
# Below this length, metres of the template, two directions are one for rounding's sake.
_TINY = 1e-9
_QUARTER_TURN = np.array([-1.0, 1.0])  # of a vector (y, x)
_UPRIGHT = np.array([0.0, 1.0])
# View rays farther than this from a person's centre (cosine) do not belong to the person.
_WIDEST = 0.2


@dataclass(frozen=True, eq=False)
class Canonical:
    """
    Skeletons seen by virtual cameras turned at their centres and rolled with their bodies.

    :ivar points: (n, 18, 2) on the plane z = 1 from the centroid, times guess: metres, had the
        person the template's size; x to the right, y down the body; 0 where unknown.
    :ivar known: (n, 18) whether the keypoint is there.
    :ivar guess: (n,) range at which the template would look as large, metres; NaN for none.
    :ivar rotation: (n, 3, 3) from the camera optical frame to the virtual camera's.
    :ivar centroid: (n, 2) on the plane z = 1 of the virtual camera.
    """

    points: _Array
    known: NDArray[np.bool_]
    guess: _Array
    rotation: _Array
    centroid: _Array


def canonicalise(rays: _Array, known: NDArray[np.bool_]) -> Canonical:
    """
    Return skeletons in the coordinates that the learned lifter takes.

    Turning the camera on the spot changes no range, so the centre may be put on the optical axis
    exactly; the roll is taken from the skeleton itself. Nothing here depends on scores.

    :param rays: (n, 18, 3) unit view rays in the camera optical frame; any where unknown.
    :param known: (n, 18).
    """
    rays = np.where(known[..., None], rays, 0.0)
    both = np.empty((2, *known.shape, 2))  # the skeletons, and the template as they are seen
    both[1] = TEMPLATE
    with np.errstate(all='ignore'):
        rotation = _turn_to(rays.sum(axis=1))
        turned = rays @ rotation.transpose(0, 2, 1)
        known = known & (turned[..., 2] > _WIDEST)
        np.divide(turned[..., :2], turned[..., 2:], out=both[0])
        (points, template), (centroid, _) = _centred(both, known)
        roll = _roll(points, template, known)
        size, template_size = (points ** 2).sum(axis=(1, 2)), (template ** 2).sum(axis=(1, 2))
        guess = np.sqrt(template_size / size)
    full_roll = np.zeros_like(rotation)
    full_roll[:, :2, :2], full_roll[:, 2, 2] = roll, 1.0
    return Canonical(
        points=(points @ roll.transpose(0, 2, 1)) * guess[:, None, None], known=known,
        guess=np.where(np.isfinite(guess) & (guess > 0), guess, np.nan),
        rotation=full_roll @ rotation, centroid=np.einsum('nij,nj->ni', roll, centroid))


def _centred(points: _Array, known: NDArray[np.bool_]) -> tuple[_Array, _Array]:
    """Return known points (..., n, 18, 2) from their centroids, zero where unknown, and these."""
    there = known[..., None]
    weight = there / np.maximum(known.sum(axis=1), 1)[:, None, None]
    centroid = (weight * np.where(there, points, 0.0)).sum(axis=-2)
    return np.where(there, points - centroid[..., None, :], 0.0), centroid


def _turn_to(direction: _Array) -> _Array:
    """Return the smallest rotations (n, 3, 3) that bring directions (n, 3) onto the z axis."""
    x, y, z = unit(direction).T
    c = 1 / (1 + z)
    rotation = np.empty((len(direction), 3, 3))
    rotation[:, 0, 0], rotation[:, 1, 1], rotation[:, 2, 2] = 1 - c * x * x, 1 - c * y * y, z
    rotation[:, 0, 1] = rotation[:, 1, 0] = -c * x * y
    rotation[:, 2, 0], rotation[:, 2, 1] = x, y
    rotation[:, :2, 2] = -rotation[:, 2, :2]
    return rotation


def _roll(points: _Array, template: _Array, known: NDArray[np.bool_]) -> _Array:
    """
    Return the (n, 2, 2) rotations that bring the body's own down to +y.

    Down is where the template's lower keypoints lie from its higher ones; across the line from
    right to left keypoints, which is square to it, steadies a lone head.
    """
    down = (template[..., 1:] * points).sum(axis=1)
    both = known.take(LEFT, axis=1) & known.take(RIGHT, axis=1)
    width = np.where(both, _WIDTH, 0.0)[..., None]
    across = (width * (points.take(LEFT, axis=1) - points.take(RIGHT, axis=1))).sum(axis=1)
    square = across[:, ::-1] * _QUARTER_TURN
    along = down[:, 0] * square[:, 0] + down[:, 1] * square[:, 1]
    down = down + np.where(along < 0, -0.5, 0.5)[:, None] * square
    length = np.hypot(down[:, 0], down[:, 1])[:, None]
    x, y = np.where(length > _TINY, down / length, _UPRIGHT).T
    roll = np.empty((len(down), 2, 2))
    roll[:, 0, 0], roll[:, 0, 1], roll[:, 1, 0], roll[:, 1, 1] = y, -x, x, y
    return roll
