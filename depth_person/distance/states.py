"""What the filter knows of people: means and covariances, row by row."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_Array = NDArray[np.float64]

#: Where position, velocity, body and view are in a state.
POSITION, VELOCITY, BODY, VIEW = slice(0, 3), slice(3, 6), 6, 7
N_STATES = 8
#: What changes nothing of a state.
IDENTITY = np.eye(N_STATES)


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
        turn = IDENTITY.copy()
        turn[POSITION, POSITION] = turn[VELOCITY, VELOCITY] = rotation
        mean = self.mean @ turn.T
        mean[:, POSITION] += translation
        return States(mean, turn @ self.covariance @ turn.T)

    def doubted(self, velocities: _Array) -> States:
        """Return the states with covariances (n, 3, 3) added to those of the velocities."""
        covariance = self.covariance.copy()
        covariance[:, VELOCITY, VELOCITY] += velocities
        return States(self.mean, covariance)
