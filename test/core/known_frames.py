"""Writes small data sets of people at known distances, for the tests of evaluate."""
from __future__ import annotations

import json
from pathlib import Path

from average_body import CAMERA, standing_at
import cv2
import numpy as np

from depth_person.pose.skeleton import COCO17_ROWS, Keypoint

#: COCO-18 rows in COCO-17's order.
COCO17 = np.argsort(COCO17_ROWS)[1:]


def person(position, *, yaw_deg=0.0, identity=0, **more) -> dict:
    """Return what gt says of a body whose neck is at the position; None leaves a key out."""
    points = standing_at(position, yaw_deg=yaw_deg or 0.0)
    pixels = CAMERA.project(points)[COCO17]
    entry = {
        'id': identity, 'kind': 'female', 'yaw_deg': yaw_deg,
        'depth_z_m': float(position[2]), 'range_m': float(np.linalg.norm(position)),
        'bbox_full': [*(pixels.min(axis=0) - 10).tolist(), *(pixels.max(axis=0) + 10).tolist()],
        'visible_fraction': 1.0,
        'keypoints_px': np.insert(pixels, 2, 2.0, axis=1).tolist(),
        'keypoints_flag': ['visible'] * 17,
        'neck_px': CAMERA.project(points[Keypoint.NECK]).tolist(), **more}
    return {key: value for key, value in entry.items() if value is not None}


def write_frame(folder: Path, name: str, people: list[dict], **more) -> Path:
    """Write gt/NAME.json and a grey image that it names; return the JSON file."""
    for part in ('gt', 'images'):
        (folder / part).mkdir(parents=True, exist_ok=True)
    image = np.full((CAMERA.height, CAMERA.width, 3), 90, np.uint8)
    cv2.imwrite(str(folder / 'images' / f'{name}.png'), image)
    record = {
        'image': f'images/{name}.png', 'id': name, 'width': CAMERA.width, 'height': CAMERA.height,
        'K': {'fx': CAMERA.fx, 'fy': CAMERA.fy, 'cx': CAMERA.cx, 'cy': CAMERA.cy},
        'dist_plumb_bob': [0.0] * 5, 'scenario': 'still', 'tag': name, 'persons': people, **more}
    path = folder / 'gt' / f'{name}.json'
    path.write_text(json.dumps({k: v for k, v in record.items() if v is not None}))
    return path


def edit(path: Path, change) -> None:
    """Apply a function to the object that a JSON file holds."""
    record = json.loads(path.read_text())
    change(record)
    path.write_text(json.dumps(record))
