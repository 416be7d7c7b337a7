"""Records the topics that a report of a fault needs, as `ros2 bag record` does."""
from __future__ import annotations

import argparse
from pathlib import Path
import sys
import time

from rclpy.exceptions import InvalidTopicNameException
from rclpy.executors import SingleThreadedExecutor
from rclpy.expand_topic_name import expand_topic_name
from rclpy.node import Node
from rclpy.validate_full_topic_name import validate_full_topic_name

from depth_person.interrupts import noted_interrupts
from depth_person.nodes.bag_recorder import BagRecorder, REPORT_TOPICS
from depth_person.nodes.spin import ros_context
from depth_person.replay.bags import BagWriter
from depth_person.verbs.numbers import positive

#: How soon Ctrl-C is seen, seconds.
_POLL_S = 0.1
#: The exit code where something was left out.
_PARTLY = 3


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's arguments."""
    parser.add_argument(
        '-o', '--output', type=Path, required=True, metavar='BAG', help='the bag to write (MCAP)')
    parser.add_argument(
        '--topics', nargs='+', metavar='TOPIC', type=_topic, default=list(REPORT_TOPICS),
        help='what to record; by default what msg_docs/bags.md lists')
    parser.add_argument(
        '--duration', type=positive, metavar='S', help='end after so long; otherwise at Ctrl-C')
    parser.add_argument('--compress', action='store_true', help='compress with zstd')
    parser.add_argument(
        '--ros-args', nargs=argparse.REMAINDER, default=[],
        help='further ROS arguments, such as -r __ns:=/front or -p use_sim_time:=true')


def main(args: argparse.Namespace) -> int:
    """Record until Ctrl-C or the end of the time; return the exit code."""
    with noted_interrupts() as stopping, ros_context(['--ros-args', *args.ros_args]):
        node = Node('bag_recorder')
        executor = SingleThreadedExecutor()
        try:
            executor.add_node(node)
            with BagWriter(args.output, compress=args.compress) as writer:
                recorder = BagRecorder(node, writer, args.topics)
                print(f'recording {args.output} until Ctrl-C', flush=True)
                end_s = time.monotonic() + (args.duration or float('inf'))
                while not stopping.is_set() and time.monotonic() < end_s:
                    executor.spin_once(timeout_sec=_POLL_S)
        finally:
            executor.shutdown()
            node.destroy_node()
    for topic, count in sorted(recorder.counts.items()):
        print(f'{count:7d}  {topic}')
    for fault in recorder.left_out:
        print(f'depth_person record: left out {fault}', file=sys.stderr)
    if not recorder.counts:
        print('depth_person record: no message came; are the nodes running, in the same '
              'ROS_DOMAIN_ID, and /clock where use_sim_time is true?', file=sys.stderr)
    return _PARTLY if recorder.left_out or not recorder.counts else 0


def _topic(name: str) -> str:
    """Return the name of a topic, as a type for argparse."""
    try:
        validate_full_topic_name(expand_topic_name(name, 'bag_recorder', '/'))
    except (InvalidTopicNameException, ValueError) as error:
        raise argparse.ArgumentTypeError(str(error).partition('\n')[0]) from error
    return name
