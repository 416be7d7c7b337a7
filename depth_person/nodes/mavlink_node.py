"""The node that tells an autopilot of people, over MAVLink."""
from __future__ import annotations

from collections.abc import Callable, Mapping
import math
from typing import Any

from geometry_msgs.msg import PoseWithCovarianceStamped
import numpy as np
from numpy.typing import NDArray
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.subscription import Subscription
from sensor_msgs.msg import LaserScan, PointCloud2
from std_msgs.msg import Header

from depth_person.autopilot.mavlink_link import MavlinkLink
from depth_person.autopilot.mavlink_messages import Companion
from depth_person.autopilot.mavlink_peer import Peer
from depth_person.autopilot.mavlink_transport import parse_connection
from depth_person.autopilot.scan import BINS, STEP
from depth_person.autopilot.vehicle import CameraOnBody
from depth_person.errors import DepthPersonError
from depth_person.nodes.base import StageNode
from depth_person.nodes.cloud_messages import decode_cloud, PERSON_POINT
from depth_person.nodes.image_messages import stamp_ns
from depth_person.nodes.monitor import Level
from depth_person.nodes.mounting_input import MountingInput
from depth_person.nodes.watchdog import Age, Watchdog
from depth_person.settings.mavlink import MavlinkSettings
from depth_person.settings.parameter import ParameterValue

_REPORT_S = 1.0
#: base_link is forward, left, up; MAVLink's body frame is forward, right, down.
_FRD = np.array([1.0, -1.0, -1.0])


class MavlinkNode(StageNode[MavlinkSettings]):
    """
    Sends OBSTACLE_DISTANCE, OBSTACLE_DISTANCE_3D and FOLLOW_TARGET, as parameters say.

    What comes in is sent at once or not at all; nothing is repeated.

    :raises DepthPersonError: when parameters are wrong, or pymavlink is not installed.
    """

    def __init__(self, *, overrides: Mapping[str, ParameterValue] | None = None) -> None:
        super().__init__('mavlink_node', MavlinkSettings, overrides=overrides)

    def configure(self) -> None:
        """Make the link, and listen to what is to be sent."""
        settings = self.settings
        self._companion = Companion(
            system_id=settings.system_id, component_id=settings.component_id,
            follow_system_id=settings.follow_system_id)
        self._peer = Peer(settings.system_id)
        self._link = MavlinkLink(
            parse_connection(settings.connection), self._companion, self._peer,
            now_ns=lambda: self.now_ns)
        self._started_ns = self.now_ns
        self._watchdog = Watchdog(self.monitor)
        self._topics: dict[str, Subscription] = {}
        if settings.obstacle_distance:
            self._listen_to('scan', LaserScan, self._on_scan)
        if settings.obstacle_distance_3d:
            self._mounting = MountingInput(self, lambda: self.settings.inputs())
            self._listen_to('people', PointCloud2, self._on_people)
        if settings.follow_target:  # with nobody to follow there is none, which is no fault
            self._listen_to('target', PoseWithCovarianceStamped, self._on_target, optional=True)
        self.work('mavlink', self._link.run)
        self.create_timer(_REPORT_S, self._report, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _listen_to(
        self, name: str, kind: type, callback: Callable[[Any], None], *, optional: bool = False,
    ) -> None:
        self._topics[name] = self.listen(
            kind, f'person_depth/{name}', callback, optional=optional)

    def _on_scan(self, message: LaserScan) -> None:
        ranges = np.asarray(message.ranges, np.float32)
        if len(ranges) != BINS or not math.isclose(message.angle_increment, STEP, rel_tol=1e-3):
            self.monitor.fault(
                'scan', Level.ERROR, f'a scan of {len(ranges)} bins instead of {BINS} of 5 '
                'degrees is not sent; check which node publishes person_depth/scan')
            return
        self.monitor.clear('scan')
        if self._fit('scan', message.header):
            self._send('OBSTACLE_DISTANCE', [self._companion.obstacle_distance(
                ranges, stamp_ns=stamp_ns(message.header), range_min=message.range_min,
                range_max=message.range_max)])

    def _on_people(self, message: PointCloud2) -> None:
        try:
            people = decode_cloud(message, PERSON_POINT)[0]
        except DepthPersonError as error:
            self.monitor.fault('people', Level.ERROR, str(error))
            return
        self.monitor.clear('people')
        if not self._fit('people', message.header):
            return
        camera = self._mounting.at(stamp_ns(message.header), message.header.frame_id).on_body
        if camera is None:  # the mounting input says why
            self.monitor.count('not sent')
            return
        options = self.settings.scan_options()
        self._send('OBSTACLE_DISTANCE_3D', self._companion.obstacles_3d(
            self._near_positions(people, camera), boot_ms=self._boot_ms(message.header),
            range_min=options.range_min, range_max=options.range_max))

    def _on_target(self, message: PoseWithCovarianceStamped) -> None:
        if not self._fit('target', message.header):
            return
        position = message.pose.pose.position
        found = self._peer.place_of(
            _FRD * (position.x, position.y, position.z), stamp_ns(message.header))
        if found is None:
            self.monitor.fault(
                'follow', Level.WARN, 'no FOLLOW_TARGET: the autopilot has sent no '
                'GLOBAL_POSITION_INT or no ATTITUDE within 0.5 s of the image; ask for these '
                'streams, and check that it has a position')
            return
        self.monitor.clear('follow')
        place, ned_from_body = found
        covariance = np.reshape(message.pose.covariance, (6, 6))[:3, :3] * np.outer(_FRD, _FRD)
        variance = np.diagonal(ned_from_body @ covariance @ ned_from_body.T)
        self._send('FOLLOW_TARGET', [self._companion.follow_target(
            place, boot_ms=self._boot_ms(message.header),
            sigma_horizontal=math.sqrt(max(variance[0] + variance[1], 0.0)),
            sigma_vertical=math.sqrt(max(variance[2], 0.0)))])

    def _near_positions(
        self, people: NDArray[np.void], camera: CameraOnBody,
    ) -> list[tuple[int, NDArray[np.float64]]]:
        """Return track ids and near bounds, forward, right, down, of those within the limit."""
        options = self.settings.scan_options()
        result = []
        for person in people[people['reason'] == 0]:
            distance = float(person['range'])
            near = distance - options.sigmas * float(person['range_sigma'])
            ray = np.array([person['x'], person['y'], person['z']], np.float64) / distance
            position = _FRD * camera.to_body(max(near, options.range_min) * ray)
            if np.linalg.norm(position) <= options.range_max:  # NaN fails, too
                result.append((int(person['track_id']), position))
        return result

    def _boot_ms(self, header: Header) -> int:
        return self._peer.boot_ms(stamp_ns(header), else_boot_ns=self._started_ns)

    def _fit(self, name: str, header: Header) -> bool:
        """Return whether what comes with this header may be sent; what may not is reported."""
        if self.crowded(self._topics[name]):  # they may contradict each other
            self.monitor.count('not sent')
            return False
        age = self._watchdog.judge(
            stamp_ns=stamp_ns(header), now_ns=self.now_ns, max_age_s=self.settings.max_age)
        return age is Age.FRESH

    def _send(self, kind: str, packets: list[bytes]) -> None:
        if self._link.send(packets):
            self.monitor.count(f'sent {kind}', len(packets))
            self.monitor.frame()
        else:
            self.monitor.count('not sent')

    def _report(self) -> None:
        """Say how the autopilot is."""
        if not self.active:
            return
        link, now_ns = self._link, self.now_ns
        for name, number in (
                ('received', link.received), ('from others', link.foreign),
                ('damaged', link.damaged), ('bytes of a flood dropped', link.dropped)):
            self.monitor.value(name, str(number))
        clock = self._peer.clock
        self.monitor.value(
            'time sync', 'no answer yet' if clock.round_trip_s is None else
            f'round trip {clock.round_trip_s * 1e3:.1f} ms')
        connection, silent_s = self.settings.connection, self._peer.silent_s(now_ns)
        if link.problem:
            self.monitor.fault('link', Level.ERROR, f'{connection}: {link.problem}')
        elif not self._peer.alive(now_ns):
            heard = 'never' if silent_s is None else f'{silent_s:.0f} s ago'
            self.monitor.fault(
                'link', Level.ERROR, f'no heartbeat of system {self.settings.system_id} on '
                f'{connection} (last: {heard}); check the connection and system_id')
        else:
            self.monitor.clear('link')
        if link.flooded:
            self.monitor.fault(
                'flood', Level.WARN, f'{connection} floods: more comes in than can be looked at, '
                'the rest is dropped; ask the autopilot for fewer streams')
        else:
            self.monitor.clear('flood')
