"""The people whom a bag of results tells of."""
from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depth_person.camera.bag import BagReader
from depth_person.camera.message_fields import stamp_ns
from depth_person.errors import DepthPersonError
from depth_person.replay.clouds import CLOUD, cloud_points, column

#: The end of the name of the topic with the results, whatever its namespace.
PEOPLE = 'person_depth/people'
#: What a cloud must hold to be one of results.
NEEDED = ('x', 'y', 'z', 'range', 'range_sigma', 'track_id')

_Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PersonRows:
    """
    One row for each person of each frame.

    :ivar frame: (n,) index of the frame.
    :ivar track_id: (n,).
    :ivar position: (n, 3) the neck in the camera optical frame, metres; NaN for none.
    :ivar range: (n,) metres; NaN for none.
    :ivar range_sigma: (n,) one standard deviation of range, metres; NaN for none.
    :ivar range_measured: (n,) what the frame alone says, unfiltered; NaN for none.
    :ivar range_sigma_measured: (n,) its standard deviation.
    :ivar predicted: (n,) whether the person is not seen in this frame.
    """

    frame: NDArray[np.intp]
    track_id: NDArray[np.int64]
    position: _Array
    range: _Array
    range_sigma: _Array
    range_measured: _Array
    range_sigma_measured: _Array
    predicted: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.frame)

    @classmethod
    def of_points(cls, points: NDArray[np.void], frame: int) -> PersonRows:
        """Return the people of one frame's cloud."""
        def floats(name: str) -> _Array:
            return column(points, name).astype(np.float64)

        known = np.isfinite(floats('range')) & (floats('range') > 0)
        return cls(
            frame=np.full(len(points), frame, np.intp),
            track_id=points['track_id'].astype(np.int64),
            position=np.where(
                known[:, None], np.stack([floats(axis) for axis in 'xyz'], axis=-1), np.nan),
            range=np.where(known, floats('range'), np.nan),
            range_sigma=np.where(known, floats('range_sigma'), np.nan),
            range_measured=floats('range_measured'),
            range_sigma_measured=floats('range_sigma_measured'),
            predicted=column(points, 'predicted', missing=0) != 0)

    @classmethod
    def joined(cls, parts: Sequence[PersonRows]) -> PersonRows:
        """Return the rows of several, one after the other."""
        parts = parts or [cls.of_points(np.zeros(0, [(name, 'f4') for name in NEEDED]), 0)]
        return cls(**{
            field.name: np.concatenate([getattr(part, field.name) for part in parts])
            for field in fields(cls)})

    def take(self, rows: NDArray[Any]) -> PersonRows:
        """Return these rows, by index or by mask."""
        return PersonRows(**{
            field.name: getattr(self, field.name)[rows] for field in fields(self)})


@dataclass(frozen=True, eq=False)
class Results:
    """
    Who was how far away in a recording.

    :ivar name: of what they were read from, for messages.
    :ivar stamps_ns: (f,) of the frames, rising, those without people too.
    :ivar recorded_ns: (f,) when the results were recorded.
    :ivar people: of all frames, in their order.
    :ivar faults: what could not be used, and why.
    """

    name: str
    stamps_ns: NDArray[np.int64]
    recorded_ns: NDArray[np.int64]
    people: PersonRows
    faults: tuple[str, ...] = ()

    @property
    def tracks(self) -> list[int]:
        """The track ids, in order of their first appearance."""
        return list(dict.fromkeys(self.people.track_id.tolist()))

    @property
    def times_s(self) -> _Array:
        """(n,) when each row's frame was, seconds after the first frame."""
        start = self.stamps_ns[:1]
        return (self.stamps_ns[self.people.frame] - start).astype(np.float64) * 1e-9


def read_results(path: Path, *, topic: str | None = None) -> Results:
    """
    Return the results that a bag holds.

    Of a damaged bag what can be read is returned, with the rest named in its faults; so
    are stamps of zero (which belong to no image), those that come twice (the first counts), and
    those that go back.

    :param topic: of the results; None for the only one named person_depth/people.
    :raises DepthPersonError: when there is no such bag, or it holds no results.
    """
    with BagReader(path) as bag:
        topic = choose_topic(bag, topic)
        frames: dict[int, tuple[int, PersonRows]] = {}
        faults: Counter[str] = Counter()
        newest_ns = 0
        for _, recorded_ns, message in bag.messages([topic]):
            stamp = stamp_ns(message.header)
            faults['whose stamp lies before the one ahead of it'] += stamp < newest_ns
            newest_ns = stamp
            if not stamp or stamp in frames:
                faults['whose stamp came before, left out' if stamp
                       else 'without a stamp, left out'] += 1
                continue
            try:
                points = _points(message)
                frames[stamp] = recorded_ns, PersonRows.of_points(points, 0)
                faults['with a range that is not positive, taken as none'] += bool(
                    (points['range'] <= 0).any())
            except DepthPersonError as error:
                faults[f'left out: {error}'] += 1
        faults['that cannot be decoded, left out'] += bag.undecodable[topic]
        complaints = [f'{topic}: {count} messages {fault}'
                      for fault, count in faults.items() if count]
        if bag.damage:
            complaints.insert(0, bag.damage)
    if not frames:
        raise DepthPersonError(
            f'{path} holds no usable result on {topic}; '
            f'{"; ".join(complaints) or "make one with: depth_person process"}')
    return gather(str(path), frames, tuple(complaints))


def gather(
    name: str, frames: dict[int, tuple[int, PersonRows]], faults: tuple[str, ...] = (),
) -> Results:
    """
    Return the results of single frames in the order of their stamps.

    :param frames: when recorded (ns), and the people, by stamp (ns).
    """
    stamps = sorted(frames)
    return Results(
        name, np.array(stamps, np.int64),
        np.array([frames[stamp][0] for stamp in stamps], np.int64),
        PersonRows.joined([
            _in_frame(frames[stamp][1], index) for index, stamp in enumerate(stamps)]), faults)


def choose_topic(bag: BagReader, wanted: str | None) -> str:
    """
    Return the topic of a bag's results.

    :raises DepthPersonError: when there is none, or several to choose from.
    """
    clouds = bag.topics_of_type(CLOUD)
    if wanted is not None:
        name = '/' + wanted.lstrip('/')
        if name not in bag.topics:
            raise DepthPersonError(
                f'{bag.path} has no topic {name}; it has {", ".join(bag.topics) or "none"}')
        if name not in clouds:
            raise DepthPersonError(
                f'{name} of {bag.path} is of type {bag.topics[name].msgtype}, not {CLOUD}')
        return name
    found = [name for name in clouds if name == PEOPLE or name.endswith('/' + PEOPLE)]
    if not found:
        raise DepthPersonError(
            f'{bag.path} holds no results: no topic .../{PEOPLE} of type {CLOUD}; it has '
            f'{", ".join(bag.topics) or bag.damage or "no topics"}; '
            'make them with: depth_person process')
    if len(found) > 1:
        raise DepthPersonError(
            f'{bag.path} holds several results; choose by --topic: {", ".join(found)}')
    return found[0]


def _points(message: Any) -> NDArray[np.void]:
    points = cloud_points(message).ravel()
    missing = [name for name in NEEDED if name not in (points.dtype.names or ())]
    if missing:
        raise DepthPersonError(f'the cloud lacks {", ".join(missing)}')
    return points


def _in_frame(people: PersonRows, frame: int) -> PersonRows:
    return PersonRows(**{**vars(people), 'frame': np.full(len(people), frame, np.intp)})
