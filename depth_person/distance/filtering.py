"""The Kalman filter of people's motion; many people at once, and nothing of tracks or stamps."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depth_person.distance.scale import ErrorShares, VIEW_TIME_S
from depth_person.distance.vectors import length, unit_or_zero

_Array = NDArray[np.float64]

#: Where position, velocity, body and view are in a state.
POSITION, VELOCITY, BODY, VIEW = slice(0, 3), slice(3, 6), 6, 7
N_STATES = 8
#: A measurement less likely than one in a thousand (chi-square, 3 degrees) is an outlier.
GATE = 16.27
# Nearer than this, metres, the geometry is that of this range.
_NEAREST = 0.2
# One measurement brings nobody nearer by more than this, a logarithm of range: what is linear
# here overshoots beyond it, to behind the camera.
_STEP_NEARER = 0.5


@dataclass(frozen=True)
class Motion:
    """
    What is not known of how people move in the frame that they are followed in.

    :ivar speed: spread of a velocity of which nothing is known, metres a second.
    :ivar acceleration: by how much velocities change: the square root of the intensity of a white
        acceleration, m/s^2 by the root of a second.
    :ivar turn_rate: spread of the frame's own turning about the camera, radians a second.
    :ivar turn_acceleration: by how much that changes, rad/s^2 by the root of a second.
    """

    speed: float
    acceleration: float
    turn_rate: float = 0.0
    turn_acceleration: float = 0.0

    def velocities(self, away: _Array) -> _Array:
        """Return covariances (n, 3, 3) of the velocities of people at (n, 3) from the camera."""
        return _covariances(away, self.speed, self.turn_rate)

    def accelerations(self, away: _Array) -> _Array:
        """Return the intensities (n, 3, 3) of their accelerations."""
        return _covariances(away, self.acceleration, self.turn_acceleration)


@dataclass(frozen=True, eq=False)
class States:
    """
    What is known of n people.

    A state is position and velocity (3 each, of one frame), the person's body error and the
    view's error, both in spreads of scale.ErrorShares.

    :ivar mean: (n, 8).
    :ivar covariance: (n, 8, 8).
    """

    mean: _Array
    covariance: _Array

    def take(self, rows: NDArray[np.intp] | NDArray[np.bool_]) -> States:
        """Return the states of these rows."""
        return States(self.mean[rows], self.covariance[rows])

    def put(self, rows: NDArray[np.intp], other: States) -> States:
        """Return the states with these rows replaced."""
        mean, covariance = self.mean.copy(), self.covariance.copy()
        mean[rows], covariance[rows] = other.mean, other.covariance
        return States(mean, covariance)

    def joined(self, other: States) -> States:
        """Return these people and then the others."""
        return States(np.concatenate([self.mean, other.mean]),
                      np.concatenate([self.covariance, other.covariance]))

    def moved(self, rotation: _Array, translation: _Array) -> States:
        """Return the states in another frame: rotation (3, 3) times places, plus translation."""
        turn = np.eye(N_STATES)
        turn[POSITION, POSITION] = turn[VELOCITY, VELOCITY] = rotation
        mean = self.mean @ turn.T
        mean[:, POSITION] += translation
        return States(mean, turn @ self.covariance @ turn.T)

    def doubted(self, velocities: _Array) -> States:
        """Return the states with covariances (n, 3, 3) added to those of the velocities."""
        covariance = self.covariance.copy()
        covariance[:, VELOCITY, VELOCITY] += velocities
        return States(self.mean, covariance)

    def predicted(self, elapsed_s: float, motion: Motion, origin: _Array) -> States:
        """
        Return the states so much later: constant velocity, changed by white accelerations.

        :param origin: (3,) where the camera is.
        """
        memory = np.exp(-elapsed_s / VIEW_TIME_S)
        step = np.eye(N_STATES)
        step[POSITION, VELOCITY] = elapsed_s * np.eye(3)
        step[VIEW, VIEW] = memory
        covariance = step @ self.covariance @ step.T
        intensity = motion.accelerations(self.mean[:, POSITION] - origin)
        covariance[:, POSITION, POSITION] += elapsed_s ** 3 / 3 * intensity
        covariance[:, POSITION, VELOCITY] += elapsed_s ** 2 / 2 * intensity
        covariance[:, VELOCITY, POSITION] += elapsed_s ** 2 / 2 * intensity
        covariance[:, VELOCITY, VELOCITY] += elapsed_s * intensity
        covariance[:, VIEW, VIEW] += 1 - memory ** 2
        return States(self.mean @ step.T, covariance)

    def updated(self, measured: _Array, shares: ErrorShares, origin: _Array) -> Update:
        """
        Return what measurements make of the states, and how far off they are.

        The measured logarithm of range and the two directions across the ray are each linear
        in the state where it is; the covariance is Joseph's form, symmetric and positive.

        :param measured: (n, 3) positions in the states' frame.
        :param shares: what their errors are made up of.
        :param origin: (3,) where the camera is.
        """
        away, seen = self.mean[:, POSITION] - origin, measured - origin
        near = np.maximum(length(away), _NEAREST)
        axes = _axes(unit_or_zero(away))
        innovation = (axes @ unit_or_zero(seen)[..., None])[..., 0]
        innovation[:, 0] = (np.log(length(seen) / near)
                            - shares.body * self.mean[:, BODY] - shares.view * self.mean[:, VIEW])
        slope = np.zeros((len(near), 3, N_STATES))
        slope[:, :, POSITION] = axes / near[:, None, None]
        slope[:, 0, BODY], slope[:, 0, VIEW] = shares.body, shares.view
        noise = np.zeros((len(near), 3, 3))
        noise[:, 0, 0] = shares.noise ** 2
        noise[:, 1, 1] = noise[:, 2, 2] = (shares.across / near) ** 2
        projected = slope @ self.covariance
        spread = projected @ slope.transpose(0, 2, 1) + noise
        solved = np.linalg.solve(
            spread, np.concatenate([projected, innovation[..., None]], axis=2))
        gain = solved[..., :N_STATES].transpose(0, 2, 1)
        off = (innovation * solved[..., N_STATES]).sum(axis=1)
        np.maximum(innovation[:, 0], -_STEP_NEARER, out=innovation[:, 0])
        rest = np.eye(N_STATES) - gain @ slope
        covariance = (rest @ self.covariance @ rest.transpose(0, 2, 1)
                      + gain @ noise @ gain.transpose(0, 2, 1))
        return Update(
            States(self.mean + (gain @ innovation[..., None])[..., 0], covariance),
            np.where((away * seen).sum(axis=1) > 0, off, np.inf))


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
    ray = unit_or_zero(away)
    mean = np.zeros((n, N_STATES))
    mean[:, POSITION] = measured
    errors = np.stack([shares.body, shares.view], axis=-1)
    along = ray[:, :, None] * ray[:, None]
    covariance = np.zeros((n, N_STATES, N_STATES))
    covariance[:, POSITION, POSITION] = (
        (shares.variance * length(away) ** 2)[:, None, None] * along
        + (shares.across ** 2)[:, None, None] * (np.eye(3) - along))
    covariance[:, POSITION, BODY:] = -away[:, :, None] * errors[:, None]
    covariance[:, BODY:, POSITION] = covariance[:, POSITION, BODY:].transpose(0, 2, 1)
    covariance[:, VELOCITY, VELOCITY] = motion.velocities(away)
    covariance[:, BODY, BODY] = covariance[:, VIEW, VIEW] = 1.0
    return States(mean, covariance)


def _covariances(away: _Array, each_way: float, turning: float) -> _Array:
    """Return (n, 3, 3) of spreads each_way, and across the ray turning by metres as well."""
    ray = unit_or_zero(away)
    wider = (turning * length(away)) ** 2
    across = np.eye(3) - ray[:, :, None] * ray[:, None]
    return each_way ** 2 * np.eye(3) + wider[:, None, None] * across


def _axes(ray: _Array) -> _Array:
    """Return (n, 3, 3) rows: unit vectors (n, 3), and two across them (Householder)."""
    sign = np.where(ray[:, :1] < 0, -1.0, 1.0)
    mirror = ray * sign
    mirror[:, 0] += 1.0
    half = (mirror ** 2).sum(axis=1)[:, None, None] / 2
    axes = np.eye(3) - mirror[:, :, None] * mirror[:, None] / half
    axes[:, 0] = ray
    return axes
