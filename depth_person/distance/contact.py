"""When someone who comes nearer arrives."""
from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from depth_person.distance.states import POSITION, States, VELOCITY
from depth_person.distance.vectors import length

_Array = NDArray[np.float64]


def time_to_contact(
    states: States, origin: _Array, camera_velocity: _Array,
) -> tuple[_Array, _Array]:
    """
    Return the seconds until the range is zero at its present rate, and their spread.

    Range and rate err by the same factor, the person's size: the time is surer than either.

    :param origin: (3,) where the camera is, in the frame of the states.
    :param camera_velocity: (3,) how it moves there, metres a second.
    :returns: (n,) and (n,): infinite for who goes away, and NaN for who has never been seen to
        move; the spread of both is NaN.
    """
    away = states.mean[:, POSITION] - origin
    velocity = states.mean[:, VELOCITY] - camera_velocity
    distance = length(away)[:, None]
    with np.errstate(divide='ignore', invalid='ignore'):
        ray = away / distance
        rate = (ray * velocity).sum(axis=1, keepdims=True)
        time = np.where(rate < 0, -distance / rate, np.where(rate > 0, np.inf, np.nan))
        slope = np.concatenate([
            -ray / rate + (velocity - rate * ray) / rate ** 2, distance / rate ** 2 * ray], axis=1)
        covariance = states.covariance[:, :VELOCITY.stop, :VELOCITY.stop]
        variance = (slope[:, None] @ covariance @ slope[..., None])[:, 0, 0]
    time = time[:, 0]
    return time, np.where(np.isfinite(time), np.sqrt(variance), np.nan)
