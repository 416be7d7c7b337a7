"""
Compares scans of drone views with the truth: bearings, distances, and who is told too far.

    python test/benchmarks/drone_scan.py FOLDER [--mount 30] [--roll 15] [--tilt 1] [--height]
        [--children]

FOLDER holds gt/*.json and images/ as `depth_person evaluate` reads them; frames of the scenario
`drone` count. The camera is taken to be mounted looking down by so many degrees, and the rest of
its true pitch and all of its true roll to be the vehicle's, as an Imu would tell it. A further
roll turns the images about their principal points, which is what the camera would see. Bearings
and horizontal distances are those from the vehicle's nose in its level frame.
"""
from __future__ import annotations

import argparse
from dataclasses import dataclass
import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from depth_person.autopilot.scan import BINS, scan, ScanOptions
from depth_person.autopilot.vehicle import CameraOnBody, LevelView
from depth_person.camera.frame import Frame
from depth_person.camera.intrinsics import Intrinsics
from depth_person.distance.estimator import Body, Mounting
from depth_person.distance.stage import DistanceOptions
from depth_person.pipeline import Pipeline
from depth_person.pose.options import PoseOptions
from depth_person.pose.store import DEFAULT_MODEL

#: A found person is this true one when the necks are seen so close together, degrees.
SAME_DEG = 3.0
UP = np.array([0.0, 0.0, 1.0])


@dataclass
class Figures:
    """What the people of all frames come to."""

    people: int
    bearing_deg: list[float]
    relative: list[float]
    at_bearing: int
    not_further: int
    vehicle_deg: list[tuple[float, float]]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('folder', type=Path)
    parser.add_argument('--mount', type=float, default=30.0, help='degrees, default %(default)s')
    parser.add_argument('--roll', type=float, default=0.0, help='degrees to the right')
    parser.add_argument(
        '--tilt', type=float, default=0.0, help='error of the attitude told, degrees of pitch')
    parser.add_argument('--height', action='store_true', help='tell the true height, too')
    parser.add_argument('--children', action='store_true', help='people may be children')
    parser.add_argument('--model', default=DEFAULT_MODEL, help='default %(default)s')
    parser.add_argument('--input-size', type=int, default=PoseOptions.input_size)
    args = parser.parse_args()
    figures = Figures(0, [], [], 0, 0, [])
    for path in sorted((args.folder / 'gt').glob('*.json')):
        record = json.loads(path.read_text())
        if record['scenario'] == 'drone':
            options = PoseOptions(model=args.model, input_size=args.input_size)
            add_frame(figures, record, args.folder, args, options)
    low, high = np.min(figures.vehicle_deg, axis=0), np.max(figures.vehicle_deg, axis=0)
    print(f'{figures.people} people; camera mounted {args.mount:g} degrees down, vehicle pitched '
          f'{low[0]:+.1f} to {high[0]:+.1f} and rolled {low[1]:+.1f} to {high[1]:+.1f} degrees')
    bearing, relative = np.abs(figures.bearing_deg), np.array(figures.relative)
    print(f'found with a range              {len(relative) / figures.people:6.0%}')
    print(f'bearing, error                  {np.median(bearing):6.2f} degrees median, '
          f'{bearing.max():.2f} at most')
    print(f'horizontal distance, error      {np.median(np.abs(relative)):6.1%} median, '
          f'{np.median(relative):+.1%} signed, {np.abs(relative).max():.1%} at most')
    print(f'bin at the true bearing filled  {figures.at_bearing / figures.people:6.0%}')
    print(f'... and not beyond the truth    {figures.not_further / figures.people:6.0%} '
          '(two sigmas taken off)')


def add_frame(
    figures: Figures, record: dict[str, Any], folder: Path, args: argparse.Namespace,
    pose: PoseOptions,
) -> None:
    """Add the people of one frame."""
    matrix, camera = record['K'], record['camera']
    intrinsics = Intrinsics(
        record['width'], record['height'], matrix['fx'], matrix['fy'], matrix['cx'], matrix['cy'],
        distortion=tuple(record['dist_plumb_bob']))
    cos, sin = np.cos(np.radians(args.roll)), np.sin(np.radians(args.roll))
    rolled = np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
    optical_from_world = rolled @ np.array(camera['R_world_to_cam'])  # z of the world is up
    gravity = optical_from_world @ -UP  # a tilt is about the camera's x, to the right
    cos, sin = np.cos(np.radians(args.tilt)), np.sin(np.radians(args.tilt))
    gravity = np.array([[1.0, 0.0, 0.0], [0.0, cos, -sin], [0.0, sin, cos]]) @ gravity
    height = camera['height_m'] if args.height else None
    mounted = CameraOnBody.mounted(pitch_down=np.radians(args.mount))
    view = LevelView.of(mounted, gravity)
    assert view is not None
    figures.vehicle_deg.append(tilt(mounted.rotation @ gravity))
    image = cv2.imread(str(folder / record['image']))
    if args.roll:
        assert not intrinsics.distorted
        center = np.array([intrinsics.cx, intrinsics.cy])
        shift = center - rolled[:2, :2] @ center
        image = cv2.warpAffine(
            image, np.column_stack([rolled[:2, :2], shift]), image.shape[1::-1])
    tracked = Pipeline(pose, DistanceOptions(body=Body(children=args.children))).process(
        Frame(image, 0, 'camera', intrinsics), Mounting(gravity=gravity, height=height))
    ranges = scan(tracked, intrinsics, view, ScanOptions())
    found = tracked.distances.position[tracked.distances.known]
    # Ahead in the world is the vehicle's nose laid flat.
    nose = optical_from_world.T @ mounted.rotation.T @ np.array([1.0, 0.0, 0.0])
    for person in record['persons']:
        neck = rolled @ np.array(person['neck_cam_m'])
        if not in_image(neck, intrinsics):
            continue
        bearing, distance = from_nose(optical_from_world.T @ neck, nose)
        figures.people += 1
        told = ranges[round(bearing / (360 / BINS)) % BINS]
        figures.at_bearing += bool(np.isfinite(told))
        figures.not_further += bool(told <= distance)
        apart = angles_between(found, neck)
        if len(found) and apart.min() < SAME_DEG:
            x, y, _ = view.to_level(found[apart.argmin()])
            figures.bearing_deg.append(
                (np.degrees(np.arctan2(y, x)) - bearing + 180) % 360 - 180)
            figures.relative.append(float(np.hypot(x, y) / distance - 1))


def in_image(point: NDArray[np.float64], intrinsics: Intrinsics) -> bool:
    """Return whether a point is seen."""
    pixel = intrinsics.project(point)
    return bool(np.all((pixel >= 0) & (pixel < (intrinsics.width, intrinsics.height))))


def from_nose(point: NDArray[np.float64], nose: NDArray[np.float64]) -> tuple[float, float]:
    """Return bearing (degrees, clockwise) and horizontal distance of a point of the world."""
    heading, azimuth = (np.arctan2(vector[0], vector[1]) for vector in (nose, point))
    return float(np.degrees(azimuth - heading)), float(np.hypot(point[0], point[1]))


def tilt(down: NDArray[np.float64]) -> tuple[float, float]:
    """Return how far a vehicle's nose is up and its right side down, degrees."""
    return (float(np.degrees(np.arcsin(-down[0]))),
            float(np.degrees(np.arctan2(-down[1], -down[2]))))


def angles_between(
    points: NDArray[np.float64], other: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the angles (n,) between directions, degrees."""
    cosine = points @ other / np.linalg.norm(points, axis=1) / np.linalg.norm(other)
    return np.degrees(np.arccos(np.clip(cosine, -1, 1)))


if __name__ == '__main__':
    main()
