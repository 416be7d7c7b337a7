"""Makes the bytes of serialised messages depend on nothing but the messages."""
from __future__ import annotations

from collections.abc import Callable, Iterable
from struct import Struct
from typing import Any

from rosbags.interfaces import Nodetype
from rosbags.typesys.store import Typestore

#: The encapsulation header, from whose end fields are aligned.
_HEADER = 4
_SIZES = {
    'bool': 1, 'octet': 1, 'byte': 1, 'char': 1, 'int8': 1, 'uint8': 1, 'int16': 2, 'uint16': 2,
    'int32': 4, 'uint32': 4, 'float32': 4, 'int64': 8, 'uint64': 8, 'float64': 8}
_LONGEST = 8

#: Clears the gaps of one field that begins at an offset; returns the offset behind it.
Walk = Callable[[bytearray, int], int]

#: The gaps between fields, from where they begin, and where they end.
_Layout = tuple[list[tuple[int, int]], int]


class GapCleaner:
    """
    Clears the gaps that CDR leaves between fields so that they are aligned.

    Fast CDR leaves in them whatever the memory held before.
    """

    def __init__(self, types: Typestore) -> None:
        self._types = types
        self._walks: dict[str, Walk] = {}

    def clean(self, data: bytes, msgtype: str) -> bytes:
        """Return a serialised message (plain CDR, little endian) with zeros in its gaps."""
        if msgtype not in self._walks:
            self._walks[msgtype] = _sequence(self._fields(msgtype))
        cleaned = bytearray(data)
        self._walks[msgtype](cleaned, _HEADER)
        return bytes(cleaned)

    def _fields(self, msgtype: str) -> list[_Run | Walk]:
        """Return the fields of a type and of what it is made of, those of fixed size joined."""
        parts: list[_Run | Walk] = []
        for _, (kind, detail) in self._types.fielddefs[msgtype][1]:
            for part in self._parts(kind, detail):
                if isinstance(part, _Run) and parts and isinstance(parts[-1], _Run):
                    parts[-1] = parts[-1].then(part)
                else:
                    parts.append(part)
        return parts

    def _parts(self, kind: Nodetype, detail: Any) -> list[_Run | Walk]:
        if kind == Nodetype.NAME:
            return self._fields(detail)
        if kind == Nodetype.BASE:
            name = detail[0]
            return [_COUNT, _skip] if name == 'string' else [_Run((_SIZES[name],))]
        (item_kind, item_detail), length = detail
        item = self._parts(item_kind, item_detail)
        if kind == Nodetype.ARRAY:
            return item * length
        return [_COUNT, _list_of(item)]


class _Run:
    """
    Fields of fixed sizes in a row.

    :param sizes: of the fields, bytes, each its own alignment.
    """

    def __init__(self, sizes: tuple[int, ...]) -> None:
        self.sizes = sizes
        # By the offset at which the run begins, up to multiples of the longest alignment.
        self.layouts = [_layout(sizes, phase) for phase in range(_LONGEST)]

    def then(self, other: _Run) -> _Run:
        """Return this run with another behind it."""
        return _Run(self.sizes + other.sizes)

    @property
    def whole(self) -> bool:
        """Whether one run directly behind another leaves no gap, once the first is aligned."""
        return len(set(self.sizes)) == 1


def _layout(sizes: Iterable[int], phase: int) -> _Layout:
    """Return the gaps between fields that begin at an offset, and where they end."""
    gaps = []
    position = phase
    for size in sizes:
        aligned = -(-position // size) * size
        if aligned > position:
            gaps.append((position - phase, aligned - phase))
        position = aligned + size
    return gaps, position - phase


#: How long a string or a list is, which stands before it.
_COUNT = _Run((4,))
_read_count = Struct('<I').unpack_from


def _skip(data: bytearray, offset: int) -> int:
    return offset + _read_count(data, offset - 4)[0]


def _stay(data: bytearray, offset: int) -> int:
    return offset


def _list_of(item: list[_Run | Walk]) -> Walk:
    walk = _sequence(item)

    def walk_list(data: bytearray, offset: int) -> int:
        for _ in range(*_read_count(data, offset - 4)):
            offset = walk(data, offset)
        return offset

    def walk_numbers(data: bytearray, offset: int) -> int:
        count, = _read_count(data, offset - 4)
        return walk(data, offset) + (count - 1) * size if count else offset

    if len(item) == 1 and isinstance(item[0], _Run) and item[0].whole:
        size = sum(item[0].sizes)
        return walk_numbers
    return walk_list


def _sequence(parts: list[_Run | Walk]) -> Walk:
    """Return the walk along parts, of which no two that are not runs follow each other."""
    steps: list[tuple[list[_Layout], Walk]] = []
    for part in parts:
        if isinstance(part, _Run):
            steps.append((part.layouts, _stay))
        else:
            steps[-1] = steps[-1][0], part

    def walk_parts(data: bytearray, offset: int) -> int:
        for layouts, then in steps:
            gaps, length = layouts[(offset - _HEADER) % _LONGEST]
            for start, end in gaps:
                data[offset + start:offset + end] = bytes(end - start)
            offset = then(data, offset + length)
        return offset
    return walk_parts
