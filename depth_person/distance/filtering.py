"""The Kalman filter of people's motion; many people at once, and nothing of tracks or stamps."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depth_person.distance.motion import Motion
from depth_person.distance.scale import ErrorShares, VIEW_TIME_S
from depth_person.distance.states import BODY, IDENTITY, N_STATES, POSITION, States, VELOCITY, VIEW
from depth_person.distance.vectors import polar, UNIT_MATRIX

_Array = NDArray[np.float64]

#: A measurement less likely than one in a thousand (chi-square, 3 degrees) is an outlier.
GATE = 16.27
# Nearer than this, metres, the geometry is that of this range.
_NEAREST = 0.2
# One measurement brings nobody nearer by more than this, a logarithm of range: what is linear
# here overshoots beyond it, to behind the camera.
_STEP_NEARER = 0.5


@dataclass(frozen=True, eq=False)
class Update:
    """
    States after a measurement.

    :ivar states: of the same people.
    :ivar off: (n,) squared Mahalanobis distance of the measurement from what was expected.
    """

    states: States
    off: _Array

    @property
    def likely(self) -> NDArray[np.bool_]:
        """(n,) whether the measurement is no outlier."""
        return self.off <= GATE


def started(
    measured: _Array, shares: ErrorShares, origin: _Array, motion: Motion,
) -> States:
    """
    Return the states of people of whom one measurement is known.

    :param measured: (n, 3) positions.
    :param shares: what their errors are made up of.
    :param origin: (3,) where the camera is.
    """
    n = len(measured)
    away = measured - origin
    distance, ray = polar(away)
    mean = np.zeros((n, N_STATES))
    mean[:, POSITION] = measured
    errors = np.stack([shares.body, shares.view], axis=-1)
    along = ray[:, :, None] * ray[:, None]
    covariance = np.zeros((n, N_STATES, N_STATES))
    covariance[:, POSITION, POSITION] = (
        (shares.variance * distance ** 2)[:, None, None] * along
        + (shares.across ** 2)[:, None, None] * (UNIT_MATRIX - along))
    covariance[:, POSITION, BODY:] = -away[:, :, None] * errors[:, None]
    covariance[:, BODY:, POSITION] = covariance[:, POSITION, BODY:].transpose(0, 2, 1)
    covariance[:, VELOCITY, VELOCITY] = motion.velocities(away)
    covariance[:, BODY, BODY] = covariance[:, VIEW, VIEW] = 1.0
    return States(mean, covariance)


def predicted(states: States, elapsed_s: float, motion: Motion, origin: _Array) -> States:
    """
    Return the states so much later: constant velocity, changed by white accelerations.

    :param origin: (3,) where the camera is.
    """
    memory = np.exp(-elapsed_s / VIEW_TIME_S)
    step = IDENTITY.copy()
    step[POSITION, VELOCITY] = elapsed_s * UNIT_MATRIX
    step[VIEW, VIEW] = memory
    covariance = step @ states.covariance @ step.T
    intensity = motion.accelerations(states.mean[:, POSITION] - origin)
    covariance[:, POSITION, POSITION] += elapsed_s ** 3 / 3 * intensity
    covariance[:, POSITION, VELOCITY] += elapsed_s ** 2 / 2 * intensity
    covariance[:, VELOCITY, POSITION] += elapsed_s ** 2 / 2 * intensity
    covariance[:, VELOCITY, VELOCITY] += elapsed_s * intensity
    covariance[:, VIEW, VIEW] += 1 - memory ** 2
    return States(states.mean @ step.T, covariance)


def updated(
    states: States, measured: _Array, shares: ErrorShares, origin: _Array,
) -> Update:
    """
    Return what measurements make of the states, and how far off they are.

    The measured logarithm of range and the two directions across the ray are each linear
    in the state where it is; the covariance is Joseph's form, symmetric and positive.

    :param measured: (n, 3) positions in the states' frame.
    :param shares: what their errors are made up of.
    :param origin: (3,) where the camera is.
    """
    away, seen = states.mean[:, POSITION] - origin, measured - origin
    (distance, ray), (seen_distance, seen_ray) = polar(away), polar(seen)
    near = np.maximum(distance, _NEAREST)
    axes = _axes(ray)
    innovation = (axes @ seen_ray[..., None])[..., 0]
    innovation[:, 0] = (np.log(seen_distance / near)
                        - shares.body * states.mean[:, BODY] - shares.view * states.mean[:, VIEW])
    slope = np.zeros((len(near), 3, N_STATES))
    slope[:, :, POSITION] = axes / near[:, None, None]
    slope[:, 0, BODY], slope[:, 0, VIEW] = shares.body, shares.view
    noise = np.zeros((len(near), 3, 3))
    noise[:, 0, 0] = shares.noise ** 2
    noise[:, 1, 1] = noise[:, 2, 2] = (shares.across / near) ** 2
    projected = slope @ states.covariance
    spread = projected @ slope.transpose(0, 2, 1) + noise
    solved = np.linalg.solve(
        spread, np.concatenate([projected, innovation[..., None]], axis=2))
    gain = solved[..., :N_STATES].transpose(0, 2, 1)
    off = (innovation * solved[..., N_STATES]).sum(axis=1)
    np.maximum(innovation[:, 0], -_STEP_NEARER, out=innovation[:, 0])
    rest = IDENTITY - gain @ slope
    covariance = (rest @ states.covariance @ rest.transpose(0, 2, 1)
                  + gain @ noise @ gain.transpose(0, 2, 1))
    return Update(
        States(states.mean + (gain @ innovation[..., None])[..., 0], covariance),
        np.where((away * seen).sum(axis=1) > 0, off, np.inf))


def _axes(ray: _Array) -> _Array:
    """Return (n, 3, 3) rows: unit vectors (n, 3), and two across them (Householder)."""
    sign = np.where(ray[:, :1] < 0, -1.0, 1.0)
    mirror = ray * sign
    mirror[:, 0] += 1.0
    half = (mirror ** 2).sum(axis=1)[:, None, None] / 2
    axes = UNIT_MATRIX - mirror[:, :, None] * mirror[:, None] / half
    axes[:, 0] = ray
    return axes
