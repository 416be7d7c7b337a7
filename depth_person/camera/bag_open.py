"""Finds and opens the files of a rosbag, whole or torn."""
from __future__ import annotations

from collections.abc import Collection, Iterator
import logging
from pathlib import Path
import sqlite3
from tempfile import TemporaryDirectory

from rosbags.interfaces import Connection
import zstandard

from depth_person.camera.bag_files import BagFile, Record, WholeBag
from depth_person.camera.bag_ros1 import Ros1Bag
from depth_person.camera.torn_bag import MCAP_MAGIC, TornMcap, TornSqlite
from depth_person.errors import DepthPersonError

LOG = logging.getLogger(__name__)
MAGIC = {'.mcap': MCAP_MAGIC, '.db3': b'SQLite format 3\0', '.bag': b'#ROSBAG V2.0\n'}
#: What a recorder appends to the name of a file that it has compressed as a whole.
COMPRESSED = '.zstd'
_BLOCK = 1 << 20


def is_bag(path: Path) -> bool:
    """Return whether the path looks like a rosbag: by its name, or a folder's contents."""
    if path.is_dir():
        return (path / 'metadata.yaml').exists() or bool(storage_files(path))
    return _kind(path) in MAGIC


def storage_files(folder: Path) -> list[Path]:
    """Return the files of a folder that may hold messages, in the order of their numbers."""
    return sorted(
        (path for path in folder.iterdir() if _kind(path) in MAGIC),
        key=lambda path: (len(path.name), path.name))


def open_file(path: Path) -> BagFile:
    """
    Open one file, as torn when rosbags refuses it.

    :raises DepthPersonError: when nothing in it can be read.
    """
    magic = MAGIC.get(_kind(path))
    if magic is None or not path.is_file():  # a pipe would be waited for
        raise DepthPersonError(
            f'{path} is no rosbag: not a folder, nor a file named {", ".join(MAGIC)}')
    if path.suffix == COMPRESSED:
        return _PackedFile(path)
    try:
        with path.open('rb') as file:
            head = file.read(len(magic))
    except OSError as error:
        raise DepthPersonError(f'bag {path} cannot be read: {error}') from error
    if head != magic:
        fault = 'is empty' if not head else f'does not begin like an {path.suffix} file'
        raise DepthPersonError(f'bag {path} {fault}; record it again')
    try:
        return Ros1Bag(path) if path.suffix == '.bag' else WholeBag(path)
    except Exception as refusal:  # of any type: rosbags parses what may be anything
        return _open_torn(path, refusal)


def _open_torn(path: Path, refusal: Exception) -> BagFile:
    if path.suffix == '.bag':
        raise DepthPersonError(
            f'bag {path} is cut off or damaged ({refusal}); mend it with `rosbag reindex`'
        ) from refusal
    LOG.info('%s is read as torn: %s', path, refusal)
    try:
        return TornMcap(path) if path.suffix == '.mcap' else TornSqlite(path)
    except (sqlite3.DatabaseError, OSError) as error:  # a full disk, where a part is copied
        raise DepthPersonError(f'nothing in bag {path} can be read: {error}') from error


class _PackedFile:
    """A file that was compressed as a whole: read from a copy, as far as it can be unpacked."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._scratch = TemporaryDirectory(prefix='depth_person-')
        self._copy = Path(self._scratch.name, path.stem)
        try:
            _unpack(path, self._copy)
            self._file = open_file(self._copy)
        except DepthPersonError as error:
            self._scratch.cleanup()
            raise DepthPersonError(self._named(str(error))) from error
        self.connections = self._file.connections

    @property
    def damage(self) -> str | None:
        """What cannot be read."""
        return self._named(self._file.damage) if self._file.damage else None

    def messages(self, connections: Collection[Connection]) -> Iterator[Record]:
        """Yield the messages of some connections."""
        return self._file.messages(connections)

    def close(self) -> None:
        """Close and remove the copy."""
        self._file.close()
        self._scratch.cleanup()

    def _named(self, message: str) -> str:
        return message.replace(str(self._copy), str(self._path))


def _kind(path: Path) -> str:
    """Return the suffix that tells how messages are stored."""
    return Path(path.stem).suffix if path.suffix == COMPRESSED else path.suffix


def _unpack(source: Path, target: Path) -> None:
    """Unpack a compressed file as far as it goes."""
    unpacker = zstandard.ZstdDecompressor().decompressobj()
    try:
        with source.open('rb') as packed, target.open('wb') as unpacked:
            while block := packed.read(_BLOCK):
                unpacked.write(unpacker.decompress(block))
    except OSError as error:
        raise DepthPersonError(f'bag {source} cannot be read: {error}') from error
    except zstandard.ZstdError as error:  # what was unpacked is read as a torn file
        LOG.info('%s is damaged: %s', source, error)
