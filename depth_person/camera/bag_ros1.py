"""ROS 1 bags, read as if they had been recorded by ROS 2."""
from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from functools import partial
from pathlib import Path
from typing import cast

from rosbags.convert.converter import (
    is_same_wireformat,
    LATCH,
    migrate_bytes,
    STATIC_MSGTYPE_RENAMES,
)
from rosbags.highlevel import AnyReader
from rosbags.interfaces import (
    Connection,
    ConnectionExtRosbag1,
    ConnectionExtRosbag2,
    MessageDefinition,
    MessageDefinitionFormat,
)
from rosbags.typesys import get_types_from_msg, get_typestore, Stores

from depth_person.camera.bag_files import Record


class Ros1Bag:
    """
    A .bag file; its messages are converted to those of ROS 2 of the same name.

    Types that ROS 2 does not have keep their fields.
    """

    def __init__(self, path: Path) -> None:
        self.damage: str | None = None
        self._path = path
        self._reader = AnyReader([path])
        self._reader.open()
        self._types = get_typestore(Stores.ROS2_JAZZY)
        self._converters: dict[str, Callable[[bytes], memoryview]] = {}
        self._converted = {
            connection.id: self._convert_connection(connection)
            for connection in self._reader.connections}
        self.connections = list(self._converted.values())

    def messages(self, connections: Collection[Connection]) -> Iterator[Record]:
        """Yield the messages of some connections in the order of their times of recording."""
        wanted = {connection.id for connection in connections}
        sources = [each for each in self._reader.connections if each.id in wanted]
        if not sources:  # which rosbags takes for all
            return
        try:
            for connection, time_ns, raw in self._reader.messages(sources):
                converted = self._converters[connection.msgtype](raw)
                yield self._converted[connection.id], time_ns, bytes(converted)
        except Exception as error:  # rosbags raises whatever its parsing stumbles over
            self.damage = f'{self._path} is damaged: {str(error).rstrip(".")}'

    def close(self) -> None:
        """Close the file."""
        self._reader.close()

    def _convert_connection(self, connection: Connection) -> Connection:
        source = connection.msgtype
        target = STATIC_MSGTYPE_RENAMES.get(source, source)
        if target not in self._types.types:
            self._adopt(source, target)
        if source not in self._converters:
            self._converters[source] = self._converter(source, target)
        latching = cast(ConnectionExtRosbag1, connection.ext).latching
        definition, _ = self._types.generate_msgdef(target, ros_version=2)
        return connection._replace(
            msgtype=target, digest=self._types.hash_rihs01(target),
            msgdef=MessageDefinition(MessageDefinitionFormat.MSG, definition),
            ext=ConnectionExtRosbag2('cdr', LATCH if latching else []))

    def _adopt(self, source: str, target: str) -> None:
        """Register a type that only the bag defines, on top of ROS 2's own types."""
        definition, _ = self._reader.typestore.generate_msgdef(source, ros_version=2)
        found = get_types_from_msg(definition, target)
        self._types.register({
            name: fields for name, fields in found.items() if name not in self._types.types})

    def _converter(self, source: str, target: str) -> Callable[[bytes], memoryview]:
        own = self._reader.typestore
        if is_same_wireformat(own, self._types, source, target):
            return partial(self._types.ros1_to_cdr, typename=target)
        return partial(
            migrate_bytes, own, self._types, source, target, {}, src_is2=False, dst_is2=True)
