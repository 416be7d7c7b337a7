"""
What a camera's height and pitch are worth when they are learnt from people at known distances.

    .venv/bin/python test/benchmarks/mounting_crossvalidated.py DATA/real_keypoints/train.json

For recorded keypoints of a camera that stays where it is, such as a car's. The frames are dealt
into parts; for each part, the height, the pitch and the spread of the attitude are those under
which the true ranges of the people in all other parts are likeliest, given the stated sigmas.
Prints what was learnt for each part, and the errors of everybody, measured with what was learnt
without them.
"""
from __future__ import annotations

import argparse
from collections.abc import Iterable
from itertools import chain, product
from pathlib import Path

import numpy as np

from depth_person.distance.estimator import Mounting
from depth_person.distance.estimators import make_estimator
from depth_person.replay.evaluate import Evaluation, Sample
from depth_person.replay.keypoints import RecordedKeypoints
from depth_person.replay.metrics import figures
from depth_person.replay.reading import read_dataset
from depth_person.verbs.evaluate import fixed_mounting

HEIGHTS = np.arange(1.40, 1.81, 0.05)
PITCHES_DEG = np.arange(-1.0, 1.01, 0.25)
ATTITUDE_SIGMAS_DEG = 0.25, 0.5, 1.0
NEAR_M, FAR_M = 3.0, 20.0


def log_likelihood(samples: Iterable[Sample]) -> float:
    """Return that of the true ranges, a person, each normal about what was estimated."""
    error, sigma = np.array([
        (sample.range - sample.range_neck, sample.range_sigma)
        for sample in samples if sample.range is not None]).T
    return float(np.mean(-0.5 * np.square(error / sigma) - np.log(sigma)))


def row(name: str, samples: list[Sample]) -> str:
    """Return the figures of samples as a row of a table."""
    known = figures(samples)
    return (f'{name:>24} {known["n"]:4d} people, {known["with_range"]:.1%} with a range: '
            f'median {known["median_rel"]:.1%}, mean {known["mean_abs"]:.2f} m, within one sigma '
            f'{known["coverage_1"]:.0%}, two {known["coverage_2"]:.0%}')


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('recording', type=Path)
    parser.add_argument('--parts', type=int, default=5)
    parser.add_argument('--estimator', default='skeleton')
    args = parser.parse_args()
    clips = read_dataset(args.recording).clips
    estimator = make_estimator(args.estimator)

    def measured(told: Mounting) -> list[list[Sample]]:
        return list(Evaluation(RecordedKeypoints(), estimator, mounting=told).run(clips))

    untold = measured(Mounting())
    tried = {
        (height, pitch, sigma): measured(
            fixed_mounting(height, pitch_deg=pitch, attitude_sigma_deg=sigma))
        for height, pitch, sigma in product(HEIGHTS, PITCHES_DEG, ATTITUDE_SIGMAS_DEG)}
    part_of = np.random.default_rng(0).permutation(len(untold)) % args.parts
    held_out: list[Sample] = []
    for part in range(args.parts):
        others, own = np.flatnonzero(part_of != part), np.flatnonzero(part_of == part)
        best = max(tried, key=lambda told: log_likelihood(
            sample for frame in others for sample in tried[told][frame]))
        height, pitch, sigma = best
        print(f'part {part + 1}: {height:.2f} m, {pitch:+.2f} degrees down, to {sigma:g} degrees')
        held_out += [sample for frame in own for sample in tried[best][frame]]
    everybody = [*chain.from_iterable(untold)]
    for name, samples in (('nothing told', everybody), ('learnt without them', held_out)):
        print(row(name, samples))
        print(row(f'from {NEAR_M:g} to {FAR_M:g} m', [
            sample for sample in samples
            if sample.range_neck is not None and NEAR_M <= sample.range_neck <= FAR_M]))


if __name__ == '__main__':
    main()
