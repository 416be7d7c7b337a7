"""The one person that matters: the nearest, or the one to follow."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depth_person.autopilot.vehicle import CameraOnBody
from depth_person.camera.intrinsics import Intrinsics
from depth_person.distance.tracked import TrackedPeople
from depth_person.distance.vectors import cross, length
from depth_person.errors import DepthPersonError

_Array = NDArray[np.float64]

NEAREST, CENTER = 'nearest', 'center'
#: One standard deviation of the direction to a person, radians: where the neck is marked.
_DIRECTION_SIGMA = 0.01
#: The same in metres, as the neck is not the person; it decides up close.
_PLACE_SIGMA = 0.05


@dataclass(frozen=True, eq=False)
class Target:
    """
    A person in the vehicle's frame (base_link: x forward, y left, z up).

    :ivar position: (3,) of the neck, metres.
    :ivar covariance: (3, 3) of the position, square metres: long along the view ray.
    """

    track_id: int
    position: _Array
    covariance: _Array


def checked_choice(choice: str) -> str:
    """
    Return a choice of target: nearest, center, a track id as a number, or nothing for nobody.

    :raises DepthPersonError: when it is none of them.
    """
    if choice in ('', NEAREST, CENTER) or (choice.isascii() and choice.isdigit()):
        return choice
    raise DepthPersonError(
        f'target {choice!r} is not {NEAREST}, {CENTER}, a track id, or empty for none')


def nearest_person(tracked: TrackedPeople) -> int | None:
    """Return the row of who is nearest; None when nobody has a range."""
    return _best(tracked, tracked.distances.range)


def chosen_person(tracked: TrackedPeople, choice: str, intrinsics: Intrinsics) -> int | None:
    """
    Return the row of the chosen person; None when there is none with a range.

    :param choice: as checked_choice takes it. CENTER is the one whose neck is seen nearest to the
        middle of the image.
    """
    if not choice:
        return None
    if choice == NEAREST:
        return nearest_person(tracked)
    if choice == CENTER:
        return _best(tracked, _off_center(tracked.distances.position, intrinsics))
    return _best(tracked, np.where(tracked.people.track_ids == int(choice), 0.0, np.nan))


def target_of(tracked: TrackedPeople, row: int, camera: CameraOnBody) -> Target:
    """Return a person with a range in the vehicle's frame."""
    distances = tracked.distances
    position, distance = distances.position[row], distances.range[row]
    ray = camera.rotation @ (position / distance)
    along = ray[:, None] * ray
    across = (distance * _DIRECTION_SIGMA) ** 2 + _PLACE_SIGMA ** 2
    return Target(
        int(tracked.people.track_ids[row]), camera.to_body(position),
        distances.range_sigma[row] ** 2 * along + across * (np.eye(3) - along))


def _off_center(position: _Array, intrinsics: Intrinsics) -> _Array:
    """Return the tangent (n,) of the angle between positions and the middle of the image."""
    middle = ((intrinsics.width - 1) / 2, (intrinsics.height - 1) / 2)
    x, y = intrinsics.undistort(middle)
    ray = np.array([x, y, 1.0])
    with np.errstate(invalid='ignore'):
        off = length(cross(position, ray))
    return np.arctan2(off, position @ ray)


def _best(tracked: TrackedPeople, cost: _Array) -> int | None:
    """Return the row of the least cost among those with a range and a cost."""
    distances = tracked.distances
    fit = distances.known & np.isfinite(distances.range_sigma) & np.isfinite(cost)
    if not fit.any():
        return None
    return int(np.where(fit, cost, np.inf).argmin())
