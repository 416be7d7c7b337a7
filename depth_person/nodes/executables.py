"""What `ros2 run` and the console scripts start."""
from __future__ import annotations

from importlib import import_module

from depth_person.interrupts import deferred_interrupts


def camera_node() -> int:
    """Run camera_node; return the exit code."""
    return _run('camera_node', 'CameraNode')


def pose_node() -> int:
    """Run pose_node; return the exit code."""
    return _run('pose_node', 'PoseNode')


def depth_node() -> int:
    """Run depth_node; return the exit code."""
    return _run('depth_node', 'DepthNode')


def mavlink_node() -> int:
    """Run mavlink_node; return the exit code."""
    return _run('mavlink_node', 'MavlinkNode')


def _run(name: str, class_name: str) -> int:
    try:
        with deferred_interrupts():
            node_class = getattr(import_module(f'depth_person.nodes.{name}'), class_name)
            spin = import_module('depth_person.nodes.spin')
        return spin.run_alone(node_class)
    except KeyboardInterrupt:  # while it was starting; later ones are handled there
        return 130
