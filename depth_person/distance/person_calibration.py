"""The other way round: from a person at a known distance to the camera, or to the body."""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
import math

import numpy as np
from numpy.typing import NDArray

from depth_person.camera.intrinsics import Intrinsics
from depth_person.distance.estimator import Body, DistanceEstimator
from depth_person.distance.skeleton import SkeletonEstimator
from depth_person.distance.vectors import length, rays_through
from depth_person.errors import DepthPersonError
from depth_person.pose.people import People
from depth_person.pose.skeleton import Keypoint

_Array = NDArray[np.float64]

#: Horizontal fields of view that are looked through for the camera's, degrees.
FIELDS_OF_VIEW = (12.0, 150.0)
#: Statures that are looked through for the person's, metres.
STATURES = (1.0, 2.2)
#: Fewer frames with a range say nothing.
FEWEST_FRAMES = 5
#: Distances whose answers differ by more sigmas contradict each other.
CONTRADICTION = 3.0
#: Widths that spread more than this (relative) are of somebody who turns.
LARGEST_TURNING = 0.12

_STEPS = 41
_SHOULDERS = [Keypoint.R_SHOULDER, Keypoint.L_SHOULDER]
#: From median absolute deviation to standard deviation.
_NORMAL = 1.4826
#: What a network's keypoints are off by that is the same in every frame, relative to the width.
_MARKING_SIGMA = 0.02


@dataclass(frozen=True, eq=False)
class Stand:
    """
    Frames of one person who stands at a known distance.

    :ivar people: one row a frame.
    :ivar range: from the lens to the base of the neck, metres.
    :ivar range_sigma: its standard deviation, metres.
    """

    people: People
    range: float
    range_sigma: float

    def __post_init__(self) -> None:
        if not (0.3 <= self.range <= 100 and 0 <= self.range_sigma < self.range / 2):
            raise DepthPersonError(
                f'a distance of {self.range:g} +- {self.range_sigma:g} m is of no use; '
                'measure one between 0.3 and 100 m')


@dataclass(frozen=True)
class Measured:
    """
    A quantity with one standard deviation.

    :ivar frames: how many told something.
    """

    value: float
    sigma: float
    frames: int


def focal_length(
    stands: list[Stand], *, width: int, height: int, estimator: DistanceEstimator,
) -> Measured:
    """
    Return the focal length, in pixels, at which the person stands where they do.

    For each frame, the range that the estimator gives is followed over the focal lengths to where
    it is the known one. With the estimator `shoulder` this is the source paper's formula read
    backwards, f = depth * |LR| / width. The body's error is the same at every distance, so that
    more of them do not make sigma smaller than what the body leaves.

    :param width: of the image, pixels; the principal point is taken as its middle.
    :param estimator: which knows the person's shoulder width or stature.
    :raises DepthPersonError: when too few frames tell, or the distances contradict each other.
    """
    fields = np.radians(np.geomspace(*FIELDS_OF_VIEW, _STEPS))
    focal_lengths = np.sort(width / 2 / np.tan(fields / 2))

    def ranges(people: People, value: float) -> tuple[_Array, _Array]:
        camera = Intrinsics(
            width, height, value, value, (width - 1) / 2, (height - 1) / 2)
        distances = estimator.estimate(people, camera)
        return distances.range, distances.range_sigma

    return _combined(stands, focal_lengths, ranges, 'focal length')


def stature(stands: list[Stand], intrinsics: Intrinsics) -> Measured:
    """
    Return the stature, in metres, with which the person stands where they do.

    :raises DepthPersonError: when too few frames tell, or the distances contradict each other.
    """
    def ranges(people: People, value: float) -> tuple[_Array, _Array]:
        distances = SkeletonEstimator(Body(stature=value)).estimate(people, intrinsics)
        return distances.range, distances.range_sigma

    return _combined(stands, np.geomspace(*STATURES, _STEPS), ranges, 'stature')


def shoulder_width(stands: list[Stand], intrinsics: Intrinsics) -> Measured:
    """
    Return the distance between the shoulder keypoints of someone who faces the camera, metres.

    It is the length whose ends are at the known range and appear as far apart as the shoulders.

    :raises DepthPersonError: when too few frames show both shoulders, or the person turns.
    """
    parts = []
    for stand in stands:
        rays = rays_through(intrinsics.undistort(stand.people.keypoints[:, _SHOULDERS, :2]))
        widths = stand.range * length(rays[:, 0] - rays[:, 1])
        parts.append(widths[np.isfinite(widths)])
    widths = np.concatenate(parts)
    _check_enough(len(widths))
    value = float(np.median(widths))
    spread = _spread(widths)
    if spread > LARGEST_TURNING * value:
        raise DepthPersonError(
            f'the shoulders appear {value:.2f} m apart, give or take {spread:.2f} m: stand still, '
            'facing the camera, and measure again')
    tape = max(stand.range_sigma / stand.range for stand in stands)
    sigma = math.hypot(value * tape, value * _MARKING_SIGMA, spread / math.sqrt(len(widths)))
    return Measured(value, sigma, len(widths))


def _combined(
    stands: list[Stand], candidates: _Array,
    ranges: Callable[[People, float], tuple[_Array, _Array]], name: str,
) -> Measured:
    """Return the candidate that fits all stands, from what each of them tells."""
    if not stands:
        raise DepthPersonError('no distances are given; give at least one')
    told = [_solved(stand, candidates, ranges) for stand in stands]
    values, own, body = np.array([each[:3] for each in told]).T
    frames = sum(each[3] for each in told)
    weight = 1 / own ** 2
    value = float((weight * values).sum() / weight.sum())
    off = np.abs(values - value) / own
    if off.max() > CONTRADICTION:
        lines = ', '.join(
            f'{math.exp(each):.4g} at {stand.range:g} m'
            for each, stand in zip(values, stands, strict=True))
        raise DepthPersonError(
            f'the distances contradict each other: the {name} would be {lines}; measure them '
            'again, from the lens to the base of the neck')
    sigma = math.hypot(float(weight.sum()) ** -0.5, float(body.mean()))
    return Measured(math.exp(value), math.exp(value) * sigma, frames)


def _solved(
    stand: Stand, candidates: _Array, ranges: Callable[[People, float], tuple[_Array, _Array]],
) -> tuple[float, float, float, int]:
    """
    Return what one stand tells of the logarithm of the candidate.

    :returns: its median over the frames, the spread of that, the spread that the body leaves, and
        the number of frames.
    """
    told = [ranges(stand.people, float(value)) for value in candidates]
    log_range = np.log([each[0] for each in told])
    log_sigma = np.array([each[1] / each[0] for each in told])
    values, sigmas = [], []
    for row in range(log_range.shape[1]):
        usable = np.isfinite(log_range[:, row]) & np.isfinite(log_sigma[:, row])
        above, at = log_range[usable, row], np.log(candidates[usable])
        rises = np.diff(above, prepend=-np.inf) > 0
        if not rises[1:].any() or not above[rises][0] <= math.log(stand.range) <= above[rises][-1]:
            continue
        value = float(np.interp(math.log(stand.range), above[rises], at[rises]))
        values.append(value)
        sigma = np.interp(value, at, log_sigma[usable, row])
        sigmas.append(float(sigma / np.interp(value, at[rises], np.gradient(above, at)[rises])))
    _check_enough(len(values))
    across = np.array(values)
    own = math.hypot(
        stand.range_sigma / stand.range, _spread(across) / math.sqrt(len(across)), 1e-3)
    return float(np.median(across)), own, float(np.median(sigmas)), len(values)


def _spread(values: _Array) -> float:
    """Return the standard deviation, from the median absolute deviation."""
    return _NORMAL * float(np.median(np.abs(values - np.median(values))))


def _check_enough(frames: int) -> None:
    if frames < FEWEST_FRAMES:
        raise DepthPersonError(
            f'{frames} frames tell something, {FEWEST_FRAMES} are needed; have the whole person '
            'in the picture, well lit, for a second or more')


def largest_person(people: People) -> People:
    """Return the one person of a frame whose keypoints reach farthest; nobody if there is none."""
    if not len(people):
        return people
    points = people.keypoints[..., :2]
    extent = np.fmax.reduce(points, axis=1) - np.fmin.reduce(points, axis=1)
    row = int(np.nan_to_num(extent.max(axis=1), nan=-1.0).argmax())
    return replace(
        people, keypoints=people.keypoints[row:row + 1], track_ids=people.track_ids[row:row + 1])
