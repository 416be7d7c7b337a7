"""
People as a ring of distances, the form in which PX4 and ArduPilot take obstacles.

Bin i looks along 5 i degrees clockwise from ahead, seen from above, and reaches 2.5 degrees to
both sides, as in sensor_msgs/LaserScan and in MAVLink's OBSTACLE_DISTANCE.
"""
from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from depth_person.autopilot.vehicle import LevelView
from depth_person.camera.intrinsics import Intrinsics
from depth_person.distance.tracked import TrackedPeople
from depth_person.distance.vectors import rays_through
from depth_person.errors import DepthPersonError

_Array = NDArray[np.float64]

BINS = 72
#: Width of a bin, radians.
STEP = 2 * np.pi / BINS
#: A clear bin exceeds range_max by this. One centimetre would be cut back into range, since
#: receivers make whole centimetres of metres by dropping what is behind the point.
CLEAR_BEYOND = 0.02
#: Beyond this, metres, centimetres no longer fit 16 bits together with "clear" and "unknown".
FARTHEST = 655.0
#: How far a body reaches beside its outermost keypoints (joints, not skin), metres.
_BESIDE = 0.15
#: How far a body reaches to both sides of its neck at least, metres; keypoints may be missing.
_HALF_BREADTH = 0.30
#: A direction and its image, undistorted again, agree this well on the plane z = 1.
_SAME_RAY = 1e-6


@dataclass(frozen=True)
class ScanOptions:
    """
    What a scan may be told.

    :ivar sigmas: how many standard deviations nearer than measured a person is taken to be.
    :ivar range_min: the smallest distance that is reported, metres; who is nearer is there.
    :ivar range_max: who is further away is left out, metres.
    :ivar clear: whether bins in view without a person are said to be free up to range_max.
    :raises DepthPersonError: when values do not go together.
    """

    sigmas: float = 2.0
    range_min: float = 0.2
    range_max: float = 30.0
    clear: bool = False

    def __post_init__(self) -> None:
        if not self.sigmas >= 0:
            raise DepthPersonError(f'{self.sigmas:g} sigmas would put people further away')
        if not 0 < self.range_min < self.range_max <= FARTHEST:
            raise DepthPersonError(
                f'a scan from {self.range_min:g} to {self.range_max:g} m is not within 0 to '
                f'{FARTHEST:g} m')


def scan(
    tracked: TrackedPeople, intrinsics: Intrinsics, view: LevelView, options: ScanOptions,
) -> NDArray[np.float32]:
    """
    Return the horizontal distance to the nearest person in each bin.

    A person fills all bins that the body reaches into, at the near bound of the distance. At
    least two: the map of some versions of PX4 reads only every second bin.

    :returns: (72,) metres; NaN where nothing is known, range_max + 0.02 where the view is clear.
    """
    ranges = np.full(BINS, np.nan, np.float32)
    distances = tracked.distances
    known = distances.known & np.isfinite(distances.range_sigma) & (distances.range > 0)
    rays = rays_through(intrinsics.undistort(tracked.people.keypoints[..., :2]))
    if options.clear:
        ranges[_in_view(intrinsics, view)] = options.range_max + CLEAR_BEYOND
        ranges[_seen_without_range(rays[~known], view)] = np.nan
    if not known.any():
        return ranges
    position, distance = distances.position[known], distances.range[known]
    near = np.maximum(distance - options.sigmas * distances.range_sigma[known], 0.0)
    near_point = view.to_level(position * (near / distance)[:, None])
    told = centimetres(
        np.maximum(np.hypot(near_point[:, 0], near_point[:, 1]), options.range_min))
    first, last = _bins(*_extent(
        view.to_level(position), view.to_level(rays[known] * distance[:, None, None])))
    for row in np.flatnonzero(told <= sent(options.range_max)):
        filled = _filled(first[row], last[row])
        ranges[filled] = np.fmin(ranges[filled], told[row])
    return ranges


def centimetres(metres: ArrayLike) -> NDArray[np.float32]:
    """Return distances cut to whole centimetres that stay the same when cut once more."""
    whole = np.floor(np.asarray(metres, np.float64) * 100 + 1e-6)
    result = (whole / 100).astype(np.float32)
    short = result.astype(np.float64) * 100 < whole
    return np.where(short, np.nextafter(result, np.float32(np.inf)), result)


@lru_cache(maxsize=16)
def sent(metres: float) -> float:
    """Return a single distance as centimetres() does."""
    return float(centimetres(metres))


def _extent(neck: _Array, joints: _Array) -> tuple[_Array, _Array]:
    """
    Return between which bearings (n,) bodies are, radians, not wrapped.

    :param neck: (n, 3) in the level frame, metres.
    :param joints: (n, 18, 3), NaN where unknown.
    """
    bearing = np.arctan2(neck[:, 1], neck[:, 0])
    distance = np.hypot(neck[:, 0], neck[:, 1])
    aside = _wrapped(np.arctan2(joints[..., 1], joints[..., 0]) - bearing[:, None])
    half, beside = _angle(_HALF_BREADTH, distance), _angle(_BESIDE, distance)
    low = np.fmin(np.fmin.reduce(aside, axis=1) - beside, -half)
    high = np.fmax(np.fmax.reduce(aside, axis=1) + beside, half)
    return bearing + low, bearing + high


def _angle(reach: float, distance: _Array) -> _Array:
    """Return the angle (n,) that a reach beside the view takes; all round when it is inside."""
    inside = distance <= reach
    return np.where(inside, np.pi, np.arcsin(reach / np.where(inside, reach, distance)))


def _bins(low: _Array, high: _Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the first and the last bin (n,) that intervals of bearings reach into."""
    first = np.floor(low / STEP + 0.5).astype(np.int64)
    last = np.maximum(np.ceil(high / STEP - 0.5).astype(np.int64), first)
    single = first == last
    right = (low + high) / 2 >= first * STEP
    first, last = first - (single & ~right), last + (single & right)
    return first, np.minimum(last, first + BINS - 1)


def _filled(first: np.int64, last: np.int64) -> NDArray[np.int64]:
    """Return the bins from the first to the last."""
    return np.arange(int(first), int(last) + 1) % BINS


def _in_view(intrinsics: Intrinsics, view: LevelView) -> NDArray[np.bool_]:
    """Return which bins (72,) are in the image from edge to edge, at the vehicle's own level."""
    bearings = (np.arange(2 * BINS + 1) - 1) * STEP / 2
    level = np.stack([np.cos(bearings), np.sin(bearings), np.zeros(len(bearings))], axis=-1)
    optical = view.to_optical(level)
    pixels = intrinsics.project(optical)
    with np.errstate(all='ignore'):
        # Behind the fold of a lens, directions come out at pixels that are not theirs.
        back = intrinsics.undistort(pixels) - optical[:, :2] / optical[:, 2:]
        inside = (pixels >= 0) & (pixels <= (intrinsics.width - 1, intrinsics.height - 1))
        seen = np.all(inside & (np.abs(back) < _SAME_RAY), axis=1)
    return seen[0:-2:2] & seen[1:-1:2] & seen[2::2]


def _seen_without_range(rays: _Array, view: LevelView) -> NDArray[np.bool_]:
    """Return the bins (72,) in which people are whose distance is not known."""
    directions = rays @ view.rotation.T
    directions = directions[np.isfinite(directions).all(axis=2).any(axis=1)]
    bearing = np.arctan2(directions[..., 1], directions[..., 0])
    middle = np.arctan2(*np.nansum(directions, axis=1).T[1::-1])
    aside = _wrapped(bearing - middle[:, None])
    first, last = _bins(
        middle + np.fmin.reduce(aside, axis=1) - STEP,
        middle + np.fmax.reduce(aside, axis=1) + STEP)
    result = np.zeros(BINS, np.bool_)
    for row in range(len(bearing)):
        result[_filled(first[row], last[row])] = True
    return result


def _wrapped(angle: _Array) -> _Array:
    """Return angles as those between minus and plus half a turn."""
    return (angle + np.pi) % (2 * np.pi) - np.pi
