"""
What following people through time takes beside measuring them, for 1, 8 and 20 people.

    .venv/bin/python test/benchmarks/filter_speed.py

Prints the median of many calls, by turns, so that other work on the machine falls on both alike.
"""
from __future__ import annotations

import argparse
import statistics
import time

from estimator_speed import CALLS, CAMERA, crowd

from depth_person.distance.estimators import make_estimator
from depth_person.distance.following import PeopleFilter

_STEP_NS = 33_000_000


def main() -> None:
    argparse.ArgumentParser(description=__doc__.splitlines()[1]).parse_args()
    estimator = make_estimator('skeleton')
    for n in (1, 8, 20):
        people, people_filter = crowd(n), PeopleFilter()
        estimating, filtering = [], []
        for call in range(CALLS):
            start = time.perf_counter()
            distances = estimator.estimate(people, CAMERA)
            middle = time.perf_counter()
            people_filter.measure(people, distances, stamp_ns=call * _STEP_NS)
            estimating.append(middle - start)
            filtering.append(time.perf_counter() - middle)
        estimate, follow = (1e3 * statistics.median(took) for took in (estimating, filtering))
        print(f'{n:3d} people: estimator {estimate:.2f} ms, filter {follow:.2f} ms, '
              f'{follow / estimate:.2f} times')


if __name__ == '__main__':
    main()
