"""People as autopilots take them: person_depth/scan, person_depth/nearest, person_depth/target."""
from __future__ import annotations

import time
from typing import Any

from geometry_msgs.msg import PoseWithCovarianceStamped
from sensor_msgs.msg import LaserScan, Range
from std_msgs.msg import Header

from depth_person.autopilot.choice import chosen_person, nearest_person, target_of
from depth_person.autopilot.scan import scan
from depth_person.autopilot.vehicle import CameraOnBody, LevelView
from depth_person.camera.intrinsics import Intrinsics
from depth_person.distance.estimator import Mounting
from depth_person.distance.tracked import TrackedPeople
from depth_person.nodes.autopilot_messages import encode_nearest, encode_scan, encode_target
from depth_person.nodes.base import StageNode
from depth_person.nodes.monitor import Level

_FAULT, _RATE_FAULT = 'autopilot outputs', 'scan rate'
#: What autopilots want, scans a second; a tenth less is not worth a word.
_WANTED_HZ = 10.0
_TOLERATED = 0.9


class AutopilotOutputs:
    """
    Publishes each frame's people as obstacles, the nearest of them, and the one to follow.

    Nothing is ever repeated: autopilots take arrival for freshness, so what is not known is told
    by silence.

    :param node: whose settings are those of depth_node.
    """

    def __init__(self, node: StageNode[Any]) -> None:
        self._node = node
        self._scan = node.advertise(LaserScan, 'person_depth/scan')
        self._nearest = node.advertise(Range, 'person_depth/nearest')
        self._target = node.advertise(PoseWithCovarianceStamped, 'person_depth/target')
        self._scans = 0
        self._since_s: float | None = None  # they are counted; None until there is one

    @property
    def wanted(self) -> bool:
        """Whether anyone subscribes."""
        return any(
            publisher.get_subscription_count()
            for publisher in (self._scan, self._nearest, self._target))

    def check(self) -> None:
        """Report scans that come too seldom for who subscribes; call it about once a second."""
        now_s = time.monotonic()
        elapsed_s = 0.0 if self._since_s is None else now_s - self._since_s
        scans, self._scans = self._scans, 0
        self._since_s = now_s if scans else None
        if 0 < scans < _TOLERATED * _WANTED_HZ * elapsed_s and (
                self._scan.get_subscription_count()):
            self._node.monitor.fault(
                _RATE_FAULT, Level.WARN,
                f'{scans / elapsed_s:.1f} scans a second on person_depth/scan; autopilots want '
                f'{_WANTED_HZ:g}. Use a smaller input_size, or a camera with more frames')
        else:
            self._node.monitor.clear(_RATE_FAULT)

    def forget(self) -> None:
        """Count scans from the next one on."""
        self._scans, self._since_s = 0, None

    def publish(
        self, tracked: TrackedPeople, image_header: Header, intrinsics: Intrinsics | None,
        mounting: Mounting, camera: CameraOnBody | None,
    ) -> None:
        """
        Publish what one image tells.

        :param intrinsics: of the image; None while the camera is uncalibrated, when nothing is
            published.
        :param mounting: the attitude at the time of the image; a level vehicle is assumed only
            where none was asked for.
        :param camera: where the camera is on the vehicle then; None where that is not known.
        """
        if intrinsics is None:
            self._node.monitor.count('scans withheld')
            return
        self._publish_nearest(tracked, image_header, intrinsics)
        if camera is None:
            self._withhold(
                'no person_depth/scan and no person_depth/target: where the camera is on the '
                'vehicle is not known')
            return
        self._publish_target(tracked, image_header, intrinsics, camera)
        self._publish_scan(tracked, image_header, intrinsics, mounting, camera)

    def _publish_scan(
        self, tracked: TrackedPeople, image_header: Header, intrinsics: Intrinsics,
        mounting: Mounting, camera: CameraOnBody,
    ) -> None:
        settings = self._node.settings
        if mounting.gravity is None and settings.attitude != 'unknown':
            self._withhold(
                f'no person_depth/scan: the attitude ({settings.attitude}) is not known at the '
                'time of the image')
            return
        view = LevelView.of(camera, mounting.gravity)
        if view is None:
            self._withhold('no person_depth/scan: the vehicle points straight up or down')
            return
        self._node.monitor.clear(_FAULT)
        options = settings.scan_options()
        self._scan.publish(encode_scan(
            scan(tracked, intrinsics, view, options), image_header,
            frame_id=f'{settings.base_frame}_frd', options=options))
        self._node.monitor.count('scans')
        self._node.monitor.value(
            'scan frame', 'vehicle taken for level' if mounting.gravity is None else
            'level by attitude')
        self._since_s = time.monotonic() if self._since_s is None else self._since_s
        self._scans += 1

    def _withhold(self, reason: str) -> None:
        self._node.monitor.count('scans withheld')
        self._node.monitor.fault(_FAULT, Level.WARN, reason)

    def _publish_nearest(
        self, tracked: TrackedPeople, image_header: Header, intrinsics: Intrinsics,
    ) -> None:
        row = nearest_person(tracked)
        if row is None:
            return
        distances = tracked.distances
        self._nearest.publish(encode_nearest(
            image_header, distance=float(distances.range[row]),
            sigma=float(distances.range_sigma[row]), max_range=self._node.settings.max_range,
            intrinsics=intrinsics))

    def _publish_target(
        self, tracked: TrackedPeople, image_header: Header, intrinsics: Intrinsics,
        camera: CameraOnBody,
    ) -> None:
        settings = self._node.settings
        row = chosen_person(tracked, settings.target, intrinsics)
        if row is None:
            return
        target = target_of(tracked, row, camera)
        self._target.publish(encode_target(target, image_header, frame_id=settings.base_frame))
        self._node.monitor.value('target', f'#{target.track_id}')
