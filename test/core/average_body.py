"""An average adult for the tests of the skeleton estimator, and cameras to look with."""
from __future__ import annotations

import numpy as np

from depth_person.camera.intrinsics import Intrinsics
from depth_person.pose.people import People
from depth_person.pose.skeleton import Keypoint

CAMERA = Intrinsics(1280, 720, 900.0, 900.0, 639.5, 359.5)
#: Metres from the neck: to the body's left, back and up; standing, arms hanging.
_MIDDLE = {'NOSE': (0.0, -0.13, 0.183), 'NECK': (0.0, 0.0, 0.0)}
_LEFT = {
    'EYE': (0.030, -0.11, 0.216), 'EAR': (0.074, -0.03, 0.196), 'SHOULDER': (0.168, 0.0, 0.0),
    'ELBOW': (0.20, 0.01, -0.26), 'WRIST': (0.21, -0.06, -0.48), 'HIP': (0.10, -0.017, -0.503),
    'KNEE': (0.11, -0.02, -0.885), 'ANKLE': (0.115, 0.01, -1.27)}
#: The soles are this far below the neck, metres.
NECK_HEIGHT = 1.36


def average_body() -> np.ndarray:
    """Return (18, 3) keypoints."""
    body = np.empty((18, 3))
    for name, place in _MIDDLE.items():
        body[Keypoint[name]] = place
    for name, place in _LEFT.items():
        body[Keypoint['L_' + name]] = place
        body[Keypoint['R_' + name]] = np.array(place) * (-1, 1, 1)
    return body


def standing_at(position, *, yaw_deg=0.0, size=1.0) -> np.ndarray:
    """Return (18, 3) keypoints in a level camera's frame, of a body whose neck is there."""
    x, y, z = average_body().T * size
    cos, sin = np.cos(np.radians(yaw_deg)), np.sin(np.radians(yaw_deg))
    return np.stack([cos * x - sin * y, -z, sin * x + cos * y], axis=-1) + position


def seen(points, *, score=1.0, camera=CAMERA, convention='mesh') -> People:
    """Return the people (n, 18, 3) in the camera frame as a faultless network marks them."""
    points = np.reshape(points, (-1, 18, 3))
    pixels = camera.project(points)
    scores = np.full((*pixels.shape[:2], 1), score)
    keypoints = np.concatenate([pixels, scores], axis=-1).astype(np.float32)
    return People(keypoints, np.arange(len(points), dtype=np.int32), convention=convention)


def only(people: People, *names: str) -> People:
    """Return the people with no keypoints but these."""
    keypoints = people.keypoints.copy()
    keypoints[:, [row for row in Keypoint if row.name not in names]] = np.nan
    return People(keypoints, people.track_ids, people.neck_measured, people.convention)
