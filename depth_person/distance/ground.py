"""Range without a body prior: where a person's feet meet the ground below the camera."""
from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from depth_person.distance.conventions import Placement
from depth_person.distance.estimator import Mounting
from depth_person.pose.skeleton import Keypoint

_Array = NDArray[np.float64]

#: Leg keypoints from the lowest up: their rows, and their height above the ground with its
#: spread, metres; the adults of the training population in shoes, ankles lifted in walking.
LEGS = (
    ((Keypoint.R_ANKLE, Keypoint.L_ANKLE), 0.10, 0.03),
    ((Keypoint.R_KNEE, Keypoint.L_KNEE), 0.49, 0.06),
    ((Keypoint.R_HIP, Keypoint.L_HIP), 0.87, 0.09),
)
#: Lengths of the shank and the torso of the same people, metres: what a Placement counts in.
SHANK = 0.39
TORSO = 0.50
#: How far beside the feet's middle the neck stands, metres: leaning, and a stride of which only
#: one leg is seen.
LEAN = 0.08
STRIDE = 0.12
# Legs seen less steeply than this (sine) from above say nothing; nor from less above (metres).
_SHALLOWEST = 0.015
_LOWEST = 0.15


def ground_range(
    rays: _Array, noise_rad: _Array, neck: _Array, mounting: Mounting, *,
    placement: Placement,
) -> tuple[_Array, _Array]:
    """
    Return the logarithm of the range to the necks, and its spread; NaN where legs do not tell.

    The view ray of the lowest visible leg keypoint meets the level at which such keypoints are;
    the neck is taken to stand above that point. The spread holds the errors of the camera's
    attitude and height, of the keypoint's level, of its place in the image and of leaning.

    :param rays: (n, 18, 3) unit view rays in the camera optical frame; NaN where unknown.
    :param noise_rad: (n, 18) spreads of the keypoints, radians.
    :param neck: (n, 3) unit view rays of the necks.
    :param mounting: with gravity and height.
    :param placement: where on the legs the network marks them.
    :returns: (n,) and (n,).
    """
    log_range = np.full(len(rays), np.nan)
    sigma = np.full(len(rays), np.nan)
    if mounting.gravity is None or mounting.height is None:
        return log_range, sigma
    down = np.asarray(mounting.gravity, np.float64)
    raised = (-placement.ankle_drop * SHANK, 0.0, -placement.hip_drop * TORSO)
    for (rows, level, level_sigma), rise in zip(LEGS, raised, strict=True):
        told = _from_leg(rays[:, rows], noise_rad[:, rows], neck, mounting, down,
                         level + rise, level_sigma)
        first = np.isnan(log_range) & np.isfinite(told).all(axis=0)
        log_range[first], sigma[first] = told[0][first], told[1][first]
        if first.all():
            break
    return log_range, sigma


def _from_leg(
    rays: _Array, noise_rad: _Array, neck: _Array, mounting: Mounting, down: _Array,
    level: float, level_sigma: float,
) -> tuple[_Array, _Array]:
    """Return log-range and spread from the right and left keypoint (n, 2, 3) of one kind."""
    assert mounting.height is not None
    above = mounting.height - level
    if above < _LOWEST:
        return np.full(len(rays), np.nan), np.full(len(rays), np.nan)
    steep = rays @ down
    known = steep > _SHALLOWEST
    count = known.sum(axis=1)
    with np.errstate(all='ignore'):
        feet = above * (rays / steep[..., None] - down)
        foot = np.where(known[..., None], feet, 0.0).sum(axis=1) / count[:, None]
        sine = np.where(known, steep, 0.0).sum(axis=1) / count
        noise = np.sqrt(np.where(known, noise_rad ** 2, 0.0).sum(axis=1)) / count
        level_part = neck - (neck @ down)[:, None] * down
        cosine = np.linalg.norm(level_part, axis=1)
        away = (foot * level_part).sum(axis=1) / cosine
        aside = np.hypot(LEAN, np.where(count == 1, STRIDE, 0.0))
        tilt = 1 / (sine * np.sqrt(1 - sine ** 2))
        variance = (
            (mounting.height_sigma ** 2 + level_sigma ** 2) / above ** 2
            + tilt ** 2 * (mounting.gravity_sigma ** 2 + noise ** 2)
            + (aside / away) ** 2)
        return np.log(np.where(away > 0, away / cosine, np.nan)), np.sqrt(variance)
