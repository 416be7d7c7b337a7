"""The parameters of mavlink_node."""
from __future__ import annotations

from dataclasses import dataclass, fields

from depth_person.autopilot.mavlink_transport import parse_connection
from depth_person.errors import DepthPersonError
from depth_person.settings.inputs import InputSettings
from depth_person.settings.node import NodeSettings
from depth_person.settings.parameter import parameter
from depth_person.settings.vehicle import MountingSettings, ScanSettings


@dataclass(frozen=True)
class MavlinkSettings(ScanSettings, MountingSettings, NodeSettings):
    """
    The parameters of mavlink_node.

    :raises DepthPersonError: when values do not go together.
    """

    connection: str = parameter(
        'udpin:127.0.0.1:14550', 'Where the autopilot is: `udpin:HOST:PORT` waits for it, '
        '`udpout:HOST:PORT` sends there, `/dev/NAME,BAUD` is a serial line.')
    system_id: int = parameter(
        1, "The vehicle's MAVLink system id, which this companion shares.", minimum=1,
        maximum=255)
    component_id: int = parameter(
        196, "This companion's component id; 196 is obstacle avoidance.", minimum=2, maximum=255)
    follow_system_id: int = parameter(
        200, "System id of the person to follow, another than the vehicle's.", minimum=1,
        maximum=255)
    obstacle_distance: bool = parameter(
        True, 'Send OBSTACLE_DISTANCE: person_depth/scan.')
    obstacle_distance_3d: bool = parameter(
        False, 'Send OBSTACLE_DISTANCE_3D: each person in three dimensions. ArduPilot knows it, '
        'PX4 does not; on ArduPilot send one of the two only.')
    mounting: str = parameter(
        'fixed', 'Where the camera is on the vehicle, as for depth_node; OBSTACLE_DISTANCE_3D '
        'needs it.', choices=('fixed', 'tf'))
    follow_target: bool = parameter(
        False, 'Send FOLLOW_TARGET: person_depth/target on the Earth, by the position and '
        'attitude that the autopilot sends.')
    max_age: float = parameter(
        0.4, 'What is older than this, seconds from the stamp of its image, is not sent; 0 for no '
        'limit.', minimum=0.0, maximum=60.0, read_only=False)

    def __post_init__(self) -> None:
        self.scan_options()
        parse_connection(self.connection)
        if self.follow_system_id == self.system_id:
            raise DepthPersonError(
                f'follow_system_id and system_id are both {self.system_id}; autopilots do not '
                'follow themselves')

    def inputs(self) -> InputSettings:
        """Return what says where the camera is on the vehicle, and nothing else."""
        return InputSettings(mounting=self.mounting, **{
            each.name: getattr(self, each.name) for each in fields(MountingSettings)})
