"""
What following people through time is worth: on sequences, and on walkers of our own making.

    .venv/bin/python test/benchmarks/filter_measures.py FOLDER

FOLDER holds sequences with known distances (seq/NAME/gt beside images). Each is measured with
the true keypoints and 1 px of noise, and with the network's, as it is, and once more with nobody
seen for a second in its middle. Without FOLDER there are only the walkers: average bodies whose
sizes spread by 4 %, keypoints with 1 px of noise, 15 frames a second.
"""
from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
import sys

import numpy as np
from numpy.typing import NDArray

from depth_person.distance.estimators import make_estimator
from depth_person.distance.following import FilterOptions
from depth_person.distance.stage import DistanceOptions, DistanceStage
from depth_person.pose.people import People
from depth_person.pose.pipeline import PoseEstimator, PoseOptions
from depth_person.pose.skeleton import Keypoint
from depth_person.replay.dataset import TrueFrame
from depth_person.replay.evaluate import Evaluation
from depth_person.replay.keypoints import KeypointSource, NetworkKeypoints, TrueKeypoints
from depth_person.replay.reading import read_dataset

sys.path.insert(0, str(Path(__file__).parents[1] / 'core'))
from average_body import CAMERA, standing_at

WALKERS = 100
SIZE_SPREAD = 0.04
NOISE_PX = 1.0
RATE = 15.0
HIDDEN_S = 1.0
_LEGS = [row for row in Keypoint if row.name[2:] in ('HIP', 'KNEE', 'ANKLE')]


@dataclass(frozen=True)
class Course:
    """Ranges over time (times, people), metres; NaN where there is none."""

    time: NDArray[np.float64]
    truth: NDArray[np.float64]
    range: NDArray[np.float64]
    sigma: NDArray[np.float64]
    raw: NDArray[np.float64]
    raw_sigma: NDArray[np.float64]

    def between(self, start: float, end: float) -> Course:
        rows = (self.time >= start - 1e-6) & (self.time < end - 1e-6)
        return Course(self.time[rows], *(
            getattr(self, name)[rows] for name in ('truth', 'range', 'sigma', 'raw', 'raw_sigma')))

    @property
    def error(self) -> NDArray[np.float64]:
        return self.range / self.truth - 1

    @property
    def raw_error(self) -> NDArray[np.float64]:
        return self.raw / self.truth - 1

    def within(self, sigmas: float) -> float:
        known = np.isfinite(self.range)
        return (np.abs(self.range - self.truth) <= sigmas * self.sigma)[known].mean()

    def jitter(self) -> float:
        return np.nanmean(np.nanstd(self.error, axis=0))


def rms(errors: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.nanmean(errors ** 2)))


def unbiased(errors: NDArray[np.float64]) -> NDArray[np.float64]:
    return errors - np.nanmean(errors, axis=0)


class Interrupted:
    """A source of keypoints of which nobody is seen for a while."""

    def __init__(self, source: KeypointSource, start_s: float, end_s: float) -> None:
        self._source, self._hidden = source, (start_s, end_s)
        self.start_clip, self.match = source.start_clip, source.match

    def people(self, frame: TrueFrame) -> People:
        people = self._source.people(frame)
        if frame.time_s is None or not self._hidden[0] <= frame.time_s < self._hidden[1]:
            return people
        return People(people.keypoints[:0], people.track_ids[:0], convention=people.convention)


def course_of(clip: tuple[TrueFrame, ...], source: KeypointSource) -> Course:
    """Return what the filter makes of a sequence."""
    evaluation = Evaluation(source, make_estimator('skeleton'), follow=FilterOptions())
    rows: dict[tuple[float, int | str], tuple[float, ...]] = {}
    for samples in evaluation.run([clip]):
        for each in samples:
            if each.person is not None and each.time_s is not None:
                rows[each.time_s, each.person] = tuple(
                    np.nan if value is None else value for value in (
                        each.range_true, each.range, each.range_sigma, each.range_measured,
                        each.range_sigma_measured))
    times, people = (sorted({key[part] for key in rows}, key=str if part else float)
                     for part in (0, 1))
    table = np.array([[rows.get((time, person), (np.nan,) * 5) for person in people]
                      for time in times])
    return Course(np.array(times), *np.moveaxis(table, -1, 0))


def lag_s(course: Course) -> float:
    """Return by how much the filtered ranges are behind the raw: both as a truth and b rate."""
    behind = []
    rate = np.gradient(course.truth, course.time, axis=0)
    for ranges in (course.raw, course.range):
        known = np.isfinite(ranges) & np.isfinite(rate)
        gain, shift = np.linalg.lstsq(
            np.stack([course.truth[known], rate[known]], axis=-1), ranges[known])[0]
        behind.append(-shift / gain)
    return behind[1] - behind[0]


def tell_sequences(folder: Path) -> None:
    clips = [clip for clip in read_dataset(folder).clips if len(clip) > 1]
    sources: dict[str, Callable[[], KeypointSource]] = {
        'truth': lambda: TrueKeypoints(noise_px=NOISE_PX),
        'network': lambda: NetworkKeypoints(PoseEstimator(PoseOptions()))}
    for clip in clips:
        for name, source in sources.items():
            course = course_of(clip, source())
            error, raw = course.range - course.truth, course.raw - course.truth
            print(f'{clip[0].name.split("images")[0]} {clip[0].tag} {name}, {len(clip)} frames:')
            print(f'  RMSE {rms(raw):.2f} -> {rms(error):.2f} m ({rms(error) / rms(raw):.2f}), '
                  f'about the bias {rms(unbiased(raw)):.2f} -> {rms(unbiased(error)):.2f} m '
                  f'({rms(unbiased(error)) / rms(unbiased(raw)):.2f})')
            print(f'  within 1 and 2 sigma {course.within(1):.0%} {course.within(2):.0%}, '
                  f'lag {lag_s(course):+.2f} s')
            middle = (course.time[0] + course.time[-1]) / 2
            hidden = course_of(clip, Interrupted(source(), middle, middle + HIDDEN_S))
            print(f'  hidden for {HIDDEN_S:g} s: within 2 sigma '
                  f'{hidden.between(middle, middle + HIDDEN_S).within(2):.0%} of the time')


@dataclass(frozen=True)
class Walk:
    """
    Where walkers go: range, yaw (degrees) and what is seen of them, at a time.

    `seen` is whole, legs hidden, or nobody.
    """

    seconds: float
    range_at: Callable[[float], float]
    yaw_at: Callable[[float], float] = lambda time: 0.0
    seen_at: Callable[[float], str] = lambda time: 'whole'


def walked(walk: Walk, *, rate: float = RATE, noise_px: float = NOISE_PX,
           sizes: NDArray[np.float64] | None = None) -> Course:
    """Return what the filter makes of walkers."""
    random = np.random.default_rng(0)
    if sizes is None:
        sizes = np.exp(random.normal(0, SIZE_SPREAD, WALKERS))
    aside = random.uniform(-0.3, 0.3, len(sizes))
    stage = DistanceStage(DistanceOptions())
    rows = []
    times = np.arange(round(walk.seconds * rate)) / rate
    for time in times:
        necks = np.stack([aside, np.sqrt(1 - aside ** 2), 0 * aside], -1) * walk.range_at(time)
        necks = necks[:, [0, 2, 1]]
        people = seen(necks, sizes, walk, time, random, noise_px)
        tracked = stage.measure(people, CAMERA, stamp_ns=round(time * 1e9))
        found = np.full((4, len(sizes)), np.nan)
        found[:, tracked.people.track_ids] = (
            tracked.distances.range, tracked.distances.range_sigma, tracked.measured.range,
            tracked.measured.range_sigma)
        rows.append((np.full(len(sizes), walk.range_at(time)), *found))
    return Course(times, *np.moveaxis(np.array(rows), 1, 0))


def seen(
    necks: NDArray[np.float64], sizes: NDArray[np.float64], walk: Walk, time: float,
    random: np.random.Generator, noise_px: float,
) -> People:
    """Return the walkers as they are seen."""
    bodies = np.stack([
        standing_at(neck, yaw_deg=walk.yaw_at(time), size=size)
        for neck, size in zip(necks, sizes, strict=True)])
    pixels = CAMERA.project(bodies) + random.normal(0, noise_px, (*bodies.shape[:2], 2))
    keypoints = np.concatenate([pixels, np.ones((*pixels.shape[:2], 1))], -1).astype(np.float32)
    if walk.seen_at(time) == 'legs hidden':
        keypoints[:, _LEGS] = np.nan
    count = 0 if walk.seen_at(time) == 'nobody' else len(sizes)
    return People(
        keypoints[:count], np.arange(count, dtype=np.int32), convention='mesh')


def behind_obstacle(time: float) -> str:
    if 3.0 <= time < 4.0:
        return 'nobody'
    return 'legs hidden' if 2.7 <= time < 4.3 else 'whole'


def tell_walkers() -> Iterator[str]:
    """Yield a line for each thing that is measured."""
    stand = walked(Walk(5.0, lambda time: 5.0)).between(1.0, 5.0)
    yield (f'standing at 5 m: jitter of range over 2 s '
           f'{stand.between(2, 4).jitter():.1%} (raw {np.nanstd(stand.raw_error, 0).mean():.1%}), '
           f'within 1 sigma {stand.within(1):.0%}, 2 sigma {stand.within(2):.0%}')
    one = np.ones(1)
    steady = walked(Walk(5.0, lambda time: 4 + 1.5 * time), noise_px=0.0, sizes=one)
    lag = (steady.raw - steady.range)[15:] / 1.5
    yield f'walking at 1.5 m/s: lag at most {np.abs(lag).max():.2f} s after the first second'
    walk = walked(Walk(6.0, lambda time: 4 + 1.2 * time, lambda time: 180.0))
    yield (f'walking away: RMSE {rms(walk.raw_error):.1%} -> {rms(walk.error):.1%}, about each '
           f"person's bias {rms(unbiased(walk.raw_error)):.1%} -> "
           f'{rms(unbiased(walk.error)):.1%}, within 1 sigma {walk.within(1):.0%}')
    appear = walked(Walk(1.0, lambda time: 6.0))
    stop = walked(Walk(6.0, lambda time: 10 - 1.5 * min(time, 3.0)))
    yield (f'within 2 sigma: appearing {appear.within(2):.0%}, walking '
           f'{stop.between(1, 3).within(2):.0%}, in the second after a stop from 1.5 m/s '
           f'{stop.between(3, 4).within(2):.0%}')
    sharp = walked(
        Walk(6.0, lambda time: 10 - 1.5 * min(time, 3.0)), noise_px=0.0, sizes=one)
    over = np.abs(sharp.range - sharp.raw)[45:] / sharp.sigma[45:]
    yield f'overshoot of that stop without noise: {over.max():.1f} sigma'
    turn = walked(Walk(
        9.0, lambda time: 12 - 0.8 * time, lambda time: 90.0 * (3 <= time < 6)))
    yield (f'turned by 90 degrees while walking: error {rms(turn.between(3, 6).error):.1%}, '
           f'facing {rms(turn.between(1, 3).error):.1%}, '
           f'raw {rms(turn.between(3, 6).raw_error):.1%} and '
           f'{rms(turn.between(1, 3).raw_error):.1%}')
    half = walked(Walk(8.0, lambda time: 8 - 0.7 * time,
                       seen_at=lambda time: 'legs hidden' if time >= 3 else 'whole'))
    yield (f'legs hidden for 5 s while walking: error {rms(half.between(3, 8).error):.1%}, '
           f'whole before {rms(half.between(1, 3).error):.1%}, '
           f'raw {rms(half.between(3, 8).raw_error):.1%}')
    gone = walked(Walk(6.0, lambda time: 11 - 1.3 * time, seen_at=behind_obstacle))
    yield (f'hidden for 1 s behind an obstacle: within 2 sigma '
           f'{gone.between(3, 4).within(2):.0%} of the time, before '
           f'{gone.between(1, 2.7).within(2):.0%}')
    slow, fast = (walked(Walk(5.0, lambda time: 4 + 1.2 * time), rate=rate)
                  for rate in (5.0, 30.0))
    apart = slow.range[-1] - fast.range[-6]
    yield (f'5 and 30 frames a second after 4.8 s: {rms(apart / fast.range[-6]):.1%} apart, sigma '
           f'{np.mean(slow.sigma[-1] / slow.range[-1]):.1%} and '
           f'{np.mean(fast.sigma[-6] / fast.range[-6]):.1%}')


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('folder', type=Path, nargs='?', metavar='FOLDER')
    folder = parser.parse_args().folder
    if folder:
        tell_sequences(folder)
    for line in tell_walkers():
        print(line)


if __name__ == '__main__':
    main()
