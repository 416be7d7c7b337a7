"""The files of a rosbag that is whole, as rosbags reads them."""
from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Protocol

from rosbags.interfaces import Connection
from rosbags.rosbag2 import Reader

#: Connection, time of recording in nanoseconds, serialised message.
Record = tuple[Connection, int, bytes]


class BagFile(Protocol):
    """
    One file, or one folder with its metadata, that messages are read from.

    :ivar connections: one a topic and type.
    :ivar damage: what cannot be read, known at the latest when the messages have been read; None
        while nothing is amiss.
    """

    connections: list[Connection]

    @property
    def damage(self) -> str | None:
        """What cannot be read."""
        ...

    def messages(self, connections: Collection[Connection]) -> Iterator[Record]:
        """Yield the messages of some connections; ends early at damage."""
        ...

    def close(self) -> None:
        """Close the file."""
        ...


class WholeBag:
    """What rosbags reads: a folder with metadata.yaml, or one .mcap or .db3 file."""

    def __init__(self, path: Path) -> None:
        self.damage: str | None = None
        self._path = path
        self._reader = Reader(path)
        self._reader.open()
        self.connections = list(self._reader.connections)

    def messages(self, connections: Collection[Connection]) -> Iterator[Record]:
        """Yield the messages of some connections in the order of their times of recording."""
        if not connections:  # which rosbags takes for all
            return
        try:
            yield from self._reader.messages(connections)
        except Exception as error:  # rosbags raises whatever its parsing stumbles over
            self.damage = f'{self._path} is damaged: {str(error).rstrip(".")}'

    def close(self) -> None:
        """Close the file."""
        self._reader.close()
