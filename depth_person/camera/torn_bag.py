"""
Rosbag files whose end is missing, as a killed recorder or a full disk leaves them.

rosbags refuses them. They are read from the front here, record by record, in the order in which
they were written.
"""
from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator
from io import BytesIO
import logging
import os
from pathlib import Path
import shutil
import sqlite3
import struct
from tempfile import TemporaryDirectory
from typing import BinaryIO

import lz4.frame
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Message, Schema
from rosbags.interfaces import (
    Connection,
    ConnectionExtRosbag2,
    MessageDefinition,
    MessageDefinitionFormat,
)
import zstandard

from depth_person.camera.bag_files import Record

LOG = logging.getLogger(__name__)
#: Bytes that are copied at a time.
_BLOCK = 1 << 22
MCAP_MAGIC = b'\x89MCAP0\r\n'
#: What the parsers raise over bytes that are no record, or no compressed chunk.
_GARBAGE = (McapError, struct.error, UnicodeDecodeError, RuntimeError, zstandard.ZstdError)


class TornMcap:
    """An MCAP file without its end, or with damage somewhere."""

    def __init__(self, path: Path) -> None:
        self._file = path.open('rb')
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, Channel] = {}
        counts: Counter[int] = Counter(message.channel_id for message in self._scan())
        self.damage: str | None = (
            f'{path} is cut off or damaged: {sum(counts.values())} messages can be read')
        self.connections = []
        for channel in self._channels.values():
            schema = self._schemas.get(channel.schema_id)
            if schema is not None:
                self.connections.append(_connection(
                    channel.id, channel.topic, schema.name, count=counts[channel.id],
                    definition=schema.data.decode(errors='replace'),
                    definition_format=schema.encoding))

    def messages(self, connections: Collection[Connection]) -> Iterator[Record]:
        """Yield the messages of some connections in the order in which they were written."""
        wanted = {connection.id: connection for connection in connections}
        for message in self._scan():
            connection = wanted.get(message.channel_id)
            if connection is not None:
                yield connection, message.log_time, message.data

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _scan(self) -> Iterator[Message]:
        """Yield every whole message, noting the schemas and channels on the way."""
        self._file.seek(len(MCAP_MAGIC))
        try:
            for opcode, body in _flat_records(self._file):
                stream = ReadDataStream(BytesIO(body))
                if opcode == Opcode.MESSAGE:
                    yield Message.read(stream, len(body))
                elif opcode == Opcode.SCHEMA:
                    schema = Schema.read(stream)
                    self._schemas[schema.id] = schema
                elif opcode == Opcode.CHANNEL:
                    channel = Channel.read(stream)
                    self._channels[channel.id] = channel
        except _GARBAGE as error:  # `damage` tells the user how far the file could be read
            LOG.info('%s ends in what is no record: %s', self._file.name, error)


def _flat_records(file: BinaryIO) -> Iterator[tuple[int, bytes]]:
    """Yield opcode and body of the records, those in chunks in the place of the chunks."""
    for opcode, body in _records(file):
        if opcode == Opcode.CHUNK:
            yield from _records(BytesIO(_unpack_chunk(body)))
        else:
            yield opcode, body


def _records(file: BinaryIO) -> Iterator[tuple[int, bytes]]:
    """Yield opcode and body of each whole record, and of a chunk also what there is of it."""
    position = file.tell()
    end = file.seek(0, os.SEEK_END)
    while position + 9 <= end:
        file.seek(position)
        opcode, length = struct.unpack('<BQ', file.read(9))
        position += 9 + length
        if opcode == 0 or (position > end and opcode != Opcode.CHUNK):
            return  # zeros are what a lost power supply leaves at the end of files
        yield opcode, file.read(min(length, end))


def _unpack_chunk(body: bytes) -> bytes:
    """Return the records in a chunk's body; of a chunk that is cut off those before the cut."""
    chunk = Chunk.read(ReadDataStream(BytesIO(body)))
    if chunk.compression == 'zstd':
        return zstandard.ZstdDecompressor().decompressobj().decompress(chunk.data)
    if chunk.compression == 'lz4':
        return lz4.frame.LZ4FrameDecompressor().decompress(chunk.data)
    return chunk.data


class TornSqlite:
    """An SQLite3 bag without its end, or with damage somewhere."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._scratch = TemporaryDirectory(prefix='depth_person-')
        whole_pages = _whole_pages(path, Path(self._scratch.name))
        self._database = sqlite3.connect(
            f'{whole_pages.absolute().as_uri()}?mode=ro&immutable=1', uri=True,
            check_same_thread=False)
        self._database.execute('PRAGMA writable_schema=ON')  # else a short file is not even opened
        self.damage: str | None = f'{path} is cut off or damaged'
        topics = self._database.execute('SELECT id, name, type FROM topics')
        self.connections = [_connection(*row) for row in topics]

    def messages(self, connections: Collection[Connection]) -> Iterator[Record]:
        """Yield the messages of some connections in the order in which they were written."""
        wanted = {connection.id: connection for connection in connections}
        try:
            rows = self._database.execute(
                'SELECT topic_id, timestamp, data FROM messages ORDER BY id')
            for topic_id, stamp_ns, data in rows:
                if topic_id in wanted:
                    yield wanted[topic_id], stamp_ns, data
        except sqlite3.DatabaseError as error:
            self.damage = f'{self._path} is cut off or damaged: {error}'

    def close(self) -> None:
        """Close the file."""
        self._database.close()
        self._scratch.cleanup()


def _whole_pages(path: Path, scratch: Path) -> Path:
    """Return the file, or a copy without its last page if that is cut and so read as zeros."""
    size = path.stat().st_size
    with path.open('rb') as file:
        page_size = int.from_bytes(file.read(18)[16:], 'big')
        page_size = 1 << 16 if page_size == 1 else page_size  # which does not fit into two bytes
        if page_size == 0 or size % page_size == 0:
            return path
        file.seek(0)
        copy = scratch / path.name
        with copy.open('wb') as target:
            shutil.copyfileobj(file, target, _BLOCK)
    os.truncate(copy, size - size % page_size)
    return copy


def _connection(
    number: int, topic: str, msgtype: str, *, count: int = 0, definition: str = '',
    definition_format: str = '',
) -> Connection:
    formats = {
        'ros2msg': MessageDefinitionFormat.MSG,
        'ros2idl': MessageDefinitionFormat.IDL,
    }
    return Connection(
        id=number, topic=topic, msgtype=msgtype,
        msgdef=MessageDefinition(
            formats.get(definition_format, MessageDefinitionFormat.NONE), definition),
        digest='', msgcount=count, ext=ConnectionExtRosbag2('cdr', []), owner=None)
