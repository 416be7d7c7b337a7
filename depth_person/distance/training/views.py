"""Training examples: what a camera would see of a population."""
from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from depth_person.distance.canonical import Canonical, canonicalise, MIRRORED
from depth_person.distance.conventions import N_FIGURES, place
from depth_person.distance.lifter import (
    FEWEST_KEYPOINTS,
    Knowledge,
    lifter_inputs,
    LifterInputs,
)
from depth_person.distance.training.hiding import swapped, visible
from depth_person.distance.training.population import Population
from depth_person.distance.vectors import unit
from depth_person.pose.skeleton import Keypoint, N_KEYPOINTS

_Array = NDArray[np.float64]

#: Nearest and farthest training person, metres.
RANGES = (1.0, 45.0)
#: Keypoint noise: least and largest, as an angle (of a pixel or two) and on the body, metres.
NOISE_RAD = (3e-4, 5e-3)
NOISE_M = (1e-3, 3e-2)
#: Least and largest error of an attitude sensor, radians.
TILT = (0.003, 0.03)
#: Least and largest figures of a placement, in the order of conventions.Placement.
FIGURES = np.array([
    (-0.32, 0.06), (-0.06, 0.12), (-0.4, 0.35), (-0.15, 0.15), (-0.2, 0.2), (-0.08, 0.08),
    (-0.08, 0.1)])
#: How wrong the figures of a convention may be that is not the mesh's, likewise.
FIGURES_SIGMA = np.array([0.06, 0.015, 0.08, 0.02, 0.08, 0.02, 0.03])


@dataclass(frozen=True, eq=False)
class Examples:
    """
    Training examples, row by row.

    :ivar inputs: what the network is given.
    :ivar log_correction: (n,) logarithm of the true range over the canonical guess.
    :ivar neck: (n, 2) the true neck in the canonical coordinates of the points.
    :ivar yaw: (n,) radians; 0 faces the camera, positive turns the chest to image right.
    :ivar range: (n,) metres.
    :ivar elevation: (n,) radians by which the camera looks down on the person.
    """

    inputs: LifterInputs
    log_correction: _Array
    neck: _Array
    yaw: _Array
    range: _Array
    elevation: _Array

    def take(self, rows: NDArray[np.bool_]) -> Examples:
        """Return the examples of these rows."""
        return Examples(self.inputs.take(rows), *(
            getattr(self, field.name)[rows] for field in fields(self)[1:]))


@dataclass(frozen=True)
class ViewOptions:
    """Parts of the examples that hold what a deployment may know; the rest are without."""

    gravity: float = 0.5
    stature: float = 0.15
    shoulder_width: float = 0.15
    children: float = 0.2
    mesh_convention: float = 0.3


def make_examples(
    rng: np.random.Generator, people: Population, n: int, options: ViewOptions = ViewOptions(),
) -> Examples:
    """Return about n examples of random people, views, noise and gaps."""
    allow_children = rng.random(n) < options.children
    people = people.take(_draw(rng, people.child, allow_children))
    yaw = rng.uniform(-np.pi, np.pi, n)
    elevation = _elevations(rng, n)
    distance = log_uniform(rng, RANGES, n)
    figures = rng.uniform(FIGURES[:, 0], FIGURES[:, 1], (n, N_FIGURES))
    told = figures + rng.normal(0, 1, figures.shape) * FIGURES_SIGMA
    mesh = rng.random(n) < options.mesh_convention
    figures[mesh] = told[mesh] = 0.0

    true_neck, points = _seen(people.keypoints, figures, yaw, elevation, distance)
    image = points[..., :2] / np.maximum(points[..., 2:], 0.05)
    known = visible(rng, image, yaw) & (points[..., 2] > 0.1)
    stated, noise = _noise(rng, distance)
    rays = _jittered(rng, points, noise)
    swap = swapped(rng, yaw)
    rays = np.where(swap[..., None], rays[:, MIRRORED], rays)
    known = np.where(swap, known[:, MIRRORED], known)
    stated = np.where(swap, stated[:, MIRRORED], stated)
    view = canonicalise(rays, known)
    knowledge = _knowledge(rng, people, figures, told, allow_children, options)
    gravity = np.where((rng.random(n) < options.gravity)[:, None],
                       tilted(rng, np.broadcast_to((0.0, 1.0, 0.0), (n, 3))), np.nan)
    inputs = lifter_inputs(
        view, noise_rad=stated, gravity=gravity, told=knowledge.as_features())
    examples = Examples(
        inputs=inputs, log_correction=np.log(distance / view.guess),
        neck=_in_view(view, true_neck), yaw=yaw, range=distance, elevation=elevation)
    usable = (known.sum(axis=1) >= FEWEST_KEYPOINTS) & np.isfinite(examples.log_correction)
    return examples.take(usable & (np.abs(examples.neck) < 5).all(axis=1))


def log_uniform(
    rng: np.random.Generator, limits: tuple[float, float], shape: int | tuple[int, ...],
) -> _Array:
    """Return values between two limits, every ratio alike."""
    return np.exp(rng.uniform(np.log(limits[0]), np.log(limits[1]), shape))


def _draw(
    rng: np.random.Generator, child: NDArray[np.bool_], allow_children: NDArray[np.bool_],
) -> NDArray[np.int64]:
    """Return rows of adults; where children are allowed, half of them are children."""
    adults, children = np.flatnonzero(~child), np.flatnonzero(child)
    rows = rng.choice(adults, len(allow_children))
    young = allow_children & (rng.random(len(rows)) < 0.5)
    rows[young] = rng.choice(children, young.sum())
    return rows


def _elevations(rng: np.random.Generator, n: int) -> _Array:
    """Return radians by which cameras look down: street level, drones, some from below."""
    kind = rng.choice(3, n, p=[0.6, 0.33, 0.07])
    return np.radians(np.select(
        [kind == 0, kind == 1], [rng.normal(2, 6, n), rng.uniform(10, 70, n)],
        rng.uniform(-25, 0, n)))


def _seen(
    bodies: NDArray[np.float32], figures: _Array, yaw: _Array, elevation: _Array, distance: _Array,
) -> tuple[_Array, _Array]:
    """Return the necks' (n, 3) and the marked keypoints' (n, 18, 3) places in level cameras."""
    marked = place(bodies.astype(np.float64), figures)
    neck = np.stack([0 * distance, np.sin(elevation) * distance, np.cos(elevation) * distance], -1)
    return neck, turned_bodies(marked - bodies[:, [Keypoint.NECK]], yaw) + neck[:, None]


def turned_bodies(points: NDArray[np.floating], yaw: _Array) -> _Array:
    """Return points (n, k, 3) of bodies in a level camera's axes; yaw (n,) 0 faces it."""
    x, y, z = np.moveaxis(points, -1, 0)
    cos, sin = np.cos(yaw)[:, None], np.sin(yaw)[:, None]
    # The body's axes are left, back, up; the camera's right, down, forward.
    return np.stack([cos * x - sin * y, -z, sin * x + cos * y], axis=-1)


def _noise(rng: np.random.Generator, distance: _Array) -> tuple[_Array, _Array]:
    """Return the stated and the actual spreads (n, 18) of keypoints, radians."""
    n = len(distance)
    angle = log_uniform(rng, NOISE_RAD, (n, 1))
    body = log_uniform(rng, NOISE_M, (n, 1)) / distance[:, None]
    uneven = rng.choice([0.0, 0.5], (n, 1), p=[0.4, 0.6])
    stated = np.hypot(angle, body) * np.exp(uneven * rng.normal(0, 1, (n, N_KEYPOINTS)))
    stray = rng.random((n, N_KEYPOINTS)) < 0.02
    return stated, stated * np.where(stray, 4.0, 1.0)


def _jittered(rng: np.random.Generator, points: _Array, noise: _Array) -> _Array:
    """Return unit view rays (n, 18, 3) of points, off by so many radians on either axis."""
    rays = unit(points)
    off = rng.normal(0, 1, rays.shape) * noise[..., None]
    off -= (off * rays).sum(axis=-1, keepdims=True) * rays
    return unit(rays + off)


def tilted(rng: np.random.Generator, direction: _Array) -> _Array:
    """Return directions (n, 3) off the given ones by an attitude sensor's error."""
    sigma = log_uniform(rng, TILT, (len(direction), 1))
    return unit(direction + rng.normal(0, 1, direction.shape) * sigma)


def _knowledge(
    rng: np.random.Generator, people: Population, figures: _Array, told: _Array,
    allow_children: NDArray[np.bool_], options: ViewOptions,
) -> Knowledge:
    """Return what is known of the people, as wrong as its stated spread says."""
    n = len(people)
    marked_width = people.shoulder_width * np.exp(figures[:, 0])

    def given(truth: NDArray[np.floating], share: float) -> tuple[_Array, _Array]:
        sigma = log_uniform(rng, (0.005, 0.08), n)
        sigma = np.where(rng.random(n) < share, sigma, np.nan)
        return np.asarray(truth * np.exp(rng.normal(0, 1, n) * sigma), np.float64), sigma

    return Knowledge(
        told, *given(people.stature, options.stature),
        *given(marked_width, options.shoulder_width), allow_children)


def _in_view(view: Canonical, direction: _Array) -> _Array:
    """Return where on the canonical plane directions (n, 3) in the camera frame appear."""
    turned = np.einsum('nij,nj->ni', view.rotation, direction)
    return (turned[:, :2] / turned[:, 2:] - view.centroid) * view.guess[:, None]
