"""Training rows of the body dimensions models, from a table that the user brings."""
from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depth_person.distance.body_box import ANGLE_FEATURES, MISSING, PIXEL_FEATURES
from depth_person.distance.body_table import BodyTable, read_body_table
from depth_person.distance.training.body_fit import Rows

_Array = NDArray[np.float64]

#: Fewer rows leave a split of 0.3 with next to nothing to judge by.
LEAST_ROWS = 30
#: The truth, and the box.
COLUMNS = ('real_height_cm', 'actual_distance_cm', *PIXEL_FEATURES)
#: The camera of each row, without distortion: what `normalised` needs beside them.
CAMERA_COLUMNS = ('focal_px', 'center_x_px', 'center_y_px')
#: What `normalised` takes where it is given.
OPTIONAL_COLUMNS = ('pitch_down_deg', *ANGLE_FEATURES[3:])

_CHILD_CM = 140.0


def table_rows(path: Path, kind: str) -> Rows:
    """
    Return the rows of a CSV file for one kind of model.

    :raises DepthPersonError: when the table is wrong in any way, or tells nothing.
    """
    table = read_body_table(
        path, required=COLUMNS + (CAMERA_COLUMNS if kind == 'normalised' else ()),
        optional=OPTIONAL_COLUMNS if kind == 'normalised' else (), least_rows=LEAST_ROWS)
    table.must_vary('real_height_cm', 'a height cannot be learned from one')
    table.must_vary('actual_distance_cm', 'a distance cannot be learned from one')
    person = np.arange(len(table)) if table.person is None else np.unique(
        table.person, return_inverse=True)[1]
    features = _angles(table) if kind == 'normalised' else np.column_stack(
        [table[name] for name in PIXEL_FEATURES])
    return Rows(kind, features, table['real_height_cm'] / 100,
                table['actual_distance_cm'] / 100, person)


def _angles(table: BodyTable) -> _Array:
    """Return the features in the order of ANGLE_FEATURES; MISSING where the table has none."""
    height, width, x, y = (table[name] for name in PIXEL_FEATURES)
    centre = np.column_stack([x - table['center_x_px'], y - table['center_y_px']])
    middle = np.column_stack([centre / table['focal_px'][:, None], np.ones(len(table))])
    middle /= np.linalg.norm(middle, axis=1, keepdims=True)
    ends = (np.arctan((centre[:, 1] + sign * height / 2) / np.hypot(
        table['focal_px'], centre[:, 0])) for sign in (-1, 1))
    top, bottom = ends
    known = {
        'log_aspect': np.log(width / height), 'height_rad': 2 * np.tan((bottom - top) / 2),
        'children': np.full(len(table), float(table['real_height_cm'].min() < _CHILD_CM))}
    if 'pitch_down_deg' in table:
        pitch = np.radians(table['pitch_down_deg'])
        known['elevation_rad'] = np.arcsin(
            middle[:, 1] * np.cos(pitch) + middle[:, 2] * np.sin(pitch))
    nothing = np.full(len(table), np.nan)
    columns = np.column_stack([
        {**table.columns, **known}.get(name, nothing) for name in ANGLE_FEATURES])
    return np.where(np.isfinite(columns), columns, MISSING)
