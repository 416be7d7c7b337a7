"""The parameters that say where the camera is on the vehicle, and what autopilots are told."""
from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
import math

from depth_person.autopilot.scan import FARTHEST, ScanOptions
from depth_person.autopilot.vehicle import CameraOnBody
from depth_person.settings.parameter import parameter


@dataclass(frozen=True)
class MountingSettings:
    """How the camera is mounted on the vehicle."""

    camera_pitch: float = parameter(
        0.0, "How far the camera looks down, degrees from level or from the body's forward.",
        minimum=-90.0, maximum=90.0, read_only=False)
    camera_roll: float = parameter(
        0.0, 'How far the camera is rolled clockwise, seen from behind, degrees.',
        minimum=-180.0, maximum=180.0, read_only=False)
    camera_yaw: float = parameter(
        0.0, "How far the camera is turned to the right of the body's forward, degrees; -90 looks "
        'left.', minimum=-180.0, maximum=180.0, read_only=False)
    camera_x: float = parameter(
        0.0, 'Of the camera ahead of the origin of base_frame, metres.', minimum=-50.0,
        maximum=50.0, read_only=False)
    camera_y: float = parameter(
        0.0, 'To the left of it, metres.', minimum=-50.0, maximum=50.0, read_only=False)
    camera_z: float = parameter(
        0.0, 'Above it, metres.', minimum=-50.0, maximum=50.0, read_only=False)
    base_frame: str = parameter(
        'base_link', "The vehicle's frame, x forward, y left, z up; person_depth/scan is in the "
        'same with the ending _frd (forward, right, down).')

    @cached_property
    def camera_on_body(self) -> CameraOnBody:
        """Where the camera is when nothing moves it."""
        return CameraOnBody.mounted(
            pitch_down=math.radians(self.camera_pitch), roll_cw=math.radians(self.camera_roll),
            yaw_right=math.radians(self.camera_yaw),
            position=(self.camera_x, self.camera_y, self.camera_z))


@dataclass(frozen=True)
class ScanSettings:
    """What is said of people as obstacles."""

    scan_sigmas: float = parameter(
        2.0, 'By how many standard deviations people are taken to be nearer than measured, in '
        'person_depth/scan.', minimum=0.0, maximum=5.0, read_only=False)
    scan_range_min: float = parameter(
        0.2, 'Smallest distance in person_depth/scan, metres; who is nearer is said to be there.',
        minimum=0.01, maximum=10.0, read_only=False)
    scan_range_max: float = parameter(
        30.0, 'Who is further away, metres, is left out of person_depth/scan.', minimum=0.1,
        maximum=FARTHEST, read_only=False)
    scan_clear: bool = parameter(
        False, 'Say that directions in view without a person are free up to scan_range_max. Only '
        'people are seen: a wall, a wire and a person who was missed are all called free.',
        read_only=False)

    def scan_options(self) -> ScanOptions:
        """
        Return what a scan is told.

        :raises DepthPersonError: when values do not go together.
        """
        return ScanOptions(
            sigmas=self.scan_sigmas, range_min=self.scan_range_min,
            range_max=self.scan_range_max, clear=self.scan_clear)
