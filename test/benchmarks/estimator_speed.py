"""
What one call of each distance estimator takes, for one person and for ten.

    .venv/bin/python test/benchmarks/estimator_speed.py

Prints the median of many calls, by turns, so that other work on the machine falls on all alike.
"""
from __future__ import annotations

import argparse
import statistics
import time

import numpy as np

from depth_person.camera.intrinsics import Intrinsics
from depth_person.distance.canonical import TEMPLATE
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
    argparse.ArgumentParser(description=__doc__.splitlines()[1]).parse_args()
    estimators = [make_estimator(name) for name in ESTIMATORS]
    for n in (1, 10):
        people = crowd(n)
        times: dict[str, list[float]] = {name: [] for name in ESTIMATORS}
        for _ in range(CALLS):
            for estimator in estimators:
                start = time.perf_counter()
                estimator.estimate(people, CAMERA)
                times[estimator.name].append(time.perf_counter() - start)
        for name, took in times.items():
            per_person = 1e3 * statistics.median(took) / n
            print(f'{name:16} {n:3d} people: {per_person:.3f} ms a person')


if __name__ == '__main__':
    main()
