"""A vehicle with a camera, and people round it, worked out apart from the code under test."""
from __future__ import annotations

from average_body import average_body, CAMERA, seen
import numpy as np

from depth_person.autopilot.vehicle import CameraOnBody, LevelView
from depth_person.distance.estimator import Distances
from depth_person.distance.tracked import TrackedPeople


def turned(axis, degrees):
    """Return the rotation of a right turn about an axis of a forward-right-down frame."""
    cos, sin = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    rotation = np.eye(3)
    first, second = [(1, 2), (2, 0), (0, 1)][axis]
    rotation[first, first] = rotation[second, second] = cos
    rotation[first, second], rotation[second, first] = -sin, sin
    return rotation


class Scene:
    """
    A vehicle at the origin of its level frame (x ahead, y right, z down), with a camera.

    :param nose_up, roll_right: of the vehicle, degrees.
    :param look_down, look_right: of the camera on the vehicle, degrees.
    :param camera_at: forward, right, down of the vehicle's origin, metres.
    """

    def __init__(self, *, nose_up=0.0, roll_right=0.0, look_down=0.0, look_right=0.0,
                 camera_at=(0.0, 0.0, 0.0)):
        level_from_body = turned(1, nose_up) @ turned(0, roll_right)
        body_from_aim = turned(2, look_right) @ turned(1, -look_down)
        aim_from_optical = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
        self.level_from_optical = level_from_body @ body_from_aim @ aim_from_optical
        self.camera_at = level_from_body @ np.array(camera_at)
        self.gravity = self.level_from_optical.T @ (0.0, 0.0, 1.0)
        forward, right, down = camera_at
        self.camera = CameraOnBody.mounted(
            pitch_down=np.radians(look_down), yaw_right=np.radians(look_right),
            position=(forward, -right, -down))

    @property
    def view(self):
        return LevelView.of(self.camera, self.gravity)

    def to_optical(self, points):
        return (points - self.camera_at) @ self.level_from_optical

    def tracked(self, *people, sigma=0.0, unknown=()):
        """
        Return people given as bearing in degrees, distance and depth of the neck below, metres.

        :param unknown: rows of those without a range.
        """
        points = np.stack([standing(*person) for person in people])
        optical = self.to_optical(points)
        reason = np.zeros(len(people), np.uint8)
        reason[list(unknown)] = 2
        return TrackedPeople.unfiltered(seen(optical), Distances.of(
            position=optical[:, 1], range_sigma=np.full(len(people), float(sigma)),
            reason=reason, cues=np.ones(len(people), np.uint8)))


def standing(bearing_deg, distance, below):
    """Return (18, 3) keypoints in the level frame of someone who faces the vehicle."""
    left, back, up = average_body().T
    bearing = np.radians(bearing_deg)
    ahead, right = np.array([np.cos(bearing), np.sin(bearing), 0]), np.array(
        [-np.sin(bearing), np.cos(bearing), 0])
    return (
        (distance + back)[:, None] * ahead + left[:, None] * right
        - (up - below)[:, None] * np.array([0.0, 0, 1]))


__all__ = ['CAMERA', 'Scene', 'standing', 'turned']
