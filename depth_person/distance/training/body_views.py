"""What cameras see of people of our own making, for the body dimensions models."""
from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depth_person.camera.intrinsics import Intrinsics
from depth_person.distance.body_dimensions import ModelCamera
from depth_person.distance.training.population import Population
from depth_person.distance.training.poses import KINDS
from depth_person.distance.training.views import log_uniform, turned_bodies
from depth_person.pose.people import People
from depth_person.pose.skeleton import Keypoint, N_KEYPOINTS

_Array = NDArray[np.float64]

#: Statures of the people drawn, metres: the paper's, 110 to 190 cm, and the tallest adults.
STATURES = (1.10, 2.05)
#: Nearest and farthest person, metres.
RANGES = (2.5, 22.0)
#: Focal lengths over image widths of drone cameras (102 to 41 degrees across), and of the paper's
#: zoom lens, 18 to 55 mm before 6000 pixels of 3.9 micrometres.
FOCAL_LENGTHS = (0.4, 1.35)
ZOOM = (18 / 23.4, 55 / 23.4)
#: Keypoint noise: least and largest, in pixels of an image 1280 wide, and on the body, metres.
NOISE_PX = (0.5, 2.5)
NOISE_M = (5e-3, 3e-2)

#: The paper's camera at one zoom, 24 mm. Its place is not printed. The printed boxes fit one that
#: is about level and about a metre above the floor, so this one stands there, as exactly as a
#: tripod with a spirit level is set up.
PAPER_CAMERA = ModelCamera(width=6000, height=4000, focal_px=24.0 / 3.9e-3)
PAPER_CAMERA_HEIGHT = (1.0, 0.02)
PAPER_TILT_DEG = 0.25
#: The paper's distances, metres.
PAPER_DISTANCES = np.arange(3.81, 6.82, 0.3)

_UPRIGHT = [list(KINDS).index(kind) for kind in ('stand', 'walk', 'arms')]


@dataclass(frozen=True, eq=False)
class BodyViews:
    """
    What one camera sees of n people who show their face and an ankle.

    :ivar people: with the training bodies' own keypoint convention.
    :ivar stature: (n,) metres.
    :ivar range: (n,) to the neck, metres.
    :ivar distance: (n,) to the neck along the floor, metres.
    :ivar gravity: (n, 3) unit vectors down in the camera optical frame.
    :ivar elevation: (n,) radians by which the camera looks down on the person.
    :ivar child: (n,) whether younger than 18.
    :ivar upright: (n,) whether standing or walking.
    :ivar person: (n,) who it is.
    """

    camera: Intrinsics
    people: People
    stature: _Array
    range: _Array
    distance: _Array
    gravity: _Array
    elevation: _Array
    child: NDArray[np.bool_]
    upright: NDArray[np.bool_]
    person: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.people)

    def take(self, rows: NDArray[Any]) -> BodyViews:
        """Return the views of these rows."""
        people = People(self.people.keypoints[rows], self.people.track_ids[rows],
                        convention=self.people.convention)
        return replace(self, people=people, **{
            field.name: getattr(self, field.name)[rows] for field in fields(self)[2:]})


def random_camera(rng: np.random.Generator) -> Intrinsics:
    """Return a camera: mostly one that drones carry, sometimes the paper's at some zoom."""
    if rng.random() < 0.25:
        width, height, ratios = PAPER_CAMERA.width, PAPER_CAMERA.height, ZOOM
    else:
        width, height = ((1280, 720), (1920, 1080), (3840, 2160))[rng.integers(3)]
        ratios = FOCAL_LENGTHS
    focal_px = width * float(log_uniform(rng, ratios, 1)[0])
    return Intrinsics(width, height, focal_px, focal_px, (width - 1) / 2, (height - 1) / 2)


def random_views(
    rng: np.random.Generator, people: Population, camera: Intrinsics, n: int,
) -> BodyViews:
    """Return at most n random people of any pose, wherever they are in the image as a whole."""
    person = rng.choice(_of_stature(people), n)
    distance = log_uniform(rng, RANGES, n)
    elevation = np.radians(np.where(
        rng.random(n) < 0.6, rng.normal(2, 6, n), rng.uniform(5, 50, n)))
    neck = np.stack([0 * distance, np.sin(elevation) * distance, np.cos(elevation) * distance], -1)
    points = _stood(people.keypoints[person], rng.uniform(-np.pi, np.pi, n)) + neck[:, None]
    share = rng.uniform(-1, 1, (n, 2)) * (0.4, 0.15)
    aim = camera.undistort(share * (camera.width, camera.height) + (camera.cx, camera.cy))
    turn = _rolls(rng.normal(0, np.radians(3), n)) @ _turned(points.mean(axis=1), aim)
    return _views(rng, people, person, camera, points @ turn.transpose(0, 2, 1), turn)


def paper_views(rng: np.random.Generator, people: Population, n: int) -> BodyViews:
    """Return n upright people at each of the paper's distances before the paper's camera."""
    upright = _of_stature(people)
    upright = upright[np.isin(people.kind[upright], _UPRIGHT)]
    person = np.repeat(rng.choice(upright, min(n, len(upright)), replace=False),
                       len(PAPER_DISTANCES))
    rows = len(person)
    points = _stood(people.keypoints[person], rng.uniform(-np.pi, np.pi, rows))
    bearing = rng.uniform(-0.2, 0.2, rows)
    distance = np.resize(PAPER_DISTANCES, rows)
    soles = points[:, [Keypoint.R_ANKLE, Keypoint.L_ANKLE], 1].max(axis=1) + (
        0.06 * people.stature[person])
    height = rng.normal(*PAPER_CAMERA_HEIGHT, rows)
    points += np.stack([
        np.sin(bearing) * distance, height - soles, np.cos(bearing) * distance], axis=-1)[:, None]
    pitch = np.radians(rng.normal(0, PAPER_TILT_DEG, rows))
    turn = _rolls(np.radians(rng.normal(0, PAPER_TILT_DEG, rows))) @ _pitches(pitch)
    size = PAPER_CAMERA
    camera = Intrinsics(
        size.width, size.height, size.focal_px, size.focal_px, (size.width - 1) / 2,
        (size.height - 1) / 2)
    return _views(rng, people, person, camera, points @ turn.transpose(0, 2, 1), turn)


def _of_stature(people: Population) -> NDArray[np.intp]:
    return np.flatnonzero((people.stature >= STATURES[0]) & (people.stature <= STATURES[1]))


def _stood(bodies: NDArray[np.float32], yaw: _Array) -> _Array:
    """Return keypoints (n, 18, 3) from their necks in a level camera's axes; yaw 0 faces it."""
    return turned_bodies(bodies.astype(np.float64) - bodies[:, [Keypoint.NECK]], yaw)


def _views(
    rng: np.random.Generator, people: Population, person: NDArray[np.int64], camera: Intrinsics,
    points: _Array, turn: _Array,
) -> BodyViews:
    """Return the views of keypoints (n, 18, 3) in the camera's frame, those that have a box."""
    n = len(points)
    neck, down = points[:, Keypoint.NECK], turn[:, :, 1]
    noise_px = log_uniform(rng, NOISE_PX, (n, 1, 1)) * camera.width / 1280
    marked = points + rng.normal(0, 1, points.shape) * log_uniform(rng, NOISE_M, (n, 1, 1))
    pixels = camera.project(marked) + rng.normal(0, 1, (n, N_KEYPOINTS, 2)) * noise_px
    share = rng.choice([0.0, 0.06, 0.2], (n, 1), p=[0.5, 0.35, 0.15])
    with np.errstate(invalid='ignore'):
        shown = (rng.random((n, N_KEYPOINTS)) >= share) & (
            (pixels >= 0) & (pixels < (camera.width, camera.height))).all(axis=-1)
    keypoints = np.where(shown[..., None], np.insert(pixels, 2, 1.0, axis=-1), np.nan)
    keypoints[:, Keypoint.NECK] = np.nan
    range_ = np.linalg.norm(neck, axis=1)
    depression = (neck * down).sum(axis=1)
    views = BodyViews(
        camera=camera,
        people=People(keypoints.astype(np.float32), np.arange(n, dtype=np.int32),
                      convention='mesh'),
        stature=people.stature[person].astype(np.float64), range=range_,
        distance=np.sqrt(range_ ** 2 - depression ** 2), gravity=down,
        elevation=np.arcsin(depression / range_), child=people.child[person],
        upright=np.isin(people.kind[person], _UPRIGHT), person=person)
    face = shown[:, [Keypoint.NOSE, Keypoint.R_EYE, Keypoint.L_EYE, Keypoint.R_EAR,
                     Keypoint.L_EAR]].any(axis=1)
    ankle = shown[:, [Keypoint.R_ANKLE, Keypoint.L_ANKLE]].any(axis=1)
    return views.take(np.flatnonzero(face & ankle))


def _pitches(angle: _Array) -> _Array:
    """Return the (n, 3, 3) rotations about the x axis."""
    cos, sin, one, none = np.cos(angle), np.sin(angle), np.ones_like(angle), 0 * angle
    return np.stack([one, none, none, none, cos, -sin, none, sin, cos], axis=-1).reshape(-1, 3, 3)


def _rolls(angle: _Array) -> _Array:
    """Return the (n, 3, 3) rotations about the z axis."""
    cos, sin, one, none = np.cos(angle), np.sin(angle), np.ones_like(angle), 0 * angle
    return np.stack([cos, -sin, none, sin, cos, none, none, none, one], axis=-1).reshape(-1, 3, 3)


def _turned(centre: _Array, aim: _Array) -> _Array:
    """Return level cameras' tilts (n, 3, 3) that bring points (n, 3) to where plane z = 1 says."""
    bearing = np.arctan(aim[:, 0])
    pitch = np.arctan2(centre[:, 1], np.hypot(centre[:, 0], centre[:, 2])) - np.arctan(aim[:, 1])
    cos, sin, one, none = np.cos(bearing), np.sin(bearing), np.ones_like(bearing), 0 * bearing
    yaw = np.stack([cos, none, sin, none, one, none, -sin, none, cos], axis=-1).reshape(-1, 3, 3)
    return _pitches(pitch) @ yaw
