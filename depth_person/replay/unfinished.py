"""A written bag that is not finished: what it was made with, and how it goes on."""
from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
import json
from pathlib import Path
import shutil
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depth_person.camera.bag import BagReader
from depth_person.camera.frame import Frame
from depth_person.camera.message_fields import stamp_ns
from depth_person.closing import Closing
from depth_person.errors import DepthPersonError
from depth_person.files import write_text
from depth_person.replay.clouds import cloud_points

#: Lies in the folder of a bag of results.
_RECORD = 'process.json'
#: Ends the name of the bag that a run goes on from.
_BEFORE = '.before'


@dataclass(frozen=True)
class RunRecord:
    """
    What a bag of results was made with, kept beside it.

    :ivar settings: everything that decides what the results are.
    :ivar finished: whether the end of the bags was reached.
    :ivar faults: what could not be read or used.
    :raises TypeError: when what was read as a record is none.
    """

    settings: Mapping[str, Any]
    finished: bool = False
    faults: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        if not (isinstance(self.settings, Mapping) and isinstance(self.finished, bool)
                and isinstance(self.faults, list)
                and all(isinstance(fault, str) for fault in self.faults)):
            raise TypeError('settings, finished or faults are of another type')

    @classmethod
    def read(cls, bag: Path) -> RunRecord:
        """Return the record of a bag; raise DepthPersonError where there is none."""
        try:
            return cls(**json.loads((bag / _RECORD).read_text(encoding='utf-8')))
        except FileNotFoundError as error:  # then it is not overwritten either
            raise DepthPersonError(
                f'{bag} cannot be gone on with, since it has no {_RECORD}; give another name, or '
                'remove it') from error
        except (OSError, ValueError, TypeError) as error:
            raise DepthPersonError(
                f'{bag} cannot be gone on with, since its {_RECORD} cannot be read; give another '
                'name, or --overwrite') from error

    def write(self, bag: Path) -> None:
        """Put the record beside the messages of a bag."""
        write_text(bag / _RECORD, json.dumps(asdict(self), indent=1))

    def check(self, settings: Mapping[str, Any], bag: Path) -> None:
        """Raise DepthPersonError when other settings are asked for than those of this record."""
        wanted, begun = _flat(json.loads(json.dumps(settings))), _flat(self.settings)
        differing = sorted(
            name for name in {*wanted, *begun} if wanted.get(name) != begun.get(name))
        if differing:
            raise DepthPersonError(
                f'{bag} was begun with another {", ".join(differing)}; go on with the same, give '
                'another name, or --overwrite')


class RecordedPeople(Closing):
    """
    The keypoints and track ids of a bag of results, frame by frame.

    :param topic: of the keypoints; None knows none.
    :ivar total: how many frames there are.
    """

    def __init__(self, bag: Path | None, topic: str) -> None:
        self._reader = BagReader(bag) if bag is not None else None
        known = self._reader is not None and topic in self._reader.topics
        self.total = self._reader.topics[topic].count if self._reader and known else 0
        self._clouds: Iterator[tuple[str, int, Any]] = (
            self._reader.messages([topic]) if self._reader and known else iter(()))
        self._bag = bag

    def people(self, frame: Frame) -> tuple[NDArray[np.float32], NDArray[np.int32]] | None:
        """
        Return (n, 18, 3) keypoints and (n,) track ids of the next frame; None if not known.

        :raises DepthPersonError: when the bag goes on with another frame.
        """
        _, _, message = next(self._clouds, (None, 0, None))
        if message is None:
            return None
        if (stamp_ns(message.header), message.header.frame_id) != (frame.stamp_ns, frame.frame_id):
            raise DepthPersonError(
                f'{self._bag} was made from other bags: it goes on at '
                f'{stamp_ns(message.header)} ns instead of {frame.stamp_ns} ns; give another '
                'name, or --overwrite')
        points = cloud_points(message)
        keypoints = np.stack([points[name] for name in ('u', 'v', 'score')], axis=-1)
        return keypoints, points['track_id'][:, 0].astype(np.int32)

    def close(self) -> None:
        """Close the bag."""
        if self._reader is not None:
            self._reader.close()


def begin_anew(path: Path) -> None:
    """Remove a bag, and what is left of one; raise DepthPersonError when it holds more."""
    for each in (path, _before(path)):
        if not each.exists():
            continue
        own = (_RECORD, 'metadata.yaml', f'{path.name}.mcap')
        if not each.is_dir() or any(file.name not in own for file in each.iterdir()):
            raise DepthPersonError(f'{each} is no bag of results; it is not overwritten')
        shutil.rmtree(each)


def set_aside(path: Path, settings: Mapping[str, Any], topic: str) -> Path | None:
    """
    Move an unfinished bag out of the way of the one that goes on from it.

    :param topic: of the keypoints.
    :returns: the bag that was moved; None where there is nothing to go on from.
    :raises DepthPersonError: when it was begun with other settings.
    """
    before = _before(path)
    found = [each for each in (path, before) if each.is_dir()]
    for each in found:
        RunRecord.read(each).check(settings, each)
    frames = {each: count for each in found if (count := _frames(each, topic))}
    best = max(frames, key=frames.__getitem__, default=None)
    for each in found:
        if each != best:
            shutil.rmtree(each)
    if best == path:
        path.rename(before)
    return before if best is not None else None


def keep_better(path: Path, before: Path, topic: str) -> None:
    """Remove whichever of two unfinished bags has fewer frames; the other gets the name."""
    if path.is_dir() and _frames(path, topic) >= _frames(before, topic):
        shutil.rmtree(before)
        return
    if path.is_dir():
        shutil.rmtree(path)
    before.rename(path)


def _flat(settings: Mapping[str, Any], prefix: str = '') -> dict[str, Any]:
    """Return nested settings by their names, joined by dots."""
    flat: dict[str, Any] = {}
    for name, value in settings.items():
        flat.update(_flat(value, f'{prefix}{name}.') if isinstance(value, dict)
                    else {prefix + name: value})
    return flat


def _before(path: Path) -> Path:
    return path.with_name(path.name + _BEFORE)


def _frames(bag: Path, topic: str) -> int:
    try:
        with RecordedPeople(bag, topic) as recorded:
            return recorded.total
    except DepthPersonError:  # a bag that ends in its first bytes
        return 0
