"""
What one call of each distance estimator takes, by how many people there are.

    .venv/bin/python test/benchmarks/estimator_speed.py [--people 8] [--height 1.6]

Prints the median and the least of many calls, by turns, so that other work on the machine falls on
all alike. With a height, the camera is level so far above the ground, and knows it.
"""
from __future__ import annotations

import argparse
import statistics
import time

import numpy as np

from depth_person.camera.intrinsics import Intrinsics
from depth_person.distance.attitude import level_gravity
from depth_person.distance.canonical import TEMPLATE
from depth_person.distance.estimator import Mounting
from depth_person.distance.estimators import ESTIMATORS, make_estimator
from depth_person.pose.people import People

CAMERA = Intrinsics(1280, 720, 900.0, 900.0, 639.5, 359.5)
CALLS = 1000


def crowd(n: int) -> People:
    """Return n upright people at 4 to 12 m."""
    depth = np.linspace(4.0, 12.0, n)
    pixels = 900.0 * TEMPLATE / depth[:, None, None] + (639.5, 330.0)
    scores = np.ones((n, len(TEMPLATE), 1))
    return People(
        np.concatenate([pixels, scores], axis=-1).astype(np.float32), np.arange(n, dtype=np.int32))


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--people', type=int, nargs='+', default=[1, 10])
    parser.add_argument('--height', type=float, help='metres')
    args = parser.parse_args()
    mounting = Mounting() if args.height is None else Mounting(
        gravity=level_gravity(pitch_down=0.0, roll_cw=0.0), height=args.height)
    estimators = [make_estimator(name) for name in ESTIMATORS]
    for n in args.people:
        people = crowd(n)
        times: dict[str, list[float]] = {name: [] for name in ESTIMATORS}
        for _ in range(CALLS):
            for estimator in estimators:
                start = time.perf_counter()
                estimator.estimate(people, CAMERA, mounting)
                times[estimator.name].append(1e3 * (time.perf_counter() - start))
        for name, took in times.items():
            usual = statistics.median(took)
            print(f'{name:16} {n:3d} people: {usual:.3f} ms, {usual / n:.3f} ms a person; '
                  f'at least {min(took):.3f} ms')


if __name__ == '__main__':
    main()
