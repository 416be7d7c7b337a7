"""The source paper's method: distance from the two shoulders and the neck."""
from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from depth_person.camera.intrinsics import Intrinsics
from depth_person.distance.conventions import convention_of
from depth_person.distance.estimator import Body, Cue, Distances, Mounting, Reason
from depth_person.distance.triangulation import shoulder_depth
from depth_person.pose.people import People
from depth_person.pose.skeleton import Keypoint

#: The paper's distance between the shoulders, metres.
SHOULDER_WIDTH = 0.35
#: Farther than this, metres, shoulders are a pixel or two apart in any camera.
MAX_RANGE = 100.0
#: Shoulders nearer than so many sigmas of their distance may as well coincide.
LEAST_GAP = 2.0

# From one end of a body's keypoints to the other, metres; only for how noisy keypoints are.
_LONGEST_EXTENT = 1.7
_ROWS = [Keypoint.L_SHOULDER, Keypoint.R_SHOULDER, Keypoint.NECK]
# Step of the divided differences in sigmas: the best for normal noise (Norgaard et al., New
# developments in state estimation for nonlinear systems, Automatica 36, 2000).
_STEP = np.sqrt(3.0)
# A keypoint's places: its own, and a step to each side in u and v.
_STEPS = _STEP * np.array([(0, 0), (1, 0), (0, 1), (-1, 0), (0, -1)])
# Which of these each keypoint takes in 13 cases: none steps, then each coordinate up, and down.
_CASES = np.concatenate([
    np.zeros((1, 3), int), np.kron(np.eye(3, dtype=int), [[1], [2]]),
    np.kron(np.eye(3, dtype=int), [[3], [4]])])


class ShoulderEstimator:
    """
    Distance by Algorithm 1 of the source paper, unchanged.

    The neck is the network's own where it marks one. Otherwise it is the midpoint of the two
    shoulders' images, and the depth is plainly f l / |LR|: a person who turns by a yaw reads
    1 / cos(yaw) too far, and off the axis one who faces the camera, not the image plane, reads
    short by cos(bearing), 13 % at 30 degrees. The position is the point of the neck's view ray at
    that depth.

    Sigma is keypoint noise carried through the formula by second-order divided differences, and
    the spread of shoulder widths. It says nothing of turning, which the midpoint cannot see.

    :param body: whose shoulder width and its spread are used; the paper's 0.35 m if unknown.
    """

    name = 'shoulder'

    def __init__(self, body: Body = Body()) -> None:
        self._width = SHOULDER_WIDTH if body.shoulder_width is None else body.shoulder_width
        self._width_sigma = body.shoulder_width_sigma

    def estimate(
        self, people: People, intrinsics: Intrinsics, mounting: Mounting = Mounting(),
    ) -> Distances:
        """Return one distance a person; the camera's mounting makes no difference."""
        pixels = people.keypoints[:, _ROWS, :2].astype(np.float64)
        with np.errstate(all='ignore'):
            gap = _length(pixels[:, 0] - pixels[:, 1])
            sigma = self._noise(people, gap)
            measured = np.isfinite(sigma[:, 2]) & people.neck_measured
            places = intrinsics.undistort(
                pixels + _STEPS[:, None, None] * sigma[..., None])
            depth, neck = self._depth(places, measured)
            log_range = np.log(depth * np.sqrt((neck ** 2).sum(axis=-1) + 1))
            spread = np.hypot(_spread(log_range), self._width_sigma)
            position = depth[0, :, None] * np.column_stack([neck[0], np.ones(len(people))])
            coincident = gap < LEAST_GAP * np.hypot(sigma[:, 0], sigma[:, 1])
            reason = np.select(
                [~np.isfinite(sigma[:, :2]).all(axis=1), coincident, np.isnan(spread),
                 ~(log_range[0] < np.log(MAX_RANGE))],
                [Reason.NO_SHOULDERS, Reason.COINCIDENT_SHOULDERS, Reason.IMPLAUSIBLE_SKELETON,
                 Reason.OUT_OF_RANGE], Reason.NONE)
            range_sigma = np.exp(log_range[0]) * spread
        cues = np.where(measured, Cue.SHOULDERS | Cue.NECK, Cue.SHOULDERS)
        return Distances.of(
            position=position, range_sigma=range_sigma,
            reason=reason.astype(np.uint8), cues=cues.astype(np.uint8))

    def _noise(self, people: People, gap: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the spreads (n, 3) of shoulders and neck, pixels; NaN where one is missing."""
        keypoints = people.keypoints.astype(np.float64)
        finite = np.isfinite(keypoints)
        pixels = np.where(finite.all(axis=-1, keepdims=True), keypoints[..., :2], np.nan)
        extent = _length(np.fmax.reduce(pixels, axis=1) - np.fmin.reduce(pixels, axis=1))
        px_per_m = np.fmax(gap / self._width, extent / _LONGEST_EXTENT)
        sigma = convention_of(people.convention).noise_px(keypoints[..., 2], px_per_m=px_per_m)
        return np.where(finite.all(axis=-1), sigma, np.nan)[:, _ROWS]

    def _depth(
        self, places: NDArray[np.float64], measured: NDArray[np.bool_],
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return depth (13, n) and neck ray (13, n, 2) in each case, for places (5, n, 3, 2)."""
        left, right, neck = (places[_CASES[:, row], :, row] for row in range(3))
        neck = np.where(measured[:, None], neck, (left + right) / 2)
        depth = shoulder_depth(
            left, right, neck, focal_length=1.0, shoulder_width=self._width)
        return depth, neck


def _length(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.hypot(vectors[..., 0], vectors[..., 1])


def _spread(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the standard deviation (n,) that unit noise gives values (13, n) at the steps."""
    middle, up, down = values[0], values[1:7], values[7:]
    slope = (up - down) / (2 * _STEP)
    bend = (up + down - 2 * middle) * np.sqrt(_STEP ** 2 - 1) / (2 * _STEP ** 2)
    return np.sqrt((slope ** 2 + bend ** 2).sum(axis=0))
