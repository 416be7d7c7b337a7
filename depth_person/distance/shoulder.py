"""The source paper's method: distance from the two shoulders and the neck."""
from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from depth_person.camera.intrinsics import Intrinsics
from depth_person.distance.estimator import Body, Cue, Distances, Mounting, Reason
from depth_person.distance.noise import keypoint_sigma
from depth_person.distance.triangulation import shoulder_depth
from depth_person.pose.people import People
from depth_person.pose.skeleton import Keypoint

#: The paper's distance between the shoulders, metres.
SHOULDER_WIDTH = 0.35
#: Farther than this, metres, shoulders are a pixel or two apart in any camera.
MAX_RANGE = 100.0

_ROWS = [Keypoint.L_SHOULDER, Keypoint.R_SHOULDER, Keypoint.NECK]
# Step of the divided differences in sigmas: the best for normal noise (Norgaard et al., New
# developments in state estimation for nonlinear systems, Automatica 36, 2000).
_STEP = np.sqrt(3.0)


def _steps() -> NDArray[np.float64]:
    """Return the (13, 3, 2) steps: none, then each coordinate of each keypoint up and down."""
    each = _STEP * np.eye(6).reshape(6, 3, 2)
    return np.concatenate([np.zeros((1, 3, 2)), each, -each])


_STEPS = _steps()


class ShoulderEstimator:
    """
    Distance by Algorithm 1 of the source paper, unchanged.

    The neck is the network's own where it marks one. Otherwise it is the midpoint of the two
    shoulders' images, and the depth is plainly f l / |LR|: a person who turns by a yaw reads
    1 / cos(yaw) too far, and off the axis one who faces the camera, not the image plane,
    at a bearing has a depth short by cos(bearing), 13 % at 30 degrees. The position is the point
    of the neck's view ray at that depth.

    Sigma is keypoint noise carried through the formula by second-order divided differences, and
    the spread of shoulder widths. It says nothing of turning, which the midpoint cannot see.
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
        sigma = keypoint_sigma(people.keypoints)[:, _ROWS]
        measured = np.isfinite(sigma[:, 2]) & people.neck_measured
        with np.errstate(all='ignore'):
            depth, neck = self._depth(
                intrinsics.undistort(pixels + _STEPS[:, None] * sigma[:, :, None]), measured)
            log_range = np.log(depth * np.sqrt((neck ** 2).sum(axis=-1) + 1))
            position = depth[0][:, None] * np.insert(neck[0], 2, 1.0, axis=-1)
            spread = np.hypot(_spread(log_range), self._width_sigma)
            gap = np.hypot(*(pixels[:, 0] - pixels[:, 1]).T)
            coincident = gap < 2 * np.hypot(sigma[:, 0], sigma[:, 1])
        reason = np.select(
            [~np.isfinite(sigma[:, :2]).all(axis=1), coincident, ~np.isfinite(depth[0]),
             ~(log_range[0] < np.log(MAX_RANGE)), ~np.isfinite(spread)],
            [Reason.NO_SHOULDERS, Reason.COINCIDENT_SHOULDERS, Reason.IMPLAUSIBLE_SKELETON,
             Reason.OUT_OF_RANGE, Reason.IMPLAUSIBLE_SKELETON],
            Reason.NONE).astype(np.uint8)
        return Distances.of(
            position=position, range_sigma=np.exp(log_range[0]) * spread, reason=reason,
            cues=np.where(measured, Cue.SHOULDERS | Cue.NECK, Cue.SHOULDERS).astype(np.uint8))

    def _depth(
        self, rays: NDArray[np.float64], measured: NDArray[np.bool_],
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return depth (..., n) and the neck's ray (..., n, 2) for rays (..., n, 3, 2)."""
        left, right, neck = np.moveaxis(rays, -2, 0)
        neck = np.where(measured[:, None], neck, (left + right) / 2)
        depth = shoulder_depth(
            left, right, neck, focal_length=1.0, shoulder_width=self._width)
        return depth, neck


def _spread(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the standard deviation (n,) that unit noise gives values (13, n) at the steps."""
    middle, up, down = values[0], values[1:7], values[7:]
    slope = (up - down) / (2 * _STEP)
    bend = (up + down - 2 * middle) * np.sqrt(_STEP ** 2 - 1) / (2 * _STEP ** 2)
    return np.sqrt((slope ** 2 + bend ** 2).sum(axis=0))
