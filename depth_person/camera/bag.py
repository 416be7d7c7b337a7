"""Reads rosbags, in folders or single files, whole or torn."""
from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from functools import lru_cache
import logging
from pathlib import Path
import sqlite3
from types import TracebackType
from typing import Any

from rosbags.interfaces import Connection, ConnectionExtRosbag2, MessageDefinitionFormat, Qos
from rosbags.typesys import get_types_from_msg, get_typestore, Stores, TypesysError
from rosbags.typesys.store import Typestore

from depth_person.camera.bag_files import BagFile, Record, WholeBag
from depth_person.camera.torn_bag import MCAP_MAGIC, TornMcap, TornSqlite
from depth_person.errors import DepthPersonError

LOG = logging.getLogger(__name__)
MAGIC = {'.mcap': MCAP_MAGIC, '.db3': b'SQLite format 3\0'}


@dataclass(frozen=True)
class Topic:
    """
    One topic of a bag.

    :ivar count: messages in the bag; 0 where a torn bag does not say.
    :ivar qos: profiles of its publishers, as far as they were recorded.
    """

    name: str
    msgtype: str
    count: int = 0
    qos: tuple[Qos, ...] = ()


@lru_cache(maxsize=1)
def jazzy_types() -> Typestore:
    """Return the message types of ROS 2 Jazzy."""
    return get_typestore(Stores.ROS2_JAZZY)


def is_bag(path: Path) -> bool:
    """Return whether the path looks like a rosbag: by its name, or a folder's contents."""
    if path.is_dir():
        return (path / 'metadata.yaml').exists() or bool(_storage_files(path))
    return path.suffix in MAGIC


class BagReader:
    """
    A rosbag2 opened for reading: a folder, or a single .mcap or .db3 file.

    A torn bag gives the messages that can be read, after which `damage` says what is wrong.

    :ivar topics: by name.
    :ivar undecodable: by topic, how many messages could not be decoded and were left out.
    :raises DepthPersonError: when there is no readable bag at the path.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self.undecodable: Counter[str] = Counter()
        self._faults: list[str] = []
        self._files = self._open()
        self._types = _types_for(
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
            try:
                message = self._types.deserialize_cdr(raw, connection.msgtype)
            except Exception as error:  # what a generated deserialiser stumbles over has no type
                self._note_undecodable(connection, error)
                continue
            yield connection.topic, stamp_ns, message

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

    def __enter__(self) -> BagReader:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def _records(self, topics: Collection[str] | None) -> Iterator[Record]:
        for file in self._files:
            yield from file.messages([
                connection for connection in file.connections
                if topics is None or connection.topic in topics])

    def _open(self) -> list[BagFile]:
        """Open the bag's files, the torn ones too."""
        if not self.path.exists():
            raise DepthPersonError(f'there is no bag at {self.path}')
        if self.path.is_file():
            return [_open_file(self.path)]
        if (self.path / 'metadata.yaml').exists():
            try:
                return [WholeBag(self.path)]
            except Exception as error:  # of any type: rosbags parses what may be anything
                self._faults.append(f'{self.path} is damaged: {str(error).rstrip(".")}')
        else:
            LOG.warning('%s has no metadata.yaml; its files are read in name order', self.path)
        files: list[BagFile] = []
        for path in _storage_files(self.path):
            try:
                files.append(_open_file(path))
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
                count = connection.msgcount
                if connection.topic in topics:
                    count += topics[connection.topic].count
                extra = connection.ext
                qos = (tuple(extra.offered_qos_profiles)
                       if isinstance(extra, ConnectionExtRosbag2) else ())
                topics[connection.topic] = Topic(
                    connection.topic, connection.msgtype, count, qos)
        return topics

    def _note_undecodable(self, connection: Connection, error: Exception) -> None:
        self.undecodable[connection.topic] += 1
        if self.undecodable[connection.topic] == 1:
            LOG.warning('%s: a message on %s is no %s (%s); it and others like it are left out',
                        self.path, connection.topic, connection.msgtype, error)


def _storage_files(folder: Path) -> list[Path]:
    return sorted(path for path in folder.iterdir() if path.suffix in MAGIC)


def _open_file(path: Path) -> BagFile:
    """Open one file, as torn when rosbags refuses it."""
    magic = MAGIC.get(path.suffix)
    if magic is None:
        raise DepthPersonError(f'{path} is no rosbag: not a folder, nor an .mcap or .db3 file')
    try:
        with path.open('rb') as file:
            head = file.read(len(magic))
    except OSError as error:
        raise DepthPersonError(f'bag {path} cannot be read: {error}') from error
    if head != magic:
        fault = 'is empty' if not head else f'does not begin like an {path.suffix} file'
        raise DepthPersonError(f'bag {path} {fault}; record it again')
    try:
        return WholeBag(path)
    except Exception as refusal:  # of any type: rosbags parses what may be anything
        LOG.info('%s is read as torn: %s', path, refusal)
    try:
        return TornMcap(path) if path.suffix == '.mcap' else TornSqlite(path)
    except sqlite3.DatabaseError as error:
        raise DepthPersonError(f'nothing in bag {path} can be read: {error}') from error


def _types_for(connections: Iterable[Connection]) -> Typestore:
    """Return Jazzy's message types, with those added that only the bag defines."""
    store = get_typestore(Stores.ROS2_JAZZY)
    for connection in connections:
        definition = connection.msgdef
        if connection.msgtype in store.types or definition.format != MessageDefinitionFormat.MSG:
            continue
        try:
            found = get_types_from_msg(definition.data, connection.msgtype)
            store.register({name: fields for name, fields in found.items()
                            if name not in store.types})
        except TypesysError as error:
            LOG.warning('the definition of %s cannot be parsed: %s', connection.msgtype, error)
    return store
