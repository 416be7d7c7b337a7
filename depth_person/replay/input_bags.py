"""Several bags as one: what one flight left in several recordings."""
from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
import heapq
from pathlib import Path
from typing import Any
from zlib import crc32

from depth_person.camera.bag import BagReader, Topic
from depth_person.closing import Closing
from depth_person.errors import DepthPersonError


@dataclass(frozen=True)
class RawMessage:
    """
    One message of a bag, serialised.

    :ivar time_ns: of recording.
    """

    topic: str
    time_ns: int
    data: bytes


class InputBags(Closing):
    """
    The messages of one or more bags, in the order of their times of recording.

    A bag that cannot be opened or has been given before is left out, and so is a topic that an
    earlier bag has with another type; `faults` names them.

    :ivar topics: by name.
    :ivar description: the bags' names, for messages.
    :raises DepthPersonError: when no bag can be opened.
    """

    def __init__(self, paths: Sequence[str | Path]) -> None:
        self.description = ', '.join(f'bag {path}' for path in paths)
        self.topics: dict[str, Topic] = {}
        self._faults: list[str] = []
        self._readers: list[BagReader] = []
        self._owners: dict[str, list[BagReader]] = {}
        opened: set[Path] = set()
        for path in paths:
            place = Path(path).resolve()
            if opened & {place, place.parent}:
                self._faults.append(f'{path} is given twice; it is read once')
                continue
            if place in {each.parent for each in opened}:
                self._faults.append(f'{path} is left out: a part of it is given, too')
                continue
            try:
                self._readers.append(BagReader(path))
                opened.add(place)
            except DepthPersonError as error:
                self._faults.append(str(error))
        if not self._readers:
            raise DepthPersonError('; '.join(self._faults))
        for reader in self._readers:
            for topic in reader.topics.values():
                self._adopt(topic, reader)

    @property
    def faults(self) -> list[str]:
        """What could not be read; complete when reading has ended."""
        return [*self._faults, *filter(None, (reader.damage for reader in self._readers))]

    @property
    def undecodable(self) -> Counter[str]:
        """By topic, how many messages could not be decoded."""
        return sum((reader.undecodable for reader in self._readers), Counter[str]())

    def messages(self) -> Iterator[RawMessage]:
        """Yield the messages of all topics."""
        parts = [self._of(reader) for reader in self._readers]
        if len(parts) == 1:  # as recorded, even where times go back
            return parts[0]
        return heapq.merge(*parts, key=lambda message: message.time_ns)

    def first(self, topic: str) -> Any | None:
        """Return the first message of a topic that can be decoded; the others are not counted."""
        for reader in self._owners[topic]:
            counted = reader.undecodable.copy()
            found = next(reader.messages([topic]), None)
            reader.undecodable = counted
            if found is not None:
                return found[2]
        return None

    def identity(self, topic: str) -> dict[str, Any]:
        """Return what tells these bags from others: their messages, and the first of a topic."""
        first = next((data for reader in self._owners[topic]
                      for _, _, data in reader.raw_messages([topic])), b'')
        return {'messages': {name: self.count(name) for name in self.topics},
                'first_image': crc32(first)}

    def decode(self, message: RawMessage) -> Any | None:
        """Return a message decoded; None, and counted, where it cannot be."""
        return self._owners[message.topic][0].decode(message.topic, message.data)

    def definition(self, name: str) -> tuple[str, str]:
        """
        Return the definition of a topic's type, and the hash of that.

        :raises DepthPersonError: when no bag tells it.
        """
        topic = self.topics[name]
        types = self._owners[name][0].types
        if topic.msgtype not in types.types:
            raise DepthPersonError(
                f'{name}: the bag does not say what its type {topic.msgtype} is')
        if topic.has_definition and topic.digest:
            return topic.definition.data, topic.digest
        definition, _ = types.generate_msgdef(topic.msgtype, ros_version=2)
        return definition, types.hash_rihs01(topic.msgtype)

    def close(self) -> None:
        """Close the bags."""
        for reader in self._readers:
            reader.close()

    def _adopt(self, topic: Topic, reader: BagReader) -> None:
        known = self.topics.get(topic.name)
        if known is None:
            self.topics[topic.name] = topic
            self._owners[topic.name] = [reader]
        elif known.msgtype == topic.msgtype:
            self._owners[topic.name].append(reader)
        else:
            self._faults.append(
                f'{topic.name} of bag {reader.path} is of type {topic.msgtype}, not '
                f'{known.msgtype} as in the bag before it; left out')

    def count(self, name: str) -> int:
        """Return how many messages a topic has; 0 where a torn bag does not say."""
        counts = [reader.topics[name].count for reader in self._owners[name]]
        return sum(counts) if all(counts) else 0

    def _of(self, reader: BagReader) -> Iterator[RawMessage]:
        own = [name for name, owners in self._owners.items() if reader in owners]
        for topic, time_ns, data in reader.raw_messages(own):
            yield RawMessage(topic, time_ns, data)
