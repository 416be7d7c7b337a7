"""Publishes a recorded bag in its time, as `ros2 bag play` does."""
from __future__ import annotations

import argparse
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
import sys
import threading
import time

from rclpy.exceptions import InvalidTopicNameException
from rclpy.node import Node

from depth_person.camera.bag import BagReader
from depth_person.errors import DepthPersonError
from depth_person.interrupts import noted_interrupts
from depth_person.nodes.bag_player import BagPlayer, PlayOptions
from depth_person.nodes.spin import ros_context
from depth_person.nodes.subscribers import wait_for_delivery

#: How often /clock is published where --clock does not say.
_CLOCK_HZ = 40.0
#: How long slow subscribers are waited for at the end, seconds.
_FAREWELL_S = 2.0
#: How soon the end is seen, seconds.
_POLL_S = 0.05
#: The exit code where something was left out.
_PARTLY = 3


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's arguments."""
    parser.epilog = (
        'exit code: 0 everything was published, or Ctrl-C; 1 nothing could be; 3 something in the '
        'bag could not be read or published, which is named')
    parser.add_argument(
        'bag', type=Path, metavar='BAG', help='a folder, .mcap, .db3, or a ROS 1 .bag')
    parser.add_argument(
        '--rate', type=float, default=1.0, metavar='R', help='how much faster (default 1)')
    parser.add_argument(
        '--loop', action='store_true', help='start over at the end; stamps then jump back')
    parser.add_argument(
        '--clock', type=float, nargs='?', const=_CLOCK_HZ, default=0.0, metavar='HZ',
        help='publish /clock, for nodes with use_sim_time; at least so often (default '
             f'{_CLOCK_HZ:g}), and before every message')
    parser.add_argument(
        '--topics', nargs='+', default=[], metavar='TOPIC', help='only these')
    parser.add_argument(
        '--wait', action='store_true',
        help='begin when someone subscribes, and for two seconds nobody else has come')
    parser.add_argument(
        '--ros-args', nargs=argparse.REMAINDER, default=[],
        help='further ROS arguments, such as -r /image_raw:=/front/image_raw')


def main(args: argparse.Namespace) -> int:
    """Play until the end or Ctrl-C; return the exit code."""
    options = PlayOptions(
        rate=args.rate, loop=args.loop, clock_hz=args.clock, topics=tuple(args.topics),
        wait=args.wait)
    with BagReader(args.bag) as reader, noted_interrupts() as stopping, \
            ros_context(['--ros-args', *args.ros_args]):
        node = Node('bag_player')
        try:
            player = _player(node, reader, options, stopping)
            print(f'playing {args.bag}', flush=True)
            _play(player)
            wait_for_delivery(node.publishers, timeout_s=_FAREWELL_S)
            faults = [*player.left_out, *player.mismatches(), *filter(None, [reader.damage])]
        finally:
            node.destroy_node()
        faults += [f'{count} messages on {topic} cannot be unpacked'
                   for topic, count in reader.undecodable.items()]
    print(player.summary())
    for fault in faults:
        print(f'depth_person play: {fault}', file=sys.stderr)
    return _PARTLY if faults else 0


def _player(
    node: Node, reader: BagReader, options: PlayOptions, stopping: threading.Event,
) -> BagPlayer:
    known = reader.topics
    topics = tuple(
        name if name in known else '/' + name.lstrip('/') for name in options.topics)
    try:
        return BagPlayer(node, reader, replace(options, topics=topics), stopping)
    except InvalidTopicNameException as error:  # not all bags were recorded by ROS
        said = ' '.join(str(error).split()).rstrip('^ ')
        raise DepthPersonError(f'{reader.path}: {said}; choose others by --topics') from error


def _play(player: BagPlayer) -> None:
    """Play in a thread of its own: a signal must not strike one that waits for its event."""
    with ThreadPoolExecutor(1) as thread:
        playing = thread.submit(player.play)
        while not playing.done():
            time.sleep(_POLL_S)
        playing.result()
