"""The parameters that say what is told of the vehicle's attitude, height and motion."""
from __future__ import annotations

from dataclasses import dataclass

from depth_person.settings.parameter import parameter
from depth_person.settings.vehicle import MountingSettings


@dataclass(frozen=True)
class InputSettings(MountingSettings):
    """Where attitude, height and motion come from; each is optional."""

    attitude: str = parameter(
        'unknown', "Where the vehicle's attitude comes from: `fixed`, it stands level; `imu`, "
        '`pose`, `odometry`, the topic of that name; `tf`, from fixed_frame to the frame of the '
        'image.', choices=('unknown', 'fixed', 'imu', 'pose', 'odometry', 'tf'))
    attitude_sigma: float = parameter(
        1.0, 'Standard deviation of the attitude, degrees.', minimum=0.01, maximum=30.0,
        read_only=False)
    mounting: str = parameter(
        'fixed', 'Where the camera is on the vehicle: `fixed`, camera_pitch, camera_roll, '
        'camera_yaw, camera_x, camera_y, camera_z; `tf`, from base_frame to the frame of the '
        'image, as for a gimbal.', choices=('fixed', 'tf'))
    height: str = parameter(
        'fixed', 'Where the height comes from: `fixed`, camera_height; `rangefinder`, `pose`, '
        '`odometry`, the topic of that name; `tf`; `rel_alt`, which is above home, not above the '
        'ground, and so taken to be 3 m wrong.',
        choices=('fixed', 'rangefinder', 'pose', 'odometry', 'tf', 'rel_alt'))
    camera_height: float = parameter(
        0.0, 'Of the camera above the ground that people stand on, metres; 0 where it is not '
        'known. With the attitude known, feet then tell distances, too.', minimum=0.0,
        maximum=500.0, read_only=False)
    camera_height_sigma: float = parameter(
        0.1, 'Standard deviation of the height, metres.', minimum=0.001, maximum=50.0,
        read_only=False)
    ground_level: float = parameter(
        0.0, 'z of the ground in the frame of pose, odometry or TF, metres.', minimum=-10000.0,
        maximum=10000.0, read_only=False)
    frozen_after: float = parameter(
        5.0, 'A height that has not changed in the least for so many seconds, while the attitude '
        'changed or nothing else could tell, is not used; 0 to trust it.', minimum=0.0,
        maximum=3600.0, read_only=False)
    camera_pose: str = parameter(
        'none', "Where the camera's motion comes from, so that people are followed in a frame "
        'that does not move: `pose`, `odometry`, the topic of that name; `tf`.',
        choices=('none', 'pose', 'odometry', 'tf'))
    fixed_frame: str = parameter(
        'map', 'Frame of TF that does not move, z up, for what comes from `tf`.')

    @property
    def sources(self) -> frozenset[str]:
        """Names of everything that is listened to."""
        return frozenset((self.attitude, self.mounting, self.height, self.camera_pose))
