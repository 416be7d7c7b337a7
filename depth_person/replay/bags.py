"""Reads and writes rosbags."""
from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, TypeVar

from rosbags.interfaces import Connection, Qos
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer, WriterError
from rosbags.typesys.store import Typestore

from depth_person.camera.bag import BagReader, jazzy_types, Topic
from depth_person.closing import Closing
from depth_person.errors import DepthPersonError

__all__ = ['BagReader', 'BagWriter', 'Topic', 'jazzy_types']

T = TypeVar('T')


class BagWriter(Closing):
    """
    Writes a rosbag2: a folder with metadata.yaml and one chunked MCAP file.

    The messages are those of rosbags (`jazzy_types().types[...]`); their definitions are stored
    with them. Leaving the with block by Ctrl-C or an error closes the bag all the same, and what
    has been written until then is readable.

    :param path: of the folder, which must not exist yet.
    :param compress: the chunks, with zstd; images that are compressed already gain nothing.
    :param types: where the types of the messages are defined.
    :raises DepthPersonError: when the bag cannot be created or written to.
    """

    def __init__(
        self, path: str | Path, *, compress: bool = False, types: Typestore | None = None,
    ) -> None:
        self.path = Path(path)
        self._types = types or jazzy_types()
        self._connections: dict[str, Connection] = {}
        self._closed = False
        if self.path.exists():
            raise DepthPersonError(f'bag {self.path} exists already; remove it or name another')
        # Ctrl-C strikes in the main thread; a record is finished in this one.
        self._thread = ThreadPoolExecutor(1, thread_name_prefix='bag-writer')
        self._writer = Writer(
            self.path, version=Writer.VERSION_LATEST, storage_plugin=StoragePlugin.MCAP)
        if compress:
            self._writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
        self._run(self._writer.open)

    def add_topic(self, topic: str, msgtype: str, *, qos: Sequence[Qos] = ()) -> None:
        """
        Add a topic; write() adds those that are not, without a QoS profile.

        :param qos: the profiles that its publishers offer.
        """
        if msgtype not in self._types.types:
            raise DepthPersonError(f'{topic} cannot be recorded: unknown type {msgtype}')
        definition, _ = self._types.generate_msgdef(msgtype, ros_version=2)
        self.add_defined_topic(
            topic, msgtype, definition=definition, digest=self._types.hash_rihs01(msgtype),
            qos=qos)

    def add_defined_topic(
        self, topic: str, msgtype: str, *, definition: str, digest: str,
        qos: Sequence[Qos] = (),
    ) -> None:
        """
        Add a topic of a type that need not be known here; it takes serialised messages.

        :param definition: of the type, in the form of .msg or .idl files with all it refers to.
        :param digest: the RIHS01 hash of the type.
        """
        self._connections[topic] = self._run(lambda: self._writer.add_connection(
            topic, msgtype, msgdef=definition, rihs01=digest, offered_qos_profiles=qos))

    def write(self, topic: str, stamp_ns: int, message: Any) -> None:
        """
        Write one message.

        :param stamp_ns: time of recording.
        """
        msgtype = message.__msgtype__
        if topic not in self._connections:
            self.add_topic(topic, msgtype)
        connection = self._connections[topic]
        if connection.msgtype != msgtype:
            raise DepthPersonError(f'{topic} is of type {connection.msgtype}, not {msgtype}')
        self.write_raw(topic, stamp_ns, self._types.serialize_cdr(message, msgtype))

    def write_raw(self, topic: str, stamp_ns: int, data: bytes | memoryview) -> None:
        """
        Write one serialised message (CDR) to a topic that has been added.

        :param stamp_ns: time of recording.
        """
        self.write_all_raw([(topic, stamp_ns, data)])

    def write_all_raw(self, messages: Iterable[tuple[str, int, bytes | memoryview]]) -> None:
        """Write serialised messages, each with its topic and time of recording, in one go."""
        records = [(self._connections[topic], time_ns, data) for topic, time_ns, data in messages]

        def write() -> None:
            for record in records:
                self._writer.write(*record)

        self._run(write)

    def close(self) -> None:
        """Finish the bag; a second call does nothing."""
        if not self._closed:
            self._closed = True
            try:
                self._run(self._writer.close)
            finally:
                self._thread.shutdown()

    def _run(self, action: Callable[[], T]) -> T:
        """Run an action of the writer in its thread."""
        try:
            return self._thread.submit(action).result()
        except (OSError, WriterError) as error:
            raise DepthPersonError(f'bag {self.path} cannot be written: {error}') from error
