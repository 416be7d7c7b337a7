"""All three nodes in one process: frames and people are handed on in memory."""
from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from depth_person.nodes.base import StageNode
from depth_person.nodes.camera_node import CameraNode
from depth_person.nodes.depth_node import DepthNode
from depth_person.nodes.monitor import Level
from depth_person.nodes.pose_node import PoseNode
from depth_person.settings.parameter import ParameterValue


def make_pipeline(
    camera_overrides: Mapping[str, ParameterValue] | None = None,
) -> list[StageNode[Any]]:
    """
    Return depth, pose and camera node, in the order in which they are to be started.

    :param camera_overrides: parameters of the camera that come before those of files.
    :raises DepthPersonError: when one of them cannot be made.
    """
    depth = DepthNode(listen=False)
    pose = PoseNode(deliver=depth.take, listen=False)
    for node in (pose, depth):
        if node.settings.compressed:
            node.monitor.fault(
                'compressed', Level.WARN, 'the parameter compressed has no effect in one process, '
                'where frames are handed on in memory', lasting=True)
    camera = CameraNode(
        overrides=camera_overrides, deliver=pose.take,
        has_subscribers=lambda: depth.has_subscribers)
    return [depth, pose, camera]
