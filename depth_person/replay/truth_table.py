"""Truth from a table of separated values."""
from __future__ import annotations

import csv
from decimal import Decimal
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depth_person.errors import DepthPersonError

#: Fields of a place; a table has those of range, or of the others.
PLACE = ('x', 'y', 'z', 'range')
_STAMPS = ('stamp_ns', 'stamp_s', 'time_s')
_NS = 10**9
_INT64 = range(-2**63, 2**63)
#: Later seconds are none of a stamp.
_LAST_S = 10**10

_Row = tuple[int, list[str]]


def read_table(
    path: Path, start_ns: int,
) -> tuple[NDArray[np.int64], NDArray[np.int64], dict[str, NDArray[np.float64]]]:
    """
    Return the stamps (ns), the ids, and the columns of PLACE that a table has, NaN for no number.

    Columns are separated by commas, semicolons or tabs, whichever the header has most of.

    :param start_ns: what time_s is counted from.
    :raises DepthPersonError: when it cannot be read, or lacks a column, or a cell is no number.
    """
    names, rows = _cells(path)
    key = next((name for name in _STAMPS if name in names), None)
    placed = 'range' in names or {'x', 'y', 'z'} <= set(names)
    if key is None or not placed or not rows:
        raise DepthPersonError(
            f'the truth {path} has {len(rows)} rows of {", ".join(names) or "nothing"}; it needs '
            f'one of {", ".join(_STAMPS)}, and range or x, y, z')
    stamps, ids = np.zeros((2, len(rows)), np.int64)
    places = {name: np.full(len(rows), np.nan) for name in PLACE if name in names}
    for index, (line, row) in enumerate(rows):
        cells = dict(zip(names, row, strict=False))
        try:
            stamps[index] = _stamp(key, cells[key], start_ns)
            ids[index] = _whole(cells['id']) if 'id' in names else 0
            for name, column in places.items():
                column[index] = float(cells.get(name) or 'nan')
        except (ArithmeticError, KeyError, ValueError) as error:
            raise DepthPersonError(
                f'the truth {path} is no table of numbers: line {line} has '
                f'{", ".join(f"{name} {cell!r}" for name, cell in cells.items())}') from error
    return stamps, ids, places


def _cells(path: Path) -> tuple[list[str], list[_Row]]:
    """Return the names of the columns, and of each row its line in the file and its cells."""
    try:
        with path.open(newline='', encoding='utf-8-sig') as file:  # spreadsheets put a mark first
            head = file.readline()
            file.seek(0)
            reader = csv.reader(file, delimiter=max(',;\t', key=head.count))
            rows = [(reader.line_num, [cell.strip() for cell in row]) for row in reader if row]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise DepthPersonError(f'the truth {path} cannot be read: {error}') from error
    return (rows[0][1], rows[1:]) if rows else ([], [])


def _stamp(key: str, text: str, start_ns: int) -> int:
    if key == 'stamp_ns':
        return _checked(int(text))
    seconds = Decimal(text)  # in floating point, a stamp of today is off by 100 ns
    if not abs(seconds) < _LAST_S:
        raise ValueError(text)
    return _checked(round(seconds * _NS) + (start_ns if key == 'time_s' else 0))


def _whole(text: str) -> int:
    """Return a whole number, which may be written as 3.0."""
    try:
        return _checked(int(text))
    except ValueError:
        number = float(text)
        if not number.is_integer():
            raise
        return _checked(int(number))


def _checked(number: int) -> int:
    if number not in _INT64:
        raise ValueError(number)
    return number
