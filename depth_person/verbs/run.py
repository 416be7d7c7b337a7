"""Run camera, pose and depth in one process."""
from __future__ import annotations

import argparse
from pathlib import Path

from depth_person.errors import DepthPersonError
from depth_person.nodes.composition import make_pipeline
from depth_person.nodes.spin import leave, run_nodes
from depth_person.settings.camera import CameraSettings
from depth_person.settings.parameter import specs

_SHORTCUTS = ('source', 'camera_info_url', 'horizontal_fov', 'fps', 'loop')


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `depth_person run`."""
    parser.add_argument(
        '--params', type=Path, metavar='FILE',
        help='ROS 2 parameter file for the nodes camera_node, pose_node and depth_node')
    for spec in specs(CameraSettings):
        if spec.name not in _SHORTCUTS:
            continue
        option = '--' + spec.name.replace('_', '-')
        if spec.type_name == 'bool':
            parser.add_argument(
                option, action='store_const', const=True, help=spec.description)
        else:
            parser.add_argument(option, type=type(spec.default), help=spec.description)
    parser.add_argument(
        '--ros-args', nargs=argparse.REMAINDER, default=[],
        help='further ROS arguments, such as -r __ns:=/front')


def main(args: argparse.Namespace) -> int:
    """Run until Ctrl-C or the end of the source; return the exit code."""
    ros_args = ['--ros-args']
    if args.params is not None:
        if not args.params.is_file():
            raise DepthPersonError(f'there is no parameter file {args.params}')
        ros_args += ['--params-file', str(args.params)]
    ros_args += args.ros_args
    overrides = {
        name: getattr(args, name) for name in _SHORTCUTS if getattr(args, name) is not None}
    run_nodes(lambda: make_pipeline(overrides), ros_args)
    return leave(0)
