"""Serialises messages so that their bytes depend on nothing but the messages."""
from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import cache
from itertools import chain, groupby
from operator import attrgetter
import struct
from typing import Any, NamedTuple

from rosbags.interfaces import Nodetype
from rosbags.typesys.store import Typestore

#: Plain CDR, little endian; fields are aligned from its end.
_HEADER = b'\x00\x01\x00\x00'
_LONGEST = 8
#: What struct calls the types of numbers.
_CODES = {
    'bool': '?', 'octet': 'B', 'byte': 'B', 'char': 'B', 'int8': 'b', 'uint8': 'B',
    'int16': 'h', 'uint16': 'H', 'int32': 'i', 'uint32': 'I', 'float32': 'f', 'int64': 'q',
    'uint64': 'Q', 'float64': 'd'}

#: Appends the bytes of a message, or of a part of one.
Write = Callable[[bytearray, Any], None]


class Serializer:
    """
    Writes messages, of rclpy or of rosbags, as CDR with zeros in the gaps between fields.

    Fast CDR leaves in the gaps whatever the memory held before, and rclpy takes three times as
    long; what rosbags has for this does not take the arrays of rclpy.
    """

    def __init__(self, types: Typestore) -> None:
        self._types = types
        self._writers: dict[str, Write] = {}

    def serialize(self, message: Any, msgtype: str) -> bytes:
        """Return the bytes of a message."""
        if msgtype not in self._writers:
            self._writers[msgtype] = self._writer(msgtype)
        data = bytearray(_HEADER)
        self._writers[msgtype](data, message)
        return bytes(data)

    def _writer(self, msgtype: str) -> Write:
        """Return what writes a message of this type, numbers in a row in one go."""
        parts: list[Write] = []
        for numbers, group in groupby(self._fields(msgtype), lambda field: field.code != ''):
            fields = [*group]
            parts += [_numbers(fields)] if numbers else map(self._part, fields)

        def write(data: bytearray, message: Any) -> None:
            for part in parts:
                part(data, message)
        return write

    def _fields(self, msgtype: str, prefix: str = '') -> Iterator[_Field]:
        """Yield the fields of a type, and in their place those of the messages among them."""
        fields: Iterable[tuple[str, tuple[Nodetype, Any]]] = self._types.fielddefs[msgtype][1]
        for name, (kind, detail) in fields:
            if kind == Nodetype.NAME:
                yield from self._fields(detail, f'{prefix}{name}.')
            else:
                yield _Field(prefix + name, kind, detail)

    def _part(self, field: _Field) -> Write:
        """Return what writes a text or a list."""
        if field.kind == Nodetype.BASE:
            return _text(field.path)
        return _list(
            field.path, self._items(_Field('', *field.detail[0])),
            counted=field.kind == Nodetype.SEQUENCE)

    def _items(self, item: _Field) -> Write:
        """Return what writes all items of a list."""
        if item.code:
            return _numbers_of_array(item.code)
        if item.kind == Nodetype.BASE:
            return _each(_append_text)
        fields = [*self._fields(item.detail)]
        codes = {field.code for field in fields}
        if len(fields) > 1 and len(codes) == 1 and codes != {''}:
            return _numbers_of_each(fields)
        return _each(self._writer(item.detail))


class _Field(NamedTuple):
    """A field as rosbags defines it; its path leads from the message to it."""

    path: str
    kind: Nodetype
    detail: Any

    @property
    def code(self) -> str:
        """What struct calls its type; empty if it is no number."""
        return _CODES.get(self.detail[0], '') if self.kind == Nodetype.BASE else ''


@cache
def _packers(codes: str) -> list[Callable[..., bytes]]:
    """Return what packs numbers in a row, by how long the data before them is, modulo _LONGEST."""
    return [
        struct.Struct(_aligned(codes, length - len(_HEADER))).pack for length in range(_LONGEST)]


def _aligned(codes: str, position: int) -> str:
    """Return the format of numbers that begin at a position, each aligned to its size."""
    form = '<'
    for code in codes:
        size = struct.calcsize('<' + code)
        gap = -position % size
        form += gap * 'x' + code
        position += gap + size
    return form


def _numbers(fields: list[_Field]) -> Write:
    """Return what writes numbers in a row."""
    packers = _packers(''.join(field.code for field in fields))
    get = attrgetter(*(field.path for field in fields))

    def write(data: bytearray, message: Any) -> None:
        data += packers[len(data) % _LONGEST](*get(message))

    def write_one(data: bytearray, message: Any) -> None:
        data += packers[len(data) % _LONGEST](get(message))
    return write if len(fields) > 1 else write_one


_count = _packers('I')


def _append_text(data: bytearray, text: str) -> None:
    encoded = text.encode() + b'\x00'
    data += _count[len(data) % _LONGEST](len(encoded)) + encoded


def _text(path: str) -> Write:
    get = attrgetter(path)
    return lambda data, message: _append_text(data, get(message))


def _list(path: str, write_items: Write, *, counted: bool) -> Write:
    """Return what writes a list, after the number of its items where that is told."""
    get = attrgetter(path)

    def write(data: bytearray, message: Any) -> None:
        items = get(message)
        if counted:
            data += _count[len(data) % _LONGEST](len(items))
        if len(items):
            write_items(data, items)
    return write


def _each(write_item: Write) -> Write:
    def write(data: bytearray, items: Any) -> None:
        for item in items:
            write_item(data, item)
    return write


def _numbers_of_array(code: str) -> Write:
    size = struct.calcsize('<' + code)

    def write(data: bytearray, numbers: Any) -> None:
        data += bytes((len(_HEADER) - len(data)) % size)
        data += memoryview(numbers).cast('B')
    return write


def _numbers_of_each(fields: list[_Field]) -> Write:
    """Return what writes messages of nothing but numbers of one type, all in one go."""
    get = attrgetter(*(field.path for field in fields))
    code, size = fields[0].code, struct.calcsize('<' + fields[0].code)

    def write(data: bytearray, messages: Any) -> None:
        numbers = [*chain.from_iterable(map(get, messages))]
        data += bytes((len(_HEADER) - len(data)) % size)
        data += struct.pack(f'<{len(numbers)}{code}', *numbers)
    return write
