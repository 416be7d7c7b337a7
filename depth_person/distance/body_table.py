"""Tables of body dimensions that a user brings: checked CSV files."""
from __future__ import annotations

from collections.abc import Sequence
import csv
from dataclasses import dataclass
import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depth_person.errors import DepthPersonError

_Array = NDArray[np.float64]

#: Columns whose values may be zero or negative; all others are sizes, which may not.
SIGNED = ('d3_center_x_px', 'd4_center_y_px', 'center_x_px', 'center_y_px', 'pitch_down_deg',
          'shoulder_level', 'hip_level', 'knee_level', 'nose_level')


@dataclass(frozen=True, eq=False)
class BodyTable:
    """
    Columns of a CSV file.

    :ivar path: of the file.
    :ivar columns: name -> (n,) values; optional ones hold NaN where a cell is empty.
    :ivar person: (n,) the text of the column `person`; None without one.
    """

    path: Path
    columns: dict[str, _Array]
    person: tuple[str, ...] | None

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())))

    def __contains__(self, name: str) -> bool:
        return name in self.columns

    def __getitem__(self, name: str) -> _Array:
        return self.columns[name]

    def must_vary(self, name: str, why: str) -> None:
        """Raise DepthPersonError when a column holds the same value in every row."""
        values = self.columns[name]
        if np.all(values == values[0]):
            raise DepthPersonError(
                f'{self.path}: {name} is {values[0]:g} in all {len(self)} rows; {why}')


def read_body_table(
    path: Path, *, required: Sequence[str], optional: Sequence[str] = (), least_rows: int,
) -> BodyTable:
    """
    Read a CSV file with a line of column names; other columns are left alone.

    :param required: columns that must be there, with a number in every row.
    :param optional: columns that may be missing, or empty in some rows.
    :param least_rows: fewer are too few.
    :raises DepthPersonError: for the first fault found, naming the row (1 is the first after the
        names) and the column.
    """
    header, rows = _read(path)
    missing = [name for name in required if name not in header]
    if missing:
        raise DepthPersonError(
            f'{path}: no column {", ".join(missing)}; it needs {", ".join(required)} and has '
            f'{", ".join(header) or "none"}')
    seen: dict[tuple[str, ...], int] = {}
    for number, row in enumerate(rows, start=1):
        if len(row) != len(header):
            raise DepthPersonError(
                f'{path}: row {number} has {len(row)} cells for {len(header)} columns')
        first = seen.setdefault(tuple(cell.strip() for cell in row), number)
        if first != number:
            raise DepthPersonError(
                f'{path}: row {number} repeats row {first} in every column; remove one')
    if len(rows) < least_rows:
        raise DepthPersonError(f'{path}: {len(rows)} rows are too few; {least_rows} are needed')
    columns = {
        name: np.array([
            _number(row[header.index(name)], name in required, f'{path}: row {number}', name)
            for number, row in enumerate(rows, start=1)])
        for name in (*required, *(name for name in optional if name in header))}
    person = tuple(row[header.index('person')].strip() for row in rows) if (
        'person' in header) else None
    return BodyTable(path, columns, person)


def _read(path: Path) -> tuple[list[str], list[list[str]]]:
    """Return the names and the rows of cells of a CSV file; empty lines are left out."""
    try:
        with path.open(encoding='utf-8-sig', newline='') as file:
            rows = [row for row in csv.reader(file) if any(cell.strip() for cell in row)]
    except OSError as error:
        raise DepthPersonError(f'{path}: {error.strerror}') from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise DepthPersonError(f'{path}: not a CSV file in UTF-8: {error}') from error
    if not rows:
        raise DepthPersonError(f'{path}: empty; its first line has to name the columns')
    header = [cell.strip() for cell in rows[0]]
    twice = next((name for name in header if name and header.count(name) > 1), None)
    if twice:
        raise DepthPersonError(f'{path}: two columns are named {twice}')
    return header, rows[1:]


def _number(cell: str, required: bool, where: str, column: str) -> float:
    """Return the number in a cell; NaN for an empty one of an optional column."""
    text = cell.strip()
    if not text and not required:
        return math.nan
    try:
        value = float(text)
    except ValueError:
        raise DepthPersonError(
            f'{where}, column {column}: {text!r} is not a number') from None
    if not math.isfinite(value):
        raise DepthPersonError(f'{where}, column {column}: {text} is not a finite number')
    if value <= 0 and column not in SIGNED:
        raise DepthPersonError(f'{where}, column {column}: {text} is not positive')
    return value
