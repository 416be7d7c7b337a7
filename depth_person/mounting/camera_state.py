"""The one place that turns what a vehicle tells into gravity, height and pose of the camera."""
from __future__ import annotations

from dataclasses import dataclass, replace
import math
import threading
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depth_person.autopilot.vehicle import CameraOnBody
from depth_person.distance.attitude import down_of
from depth_person.distance.estimator import Mounting
from depth_person.distance.tracked import CameraPose
from depth_person.mounting.frozen import FrozenHeight
from depth_person.mounting.history import NotKnown, Pose
from depth_person.mounting.report import Report
from depth_person.mounting.vehicle_inputs import VehicleInputs
from depth_person.settings.inputs import InputSettings

_Array = NDArray[np.float64]

_LEVEL_DOWN = np.array([0.0, 0.0, -1.0])
#: By how much the rate of turning may be wrong while an attitude goes on without samples,
#: radians a second; the speed up or down while a height does, metres a second.
_RATE_SIGMA = 0.5
_CLIMB_SIGMA = 2.0
#: A rangefinder that is tilted further (cosine of 45 degrees) meets another ground.
_STEEPEST = 0.7
#: Height above home says this little of the height above the ground, metres.
_REL_ALT_SIGMA = 3.0


@dataclass(frozen=True, eq=False)
class CameraState:
    """
    What is known of the camera at the time of an image.

    :ivar mounting: gravity and height, for the distance stage.
    :ivar on_body: where the camera is on the vehicle; None where that is not known.
    :ivar pose: where it is in a frame that does not move; None where that is not known.
    """

    mounting: Mounting
    on_body: CameraOnBody | None
    pose: CameraPose | None


class CameraTracker:
    """
    Answers for the time of an image, and never for another.

    Messages and questions may come from different threads. What is missing is reported and left
    out: each cue goes without, none is made up.

    :ivar inputs: takes the messages; hold `lock` meanwhile.
    """

    def __init__(self, report: Report, inputs: VehicleInputs) -> None:
        self.lock = threading.Lock()
        self.inputs = inputs
        self._report = report
        self._frozen = FrozenHeight()

    def at(self, stamp_ns: int, frame_id: str, settings: InputSettings) -> CameraState:
        """
        Return what is known of the camera.

        :param frame_id: of the image, the camera's optical frame.
        """
        with self.lock:
            view = _View(self.inputs, stamp_ns, frame_id, settings)
            on_body = self._answer('mounting', view.on_body)
            gravity = self._answer('attitude', lambda: view.gravity(on_body))
            if gravity is None:
                mounting = Mounting()
            else:
                mounting = Mounting(gravity=gravity[0], gravity_sigma=gravity[1])
                height = self._answer(
                    'height', lambda: self._height(view, gravity[0], on_body))
                if height is not None:
                    mounting = replace(mounting, height=height[0], height_sigma=height[1])
            pose = self._answer('camera pose', lambda: view.camera_pose(on_body))
        return CameraState(mounting, on_body, pose)

    def _answer(self, what: str, ask: Any) -> Any:
        try:
            answer = ask()
        except NotKnown as reason:
            self._report.value(what, 'not known')
            self._report.fault(what, f'the {what} is not known: {reason}')
            return None
        self._report.clear(what)
        if answer is not None:
            self._report.value(what, 'known')
        return answer

    def _height(
        self, view: _View, gravity: _Array, on_body: CameraOnBody | None,
    ) -> tuple[float, float] | None:
        settings = view.settings
        told = view.height(gravity, on_body)
        if told is None:
            return None
        measured, height, sigma = told
        if height <= 0:
            raise NotKnown(
                f'{settings.height} says {height:.2f} m; check ground_level and the sensor')
        if settings.height == 'rel_alt':
            self._report.fault(
                'rel_alt', 'the height is above home (rel_alt), not above the ground; give a '
                'rangefinder where the ground is not level')
        down = None
        if on_body is not None and settings.attitude != 'fixed':
            down = on_body.rotation @ gravity
        if settings.height != 'fixed' and self._frozen.frozen(
                measured, stamp_ns=view.stamp_ns, after_s=settings.frozen_after, down=down):
            raise NotKnown(
                f'{settings.height} has said {measured:g} m for more than '
                f'{settings.frozen_after:g} s without the least change')
        return height, sigma


@dataclass(frozen=True)
class _View:
    """The inputs at the time of one image."""

    inputs: VehicleInputs
    stamp_ns: int
    frame_id: str
    settings: InputSettings

    def on_body(self) -> CameraOnBody:
        """Return where the camera is on the vehicle."""
        if self.settings.mounting == 'fixed':
            return self.settings.camera_on_body
        pose = self.inputs.transform_at(
            target=self.settings.base_frame, source=self.frame_id, stamp_ns=self.stamp_ns).value
        return CameraOnBody(pose.rotation, pose.position)

    def gravity(self, on_body: CameraOnBody | None) -> tuple[_Array, float] | None:
        """Return the direction down in the optical frame and its spread, radians."""
        source, sigma = self.settings.attitude, math.radians(self.settings.attitude_sigma)
        if source == 'unknown':
            return None
        if source == 'tf':
            found = self._in_fixed_frame()
            return down_of(found.value.rotation), math.hypot(sigma, _RATE_SIGMA * found.beyond_s)
        if on_body is None:
            raise NotKnown('where the camera is on the vehicle is not known')
        down, beyond_s = _LEVEL_DOWN, 0.0
        if source != 'fixed':
            found = self.inputs.pose_at(source, self.stamp_ns)
            down, beyond_s = down_of(found.value.rotation), found.beyond_s
        return on_body.rotation.T @ down, math.hypot(sigma, _RATE_SIGMA * beyond_s)

    def height(
        self, gravity: _Array, on_body: CameraOnBody | None,
    ) -> tuple[float, float, float] | None:
        """Return what was measured, the camera's height from it and its spread, metres."""
        settings = self.settings
        sigma = settings.camera_height_sigma
        if settings.height == 'fixed':
            height = settings.camera_height
            return (height, height, sigma) if height else None
        if settings.height == 'tf':
            pose = self._in_fixed_frame()
            measured = float(pose.value.position[2])
            return (measured, measured - settings.ground_level,
                    math.hypot(sigma, _CLIMB_SIGMA * pose.beyond_s))
        if on_body is None:
            raise NotKnown('where the camera is on the vehicle is not known')
        down = on_body.rotation @ gravity
        above_base = -float(down @ on_body.position)
        if settings.height in ('pose', 'odometry'):
            pose = self.inputs.pose_at(settings.height, self.stamp_ns)
            measured = float(pose.value.position[2])
            return (measured, measured - settings.ground_level + above_base,
                    math.hypot(sigma, _CLIMB_SIGMA * pose.beyond_s))
        number = self.inputs.number_at(settings.height, self.stamp_ns)
        sigma = math.hypot(sigma, _CLIMB_SIGMA * number.beyond_s)
        if settings.height == 'rel_alt':
            return number.value, number.value + above_base, math.hypot(sigma, _REL_ALT_SIGMA)
        upright = float(down @ _LEVEL_DOWN)
        if upright < _STEEPEST:
            raise NotKnown('the rangefinder does not look down, the vehicle is tilted too far')
        return number.value, number.value * upright + above_base, sigma

    def camera_pose(self, on_body: CameraOnBody | None) -> CameraPose | None:
        """Return where the camera is in a frame that does not move."""
        source = self.settings.camera_pose
        if source == 'none':
            return None
        if source == 'tf':
            pose = self._in_fixed_frame().value
        elif on_body is None:
            raise NotKnown('where the camera is on the vehicle is not known')
        else:
            vehicle = self.inputs.pose_at(source, self.stamp_ns).value
            pose = Pose(on_body.rotation, on_body.position).then(vehicle)
        return CameraPose(rotation=pose.rotation, position=pose.position)

    def _in_fixed_frame(self) -> Any:
        return self.inputs.transform_at(
            target=self.settings.fixed_frame, source=self.frame_id, stamp_ns=self.stamp_ns)
