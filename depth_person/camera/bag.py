"""Reads rosbags, in folders or single files, whole or torn."""
from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
import logging
from pathlib import Path
from typing import Any

from rosbags.interfaces import (
    Connection,
    ConnectionExtRosbag2,
    MessageDefinition,
    MessageDefinitionFormat,
    Qos,
)
import zstandard

from depth_person.camera.bag_files import BagFile, Record, WholeBag
from depth_person.camera.bag_open import open_file, storage_files
from depth_person.camera.bag_types import jazzy_types, types_for
from depth_person.closing import Closing
from depth_person.errors import DepthPersonError

__all__ = ['BagReader', 'Topic', 'jazzy_types']

LOG = logging.getLogger(__name__)
_NO_DEFINITION = MessageDefinition(MessageDefinitionFormat.NONE, '')
#: A message that was compressed by itself; CDR never begins so.
_ZSTD_MAGIC = b'\x28\xb5\x2f\xfd'


@dataclass(frozen=True)
class Topic:
    """
    One topic of a bag.

    :ivar count: messages in the bag; 0 where a torn bag does not say.
    :ivar qos: profiles of its publishers, as far as they were recorded.
    :ivar definition: of the type, as far as it was recorded.
    :ivar digest: of the type; empty where it was not recorded.
    """

    name: str
    msgtype: str
    count: int = 0
    qos: tuple[Qos, ...] = ()
    definition: MessageDefinition = _NO_DEFINITION
    digest: str = ''

    @property
    def has_definition(self) -> bool:
        """Whether the type's definition was recorded."""
        return self.definition.format != MessageDefinitionFormat.NONE


class BagReader(Closing):
    """
    A rosbag opened for reading: a folder of ROS 2, or a single .mcap, .db3 or ROS 1 .bag file.

    A torn bag gives the messages that can be read, after which `damage` says what is wrong.

    :ivar topics: by name.
    :ivar types: of their messages, as far as they are known.
    :ivar undecodable: by topic, how many messages could not be decoded and were left out.
    :raises DepthPersonError: when there is no readable bag at the path.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self.undecodable: Counter[str] = Counter()
        self._faults: list[str] = []
        self._files = self._open()
        self.types = types_for(
            connection for file in self._files for connection in file.connections)
        self.topics = self._list_topics()

    @property
    def damage(self) -> str | None:
        """What of the bag could not be read; complete when reading has ended."""
        return '; '.join([*self._faults, *filter(None, (f.damage for f in self._files))]) or None

    def topics_of_type(self, *msgtypes: str) -> list[str]:
        """Return the names of the topics that have one of these types."""
        return [topic.name for topic in self.topics.values() if topic.msgtype in msgtypes]

    def messages(self, topics: Collection[str] | None = None) -> Iterator[tuple[str, int, Any]]:
        """
        Yield topic, time of recording (ns) and message, in the order of recording.

        Messages that cannot be decoded are left out and counted in `undecodable`.

        :param topics: names; None for all.
        """
        for connection, stamp_ns, raw in self._records(topics):
            message = self.decode(connection.topic, raw)
            if message is not None:
                yield connection.topic, stamp_ns, message

    def decode(self, topic: str, raw: bytes) -> Any | None:
        """Return a message decoded; None, and counted in `undecodable`, if it cannot be."""
        try:
            return self.types.deserialize_cdr(raw, self.topics[topic].msgtype)
        except Exception as error:  # what a generated deserialiser stumbles over has no type
            self._note_undecodable(topic, error)
            return None

    def raw_messages(
        self, topics: Collection[str] | None = None,
    ) -> Iterator[tuple[str, int, bytes]]:
        """Yield as messages() does, but the serialised messages (CDR)."""
        for connection, stamp_ns, raw in self._records(topics):
            yield connection.topic, stamp_ns, raw

    def close(self) -> None:
        """Close the files; a second call does nothing."""
        for file in self._files:
            if file.damage:
                self._faults.append(file.damage)
            file.close()
        self._files = []

    def _records(self, topics: Collection[str] | None) -> Iterator[Record]:
        for file in self._files:
            wanted = [
                connection for connection in file.connections
                if (topics is None or connection.topic in topics)
                and connection.msgtype == self.topics[connection.topic].msgtype]
            for connection, stamp_ns, raw in file.messages(wanted):
                if raw[:4] == _ZSTD_MAGIC:  # the metadata that would have said so is missing
                    try:
                        raw = zstandard.decompress(raw)
                    except zstandard.ZstdError as error:
                        self._note_undecodable(connection.topic, error)
                        continue
                yield connection, stamp_ns, raw

    def _open(self) -> list[BagFile]:
        """Open the bag's files, the torn ones too."""
        try:
            if not self.path.exists():
                raise DepthPersonError(f'there is no bag at {self.path}')
            return self._open_folder() if self.path.is_dir() else [open_file(self.path)]
        except OSError as error:  # such as a folder that may not be looked into
            raise DepthPersonError(f'bag {self.path} cannot be read: {error}') from error

    def _open_folder(self) -> list[BagFile]:
        if (self.path / 'metadata.yaml').exists():
            try:
                return [WholeBag(self.path)]
            except Exception as error:  # of any type: rosbags parses what may be anything
                self._faults.append(f'{self.path} is damaged: {str(error).rstrip(".")}')
        paths = storage_files(self.path)
        if not self._faults and len(paths) > 1:
            LOG.warning('%s has no metadata.yaml; its files are read in name order', self.path)
        files: list[BagFile] = []
        for path in paths:
            try:
                files.append(open_file(path))
            except DepthPersonError as error:
                self._faults.append(str(error))
        if not files:
            raise DepthPersonError(
                '; '.join(self._faults) or
                f'{self.path} is no rosbag: it holds no metadata.yaml and no .mcap or .db3 file')
        return files

    def _list_topics(self) -> dict[str, Topic]:
        topics: dict[str, Topic] = {}
        for file in self._files:
            for connection in file.connections:
                found = _topic(connection)
                known = topics.setdefault(found.name, found)
                if known is found:
                    continue
                if known.msgtype == found.msgtype:
                    topics[found.name] = replace(known, count=known.count + found.count)
                else:
                    self._faults.append(
                        f'{self.path} holds {found.msgtype} on {found.name}, too, which is of '
                        f'type {known.msgtype}; only that is read')
        return topics

    def _note_undecodable(self, topic: str, error: Exception) -> None:
        self.undecodable[topic] += 1
        if self.undecodable[topic] == 1:
            LOG.warning('%s: a message on %s is no %s (%s); it and others like it are left out',
                        self.path, topic, self.topics[topic].msgtype, error)


def _topic(connection: Connection) -> Topic:
    extra = connection.ext
    qos = extra.offered_qos_profiles if isinstance(extra, ConnectionExtRosbag2) else ()
    return Topic(
        connection.topic, connection.msgtype, connection.msgcount, tuple(qos), connection.msgdef,
        connection.digest)
