#!/usr/bin/env python3
"""
Makes the regression bags.

    python test/regression/make_bags.py SEQUENCE [NAME ...]

SEQUENCE is the folder of the walking sequence that demo/walk was made of: gt/*.json beside the
images that they name. Its people are at known places before a camera that stands still, so that a
scene may leave some of them out, put a wall before them, take the pictures with fewer pixels, or
through another lens: the truth stays exact. What the sequence cannot show (a camera high above
the people, a network that marks the neck itself) are bags of keypoints, those of an average body.

Each bag has CameraInfo and on /person_truth the true positions of the necks. The same sequence
makes the same bags.
"""
from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from dataclasses import replace
import math
from pathlib import Path
import shutil
import sys
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from regression_cases import BAGS, DRONE_HEIGHT, DRONE_PITCH_DEG
import scenes
from scenes import ACROSS, AWAY, behind_wall, Sequence, Shot, TURNING

REPOSITORY = Path(__file__).parents[2]
sys.path += [str(REPOSITORY / 'demo'), str(REPOSITORY / 'test' / 'core')]

from average_body import CAMERA, NECK_HEIGHT, standing_at  # noqa: E402
from make_bag import camera_info, FRAME_ID, make, START_NS, truth  # noqa: E402

from depth_person.camera.intrinsics import Intrinsics  # noqa: E402
from depth_person.distance.attitude import optical_from_body  # noqa: E402
from depth_person.errors import DepthPersonError  # noqa: E402
from depth_person.pose.skeleton import Keypoint  # noqa: E402
from depth_person.replay.bags import BagWriter  # noqa: E402

WIDTH = 960
QUALITY = 60
KEYPOINT = np.dtype([('u', '<f4'), ('v', '<f4'), ('score', '<f4'), ('track_id', '<i4')])
POINT_FIELD_TYPES = {'<f4': 7, '<i4': 5}
LENS = (-0.28, 0.09, 0.001, -0.001, 0.0)
RATE = 12.0

Keypoints = tuple[float, Intrinsics, NDArray[np.float64], NDArray[np.float64]]


def walker(sequence: Sequence) -> list[Shot]:
    """Return one person who walks away."""
    return sequence.shots(range(2, 34, 3), people=[AWAY])


def crossing(sequence: Sequence) -> list[Shot]:
    """Return two people, of whom one hides the other for some frames."""
    return sequence.shots(range(36, 60, 2), people=[AWAY, ACROSS])


def half_hidden(sequence: Sequence) -> list[Shot]:
    """Return one person whose legs are behind a wall."""
    return [behind_wall(shot, top=425)
            for shot in sequence.shots(range(2, 34, 3), people=[AWAY])]


def turned(sequence: Sequence) -> list[Shot]:
    """
    Return one person who turns round, in four times the sequence's pace.

    Left out is when ACROSS passes, of whom the scene could not be cleared.
    """
    return [replace(shot, time_s=shot.time_s / 4)
            for shot in sequence.shots([*range(0, 18, 3), *range(36, 96, 5)], people=[TURNING])]


def far(sequence: Sequence) -> list[Shot]:
    """Return one person who walks away, as few pixels of the picture as one three times as far."""
    return [scenes.resized(shot, width=WIDTH // 2)
            for shot in sequence.shots(range(56, 96, 4), people=[AWAY])]


def nobody(sequence: Sequence) -> list[Shot]:
    """Return a part of the place without people, getting darker."""
    shots = [scenes.cropped(shot, left=600, top=180)
             for shot in sequence.shots(range(0, 12, 2), people=[])]
    return [replace(shot, image=cv2.convertScaleAbs(shot.image, alpha=1 - 0.1 * index))
            for index, shot in enumerate(shots)]


def distorted(sequence: Sequence) -> list[Shot]:
    """Return three people through a wide-angle lens, near the edge where it bends most."""
    return [scenes.through_lens(shot, distortion=LENS)
            for shot in sequence.shots(range(0, 18, 2), people=[AWAY, ACROSS, TURNING])]


def drone() -> Iterator[Keypoints]:
    """Yield two people on the ground, seen by a camera above them that looks down."""
    rotation = optical_from_body(pitch_down=math.radians(DRONE_PITCH_DEG), roll_cw=0.0)
    level = optical_from_body(pitch_down=0.0, roll_cw=0.0)
    random = np.random.default_rng(3)
    for step in range(30):
        time_s = step / RATE
        below = DRONE_HEIGHT - NECK_HEIGHT
        bodies = np.stack([
            standing_at((-1.5 + 0.9 * time_s, below, 7.0), yaw_deg=-80.0, size=1.03),
            standing_at((1.0, below, 12.0 - 1.2 * time_s), yaw_deg=10.0, size=0.97)])
        seen = bodies @ (rotation @ level.T).T
        yield time_s, CAMERA, seen, _marked(seen, random, noise_px=1.0)


def measured_neck() -> Iterator[Keypoints]:
    """Yield one person who turns by 60 degrees, with the neck's true image."""
    random = np.random.default_rng(4)
    for step in range(30):
        body = standing_at((-0.4, 0.1, 3.0), yaw_deg=2.0 * step)[None]
        yield step / RATE, CAMERA, body, _marked(body, random, noise_px=0.02)


def _marked(
    bodies: NDArray[np.float64], random: np.random.Generator, *, noise_px: float,
) -> NDArray[np.float64]:
    """Return (n, 18, 2) pixels of the bodies' keypoints with noise."""
    pixels = CAMERA.project(bodies)
    return pixels + random.normal(0, noise_px, pixels.shape)


SHOTS: dict[str, Callable[[Sequence], list[Shot]]] = {
    each.__name__: each
    for each in (walker, crossing, half_hidden, turned, far, nobody, distorted)}
KEYPOINTS: dict[str, Callable[[], Iterator[Keypoints]]] = {
    each.__name__: each for each in (drone, measured_neck)}


def write_shots(path: Path, shots: list[Shot]) -> None:
    """Write a bag of JPEG images."""
    with BagWriter(path, compress=True) as bag:
        for shot in shots:
            small = shot if shot.intrinsics.width <= WIDTH else scenes.resized(shot, width=WIDTH)
            header = _begin_frame(bag, small.time_s, small.intrinsics, small.necks)
            _, jpeg = cv2.imencode('.jpg', small.image, [
                cv2.IMWRITE_JPEG_QUALITY, QUALITY, cv2.IMWRITE_JPEG_OPTIMIZE, 1])
            bag.write('/image_raw/compressed', _stamp_ns(small.time_s), make(
                'sensor_msgs/msg/CompressedImage', header=header,
                format='bgr8; jpeg compressed bgr8', data=jpeg.ravel()))


def write_keypoints(path: Path, frames: Iterator[Keypoints]) -> None:
    """Write a bag of keypoints as pose_node publishes them."""
    with BagWriter(path, compress=True) as bag:
        for time_s, intrinsics, bodies, pixels in frames:
            header = _begin_frame(bag, time_s, intrinsics, {
                person + 1: tuple(body[Keypoint.NECK]) for person, body in enumerate(bodies)})
            points = np.zeros(pixels.shape[:2], KEYPOINT)
            points['u'], points['v'] = np.moveaxis(pixels, -1, 0)
            points['score'] = 0.7
            points['track_id'] = np.arange(1, len(points) + 1)[:, None]
            bag.write('/person_keypoints', _stamp_ns(time_s), _cloud(header, points))


def _begin_frame(
    bag: BagWriter, time_s: float, intrinsics: Intrinsics,
    necks: dict[int, tuple[float, float, float]],
) -> Any:
    """Write a frame's CameraInfo and truth; return the header that all its messages have."""
    stamp_ns = _stamp_ns(time_s)
    stamp = make(
        'builtin_interfaces/msg/Time', sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9)
    header = make('std_msgs/msg/Header', stamp=stamp, frame_id=FRAME_ID)
    record = {
        'width': intrinsics.width, 'height': intrinsics.height,
        'K': {name: getattr(intrinsics, name) for name in ('fx', 'fy', 'cx', 'cy')},
        'dist_plumb_bob': intrinsics.distortion,
        'persons': [
            {'id': person, 'neck_cam_m': neck, 'range_m': float(np.linalg.norm(neck))}
            for person, neck in necks.items()]}
    bag.write('/camera_info', stamp_ns, camera_info(header, record))
    bag.write('/person_truth', stamp_ns, truth(header, record))
    return header


def _stamp_ns(time_s: float) -> int:
    return START_NS + round(time_s * 1e9)


def _cloud(header: Any, points: NDArray[np.void]) -> Any:
    fields = [
        make('sensor_msgs/msg/PointField', name=name, offset=KEYPOINT.fields[name][1],
             datatype=POINT_FIELD_TYPES[KEYPOINT[name].str], count=1)
        for name in KEYPOINT.names]
    return make(
        'sensor_msgs/msg/PointCloud2', header=header, height=len(points), width=18,
        fields=fields, is_bigendian=False, point_step=KEYPOINT.itemsize,
        row_step=18 * KEYPOINT.itemsize, data=np.frombuffer(points.tobytes(), np.uint8),
        is_dense=False)


def main() -> int:
    """Make the bags; return the exit code."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('sequence', type=Path, metavar='SEQUENCE')
    parser.add_argument(
        'names', nargs='*', metavar='NAME', help=', '.join([*SHOTS, *KEYPOINTS]))
    parser.add_argument('--out', type=Path, default=BAGS, metavar='DIR')
    args = parser.parse_args()
    unknown = set(args.names) - SHOTS.keys() - KEYPOINTS.keys()
    if unknown:
        parser.error(f'no bag is called {", ".join(sorted(unknown))}')
    try:
        sequence = Sequence(args.sequence)
        for name in args.names or [*SHOTS, *KEYPOINTS]:
            path = args.out / name
            path.parent.mkdir(parents=True, exist_ok=True)
            shutil.rmtree(path, ignore_errors=True)
            if name in SHOTS:
                write_shots(path, SHOTS[name](sequence))
            else:
                write_keypoints(path, KEYPOINTS[name]())
            size = sum(file.stat().st_size for file in path.iterdir())
            print(f'{path}: {size / 1e6:.2f} MB')
    except DepthPersonError as error:
        print(f'make_bags: {error}', file=sys.stderr)
        return 1
    return 0


if __name__ == '__main__':
    sys.exit(main())
