"""The package's own method: range and its spread from all keypoints, by a learned lifter."""
from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from depth_person.camera.intrinsics import Intrinsics
from depth_person.distance.canonical import Canonical, canonicalise
from depth_person.distance.conventions import Convention, convention_of, CONVENTIONS, LOWEST_SCORE
from depth_person.distance.estimator import Body, Cue, Distances, Mounting, Reason, UPSIDE_DOWN
from depth_person.distance.ground import ground_range
from depth_person.distance.lifter import (
    default_lifter,
    FEWEST_KEYPOINTS,
    Knowledge,
    Lifted,
    Lifter,
    lifter_inputs,
)
from depth_person.distance.vectors import rays_through, unit
from depth_person.pose.people import People
from depth_person.pose.skeleton import Keypoint, N_KEYPOINTS

_Array = NDArray[np.float64]

#: Keypoints that leave a larger spread of the range's logarithm fix none.
LARGEST_SPREAD = 0.4
#: Ranges outside this are out of reach, metres.
RANGES = (0.3, 100.0)
#: A keypoint that alone makes more than this of the spread of so many keypoints or more (in
#: squares) is not on the same body; even an average body's ankles make less than a fifth.
LARGEST_SHARE = 0.6
SHARING_KEYPOINTS = 8
#: Body and ground that differ by more sigmas contradict each other: the ground is left out.
CONTRADICTION = 3.0
#: The ground is left out where it would have less than this share: its error says that the body
#: knows better.
LEAST_WORTH = 0.1

_LOG_RANGES = np.log(RANGES)
_SKELETON = int(Cue.SKELETON)
_SHOULDERS = np.array([Keypoint.R_SHOULDER, Keypoint.L_SHOULDER])
# Keypoints nearer than this, pixels, are one marked twice.
_SAME_PLACE = 1e-3
# Each two keypoints.
_LATER, _EARLIER = np.tril_indices(N_KEYPOINTS, k=-1)


class SkeletonEstimator:
    """
    Distance from all keypoints, any of which may be missing.

    The keypoints' view rays are brought to canonical coordinates (turned to the axis, rolled
    upright, scaled), from which a small network trained on bodies of our own making tells the
    logarithm of range, its spread, and the neck. Where the network marks keypoints otherwise than
    the training bodies (People.convention), the network is told. With gravity the view's
    slope is known; with the camera's height too, the feet give a second range, fused by variance
    unless the two contradict each other.

    :param body: what is known of the people in view.
    """

    name = 'skeleton'

    def __init__(self, body: Body = Body(), *, lifter: Lifter | None = None) -> None:
        self._body = body
        self._lifter = default_lifter() if lifter is None else lifter
        self._told = {convention: self._knowledge(convention).as_features()
                      for convention in CONVENTIONS.values()}

    def estimate(
        self, people: People, intrinsics: Intrinsics, mounting: Mounting = Mounting(),
    ) -> Distances:
        """Return one distance a person; never raises for what a keypoint holds."""
        if len(people) == 0:
            return Distances.none(0, Reason.NONE)
        known = _usable(people)
        plane = intrinsics.undistort(people.keypoints[..., :2])
        known &= np.isfinite(plane).all(axis=-1)
        rays = rays_through(plane)
        view = canonicalise(rays, known)
        convention = convention_of(people.convention)
        noise = convention.noise_rad(
            people.keypoints[..., 2].astype(np.float64),
            rad_per_px=_rad_per_px(intrinsics, view), guess=view.guess)
        gravity = mounting.down
        lifted = self._lifter.lift(lifter_inputs(
            view, noise_rad=noise, gravity=gravity, told=self._told[convention]))
        neck = _neck(rays, view, lifted)
        log_range = np.log(view.guess) + lifted.log_correction
        sigma = convention.sigma_scale * lifted.log_sigma
        cues = np.full(len(people), _SKELETON, np.uint8)
        if mounting.gravity is not None and mounting.height is not None:
            rays = np.where(view.known[..., None], rays, np.nan)
            log_range, sigma, cues = _fused(log_range, sigma, *ground_range(
                rays, noise, neck, mounting, placement=convention.placement))
        distance = np.exp(log_range)
        return Distances.of(
            position=distance[:, None] * neck, range_sigma=distance * sigma,
            reason=_reasons(view, lifted, log_range, gravity), cues=cues)

    def _knowledge(self, convention: Convention) -> Knowledge:
        """Return what is known of anybody whose keypoints are of this convention."""
        def told(value: float | None, sigma: float) -> tuple[_Array, _Array]:
            return np.array([np.nan if value is None else value]), np.array([sigma])

        body = self._body
        return Knowledge(
            convention.placement.as_array()[None],
            *told(body.stature, body.stature_sigma),
            *told(body.shoulder_width, body.shoulder_width_sigma), np.array([body.children]))


def _usable(people: People) -> NDArray[np.bool_]:
    """Return (n, 18) which keypoints are sure enough, and in a place of their own."""
    keypoints = people.keypoints.astype(np.float64)
    with np.errstate(invalid='ignore', over='ignore'):
        score = keypoints[..., 2]
        known = (score >= LOWEST_SCORE) & (score < np.inf)
        if not people.neck_measured:
            known[:, Keypoint.NECK] = False
        pixels = np.where(known, keypoints[..., :2].transpose(2, 0, 1), np.nan)
        u, v = pixels.take(_LATER, axis=2) - pixels.take(_EARLIER, axis=2)
        rows, pairs = np.nonzero(u * u + v * v < _SAME_PLACE ** 2)
    known[rows, _LATER[pairs]] = False
    return known


def _rad_per_px(intrinsics: Intrinsics, view: Canonical) -> _Array:
    """Return (n,) how many radians a pixel takes where the person stands; less off the axis."""
    cosine = view.rotation[:, 2, 2]
    return np.abs(cosine) ** 1.5 / np.sqrt(intrinsics.fx * intrinsics.fy)


def _neck(rays: _Array, view: Canonical, lifted: Lifted) -> _Array:
    """Return unit view rays (n, 3) of the necks: marked, midway of the shoulders, or lifted."""
    neck = rays.take(_SHOULDERS, axis=1).sum(axis=1)
    with np.errstate(all='ignore'):
        both: NDArray[np.bool_] = np.all(view.known.take(_SHOULDERS, axis=1), axis=1)
        if not both.all():
            point = lifted.neck / view.guess[:, None] + view.centroid
            lifted_neck = (rays_through(point)[:, None] @ view.rotation)[:, 0]
            neck = np.where(both[:, None], neck, lifted_neck)
        marked = view.known[:, Keypoint.NECK]
        if marked.any():
            neck = np.where(marked[:, None], rays[:, Keypoint.NECK], neck)
        return unit(neck)


def _fused(
    body: _Array, body_sigma: _Array, ground: _Array, ground_sigma: _Array,
) -> tuple[_Array, _Array, NDArray[np.uint8]]:
    """Return log-range, its spread and the cues: the body, and the ground where it helps."""
    with np.errstate(invalid='ignore'):
        worth = body_sigma ** 2 / (body_sigma ** 2 + ground_sigma ** 2)
        used = ((np.abs(body - ground) <= CONTRADICTION * np.hypot(body_sigma, ground_sigma))
                & (worth >= LEAST_WORTH))
    weight = np.where(used, worth, 0.0)
    log_range = body + weight * np.where(used, ground - body, 0.0)
    cues = np.where(used, np.uint8(_SKELETON | Cue.GROUND), np.uint8(_SKELETON))
    return log_range, body_sigma * np.sqrt(1 - weight), cues


def _reasons(
    view: Canonical, lifted: Lifted, log_range: _Array, gravity: _Array,
) -> NDArray[np.uint8]:
    """Return (n,) why a person has no range."""
    down = view.rotation[:, 1] @ gravity[0]
    with np.errstate(invalid='ignore'):
        x, y = view.points.transpose(2, 0, 1)
        squares = x * x + y * y
        count = view.known.sum(axis=1)
        stray = ((squares.max(axis=1) > LARGEST_SHARE * squares.sum(axis=1))
                 & (count >= SHARING_KEYPOINTS))
        few = (count < FEWEST_KEYPOINTS) | ~np.isfinite(log_range)
        outside = (log_range < _LOG_RANGES[0]) | (log_range > _LOG_RANGES[1])
        reasons = np.full(len(count), Reason.NONE, np.uint8)
        reasons[outside] = Reason.OUT_OF_RANGE
        reasons[~(lifted.log_sigma <= LARGEST_SPREAD)] = Reason.TOO_FEW_KEYPOINTS
        reasons[stray | (down < UPSIDE_DOWN)] = Reason.IMPLAUSIBLE_SKELETON
        reasons[few] = Reason.TOO_FEW_KEYPOINTS
        return reasons
