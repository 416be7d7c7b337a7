"""The service that a calibration tool hands its result to."""
from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from rclpy.node import Node
from sensor_msgs.srv import SetCameraInfo

from depth_person.camera.calibration import is_preset, resolve_url, save_camera_info
from depth_person.camera.intrinsics import Intrinsics
from depth_person.errors import DepthPersonError
from depth_person.nodes.image_messages import decode_camera_info

#: Where a calibration goes when no file is named: as with camera_info_manager.
_DEFAULT_URL = 'file://${ROS_HOME}/camera_info/${NAME}.yaml'


class CalibrationService:
    """
    Serves set_camera_info: writes the calibration, then has it used from the next image on.

    :param url: camera_info_url, which may be empty or a preset.
    :param check: raises a DepthPersonError for intrinsics that cannot be the camera's.
    :param take: takes the new intrinsics.
    """

    def __init__(
        self, node: Node, *, url: str, check: Callable[[Intrinsics], None],
        take: Callable[[Intrinsics], None],
    ) -> None:
        self._logger = node.get_logger()
        self._name = node.get_namespace().strip('/').replace('/', '_') or 'camera'
        self._url = _DEFAULT_URL if not url or is_preset(url) else url
        self._named = self._url == url
        self._check, self._take = check, take
        node.create_service(SetCameraInfo, 'set_camera_info', self._serve)

    def _serve(
        self, request: SetCameraInfo.Request, response: SetCameraInfo.Response,
    ) -> SetCameraInfo.Response:
        try:
            path = self._save(request)
        except DepthPersonError as error:
            self._logger.error(f'set_camera_info: {error}')
            response.success, response.status_message = False, str(error)
            return response
        response.success, response.status_message = True, f'written to {path}' + (
            '' if self._named else f'; for the next start set camera_info_url to file://{path}')
        self._logger.info(f'set_camera_info: {response.status_message}')
        return response

    def _save(self, request: SetCameraInfo.Request) -> Path:
        intrinsics = decode_camera_info(request.camera_info)
        if intrinsics is None:
            raise DepthPersonError('this calibration is empty (K[0] is 0); calibrate first')
        self._check(intrinsics)
        path = resolve_url(self._url, camera_name=self._name)
        save_camera_info(path, self._name, intrinsics)
        self._take(intrinsics)
        return path
