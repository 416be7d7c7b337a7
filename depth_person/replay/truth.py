"""True ranges beside a bag of results, from a topic or a table."""
from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depth_person.camera.bag import BagReader
from depth_person.camera.message_fields import stamp_ns
from depth_person.errors import DepthPersonError
from depth_person.replay.clouds import CLOUD, cloud_points, column
from depth_person.replay.results import gather, PersonRows, Results

#: Between truths further apart, seconds, nothing is known.
LONGEST_GAP_S = 0.5
_STAMPS = ('stamp_ns', 'stamp_s', 'time_s')
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

    :param spec: the topic, or the path of a CSV file.
    :raises DepthPersonError: when there is no such truth, or it holds none of that.
    """
    path = Path(spec)
    if path.suffix.lower() == '.csv' or path.is_file():
        stamps, points = _from_table(path, int(results.stamps_ns[0]))
    else:
        stamps, points = _from_topic(bag, '/' + spec.lstrip('/'))
    if not (np.isfinite(points['range']) & (points['range'] > 0)).all():
        raise DepthPersonError(f'{spec} holds a range that is no positive number')
    return _at(results.stamps_ns, stamps, points, spec)


def _from_topic(path: Path, topic: str) -> tuple[NDArray[np.int64], NDArray[np.void]]:
    with BagReader(path) as bag:
        if topic not in bag.topics_of_type(CLOUD):
            kind = bag.topics[topic].msgtype if topic in bag.topics else 'not in it'
            raise DepthPersonError(
                f'the truth {topic} of {path} is {kind}; give a topic of type {CLOUD}, or a .csv '
                'file')
        parts = [(stamp_ns(message.header), cloud_points(message).ravel())
                 for _, _, message in bag.messages([topic])]
    points = [_points(
        {name: column(each, name) for name in ('x', 'y', 'z', 'range')},
        column(each, 'track_id', missing=0), topic) for _, each in parts]
    if not points:
        raise DepthPersonError(f'{topic} of {path} holds no message')
    stamps = np.repeat([stamp for stamp, _ in parts], [len(each) for each in points])
    return stamps.astype(np.int64), np.concatenate(points)


def _from_table(path: Path, start_ns: int) -> tuple[NDArray[np.int64], NDArray[np.void]]:
    try:
        with path.open(newline='', encoding='utf-8') as file:
            reader = csv.DictReader(file)
            names, rows = reader.fieldnames or [], list(reader)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise DepthPersonError(f'the truth {path} cannot be read: {error}') from error
    key = next((name for name in _STAMPS if name in names), None)
    if key is None or not rows:
        raise DepthPersonError(
            f'the truth {path} has {len(rows)} rows of {", ".join(names) or "nothing"}; it needs '
            f'one of {", ".join(_STAMPS)}, and range or x, y, z')
    try:
        columns = {name: np.array([float(row[name] or 'nan') for row in rows])
                   for name in ('x', 'y', 'z', 'range') if name in names}
        ids = np.array([int(row['id']) for row in rows]) if 'id' in names else 0
        stamps = _stamps(key, [row[key] for row in rows], start_ns)
    except (TypeError, ValueError) as error:
        raise DepthPersonError(f'the truth {path} is no table of numbers: {error}') from error
    return stamps, _points(columns, np.broadcast_to(ids, len(rows)), str(path))


def _stamps(key: str, texts: list[str], start_ns: int) -> NDArray[np.int64]:
    if key == 'stamp_ns':
        return np.array([int(text) for text in texts], np.int64)
    seconds = np.array([float(text) for text in texts])
    if not np.isfinite(seconds).all():
        raise ValueError(f'{key} is not finite')
    return np.rint(seconds * _NS).astype(np.int64) + (start_ns if key == 'time_s' else 0)


def _points(columns: dict[str, _Array], ids: NDArray, where: str) -> NDArray[np.void]:
    points = np.zeros(len(ids), _POINT)
    for name in ('x', 'y', 'z', 'range', 'range_sigma'):
        points[name] = np.nan
    points['track_id'] = ids
    for name, values in columns.items():
        points[name] = values
    position = np.stack([points[axis] for axis in 'xyz'], axis=-1)
    points['range'] = np.where(
        np.isfinite(points['range']), points['range'], np.linalg.norm(position, axis=-1))
    if not np.isfinite(points['range']).all():
        raise DepthPersonError(f'{where} lacks the range, or x, y and z, of a person')
    return points


def _at(
    frames: NDArray[np.int64], stamps: NDArray[np.int64], points: NDArray[np.void], name: str,
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
        for stamp, people in zip(frames, found, strict=True)})
