"""Golden values: results kept as text, with the tolerances to compare with."""
from __future__ import annotations

from dataclasses import asdict, fields
import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from depth_person.errors import DepthPersonError
from depth_person.files import write_text
from depth_person.replay.compare import Tolerances
from depth_person.replay.record import Record
from depth_person.replay.results import gather, NEEDED, PersonRows, Results

#: Metres are kept to a tenth of a millimetre.
_DIGITS = 4
_POINT = np.dtype([(name, 'i8' if name == 'track_id' else 'f8') for name in NEEDED])


def write_golden(path: Path, results: Results, tolerances: Tolerances) -> None:
    """
    Write results as golden values, one line a person.

    :raises DepthPersonError: when the file cannot be written.
    """
    people = results.people
    frames = []
    for index, stamp in enumerate(results.stamps_ns.tolist()):
        rows = np.flatnonzero(people.frame == index)
        inner = ',\n'.join('   ' + json.dumps(_as_json(people, row)) for row in rows)
        frames.append(f'  {{"stamp_ns": {stamp}, "people": [' + (
            f'\n{inner}]}}' if inner else ']}'))
    text = (f'{{\n "tolerances": {json.dumps(asdict(tolerances))},\n "frames": [\n'
            + ',\n'.join(frames) + '\n ]\n}\n')
    write_text(path, text)


def read_golden(path: Path) -> tuple[Results, Tolerances]:
    """
    Return golden values and their tolerances.

    :raises DepthPersonError: when the file cannot be read or is no such file.
    """
    try:
        return _read(Record.read(path), str(path))
    except DepthPersonError as error:
        raise DepthPersonError(f'{path}: {error}') from error


def _read(record: Record, name: str) -> tuple[Results, Tolerances]:
    given = record.child('tolerances') if 'tolerances' in record else Record({})
    tolerances = Tolerances(**{
        field.name: given.number(field.name, field.default) for field in fields(Tolerances)
        if isinstance(field.default, float)})
    frames: dict[int, tuple[int, PersonRows]] = {}
    for frame in record.children('frames'):
        stamp = frame.identity('stamp_ns')
        if not isinstance(stamp, int) or stamp in frames:
            raise frame.fault('stamp_ns', f'is {stamp!r}: no whole number, or there twice')
        points = np.array([_point(person) for person in frame.children('people')], _POINT)
        frames[stamp] = stamp, PersonRows.of_points(points, 0)
    if not frames:
        raise record.fault('frames', 'is empty')
    return gather(name, frames), tolerances


def _as_json(people: PersonRows, row: np.intp) -> dict[str, Any]:
    known = math.isfinite(people.range[row])
    return {
        'id': int(people.track_id[row]),
        'position': np.round(people.position[row], _DIGITS).tolist() if known else None,
        'range': round(float(people.range[row]), _DIGITS) if known else None,
        'sigma': round(float(people.range_sigma[row]), _DIGITS) if known else None}


def _point(person: Record) -> tuple[float, ...]:
    track_id = person.identity('id')
    if not isinstance(track_id, int):
        raise person.fault('id', f'is no whole number but {track_id!r}')
    if 'range' not in person:
        return (math.nan,) * 5 + (track_id,)
    return (*person.array('position', (3,)).tolist(), person.positive('range'),
            person.number('sigma'), track_id)
