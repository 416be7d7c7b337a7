"""True ranges beside a bag of results, from a topic or a table."""
from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depth_person.camera.bag import BagReader
from depth_person.camera.message_fields import stamp_ns
from depth_person.errors import DepthPersonError
from depth_person.replay.clouds import CLOUD, cloud_points, column
from depth_person.replay.results import gather, PersonRows, Results
from depth_person.replay.truth_table import PLACE, read_table

#: Between truths further apart, seconds, nothing is known.
LONGEST_GAP_S = 0.5
_POINT = np.dtype([
    *((name, 'f8') for name in ('x', 'y', 'z', 'range', 'range_sigma')), ('track_id', 'i8')])
_NS = 10**9

_Array = NDArray[np.float64]


def read_truth(spec: str, results: Results, bag: Path) -> Results:
    """
    Return the truth at the stamps of results, interpolated between those that are known.

    A table has a column stamp_ns, stamp_s or time_s (seconds after the first result); range, or
    x, y and z of the neck in the camera optical frame, metres; and, for several people, id. A
    topic of the bag has clouds of the fields x, y, z or range, and, for several, track_id.

    Who has no range in a row is not known then, which the faults of what is returned count.

    :param spec: the topic, or the path of a CSV file.
    :raises DepthPersonError: when there is no such truth, it holds none of that, it tells two
        places of a person at once, or it is of another time than the results.
    """
    path = Path(spec)
    if path.suffix.lower() == '.csv' or path.is_file():
        stamps, ids, places = read_table(path, int(results.stamps_ns[0]))
        points, faults = _points(places, ids), Counter[str]()
    else:
        stamps, points, faults = _from_topic(bag, '/' + spec.lstrip('/'))
    known = ~np.isnan(points['range'])
    faults['people without a range, or x, y and z, are left out'] += int((~known).sum())
    stamps, points = stamps[known], points[known]
    if known.size and not known.any():
        raise DepthPersonError(f'the truth {spec} tells the range, or x, y and z, of nobody')
    if not (np.isfinite(points['range']) & (points['range'] > 0)).all():
        raise DepthPersonError(f'{spec} holds a range that is no positive number')
    if len(points):
        _check_times(results.stamps_ns, stamps, points, spec)
    return _at(results.stamps_ns, stamps, points, spec, tuple(
        f'the truth {spec}: {count} {fault}' for fault, count in faults.items() if count))


def _check_times(
    frames: NDArray[np.int64], stamps: NDArray[np.int64], points: NDArray[np.void], spec: str,
) -> None:
    """Raise DepthPersonError when no truth is of the frames' time, or one contradicts another."""
    if stamps.max() < frames[0] or stamps.min() > frames[-1]:
        raise DepthPersonError(
            f'the truth {spec} is of another time: from {stamps.min() / _NS:.3f} s to '
            f'{stamps.max() / _NS:.3f} s; the results are from {frames[0] / _NS:.3f} s to '
            f'{frames[-1] / _NS:.3f} s')
    order = np.lexsort((stamps, points['track_id']))
    told = points[order]
    again = (np.diff(stamps[order]) == 0) & (np.diff(told['track_id']) == 0)
    torn = again & ~np.isclose(told['range'][1:], told['range'][:-1])
    if torn.any():
        first = int(np.argmax(torn)) + 1
        raise DepthPersonError(
            f'the truth {spec} tells two ranges of person {told["track_id"][first]} at '
            f'{stamps[order][first]} ns; several people need an id each')


def _from_topic(
    path: Path, topic: str,
) -> tuple[NDArray[np.int64], NDArray[np.void], Counter[str]]:
    """Return stamps, points, and what could not be used, with its count."""
    faults: Counter[str] = Counter()
    stamps: list[int] = []
    points = [np.zeros(0, _POINT)]
    with BagReader(path) as bag:
        if topic not in bag.topics_of_type(CLOUD):
            kind = bag.topics[topic].msgtype if topic in bag.topics else 'not in it'
            raise DepthPersonError(
                f'the truth {topic} of {path} is {kind}; give a topic of type {CLOUD}, or a .csv '
                'file')
        for _, _, message in bag.messages([topic]):
            try:
                cloud = cloud_points(message).ravel()
            except DepthPersonError as error:
                faults[f'messages are left out: {error}'] += 1
                continue
            points.append(_points(
                {name: column(cloud, name) for name in PLACE},
                column(cloud, 'track_id', missing=0)))
            stamps += len(cloud) * [stamp_ns(message.header)]
        faults['messages cannot be decoded'] += bag.undecodable[topic]
    if len(points) == 1:
        raise DepthPersonError(f'{topic} of {path} holds no message that can be used')
    return np.array(stamps, np.int64), np.concatenate(points), faults


def _points(columns: dict[str, _Array], ids: NDArray) -> NDArray[np.void]:
    """Return points; of a range that is not told, the distance of the place, NaN for none."""
    points = np.zeros(len(ids), _POINT)
    for name in ('x', 'y', 'z', 'range', 'range_sigma'):
        points[name] = np.nan
    points['track_id'] = ids
    for name, values in columns.items():
        points[name] = values
    position = np.stack([points[axis] for axis in 'xyz'], axis=-1)
    points['range'] = np.where(
        np.isnan(points['range']), np.linalg.norm(position, axis=-1), points['range'])
    return points


def _at(
    frames: NDArray[np.int64], stamps: NDArray[np.int64], points: NDArray[np.void], name: str,
    faults: tuple[str, ...],
) -> Results:
    """Return the truth at the stamps of frames; nobody where it is not known."""
    found: list[list[tuple[float, ...]]] = [[] for _ in frames]
    for person in np.unique(points['track_id']):
        own = points['track_id'] == person
        times, order = np.unique(stamps[own], return_index=True)
        after = np.searchsorted(times, frames)
        later = np.minimum(after, len(times) - 1)
        exact = times[later] == frames
        between = (after > 0) & (after < len(times))
        before = np.where(exact, later, np.maximum(later - 1, 0))
        gap = times[later] - times[before]
        known = exact | (between & (gap <= LONGEST_GAP_S * _NS))
        share = (frames - times[before]) / np.maximum(gap, 1)
        values = np.stack(
            [points[own][order][field] for field in ('x', 'y', 'z', 'range')], axis=-1)
        at = values[before] + share[:, None] * (values[later] - values[before])
        for index in np.flatnonzero(known):
            found[index].append((*at[index], np.nan, person))
    return gather(name, {
        int(stamp): (int(stamp), PersonRows.of_points(np.array(people, _POINT), 0))
        for stamp, people in zip(frames, found, strict=True)}, faults)
