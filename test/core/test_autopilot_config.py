"""The files for MAVROS say what they should."""
import logging
from pathlib import Path

import pytest
import yaml

from depth_person.settings.camera import CameraSettings
from depth_person.settings.depth import DepthSettings
from depth_person.settings.files import node_settings
from depth_person.settings.mavlink import MavlinkSettings
from depth_person.settings.pose import PoseSettings

CONFIG = Path(__file__).parents[2] / 'config'


def test_mavros_is_told_that_the_scan_turns_with_the_nose():
    told = yaml.safe_load((CONFIG / 'mavros_plugins.yaml').read_text())
    assert told == {'/**/obstacle': {'ros__parameters': {'mav_frame': 'BODY_FRD'}}}


@pytest.mark.parametrize(('node', 'kind'), [
    ('camera_node', CameraSettings), ('pose_node', PoseSettings), ('depth_node', DepthSettings),
    ('mavlink_node', MavlinkSettings)])
def test_every_node_takes_the_parameters_for_mavros(node, kind, caplog):
    with caplog.at_level(logging.WARNING):
        settings = node_settings(node, kind, file=CONFIG / 'mavros.yaml')
    assert not caplog.messages
    if node == 'depth_node':
        assert (settings.attitude, settings.max_age, settings.scan_clear) == ('imu', 0.4, False)
