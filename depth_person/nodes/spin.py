"""Runs nodes until Ctrl-C, SIGTERM or the end of the source, and closes them in order."""
from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
import os
from pathlib import Path
import sys
import threading
from typing import Any

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions

from depth_person.errors import DepthPersonError
from depth_person.interrupts import noted_interrupts
from depth_person.nodes.base import StageNode

# How soon a signal is seen: rclpy waits in C, where Python's signal handlers do not run.
_POLL_S = 0.2


def run_nodes(
    make_nodes: Callable[[], Sequence[StageNode[Any]]], args: Sequence[str] | None = None,
) -> None:
    """
    Run nodes in this process until they have finished or a signal comes.

    :param make_nodes: called once ROS is up; returns the nodes in the order in which they are
        started, which is the reverse of that in which they are closed.
    :param args: ROS arguments; None for those of the command line.
    :raises DepthPersonError: when a node cannot be made.
    """
    with noted_interrupts() as stop, ros_context(args):
        nodes: Sequence[StageNode[Any]] = []
        executor = SingleThreadedExecutor()
        try:
            nodes = make_nodes()
            for node in nodes:
                executor.add_node(node)
                node.start()
                node.get_logger().info(
                    f'{node.get_name()} is up{"" if node.active else ", and unconfigured"}')
            while not stop.is_set() and not any(node.finished for node in nodes):
                executor.spin_once(timeout_sec=_POLL_S)
                for node in nodes:
                    node.raise_failure()
        except ExternalShutdownException:
            pass  # someone else has shut this context down, which is a way to end
        finally:
            for node in reversed(nodes):
                node.close()
            executor.shutdown()
            for node in nodes:
                node.destroy_node()


def run_alone(make_node: Callable[[], StageNode[Any]]) -> int:
    """Run one node as an executable; return the exit code."""
    try:
        run_nodes(lambda: [make_node()])
    except DepthPersonError as error:
        print(f'{Path(sys.argv[0]).name}: {error}', file=sys.stderr)
        return 1
    return leave(0)


def leave(code: int) -> int:
    """
    Return the exit code, or end the process with it if a driver still holds a thread.

    OpenCV may wait for a camera or stream beyond any time-out; the interpreter's orderly end
    would tear such a thread down and abort.
    """
    if any(thread.daemon for thread in threading.enumerate()):
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
    return code


@contextmanager
def ros_context(args: Sequence[str] | None) -> Iterator[None]:
    """
    Bring ROS up for the block, without its signal handlers.

    :param args: ROS arguments; None for those of the command line.
    :raises DepthPersonError: when the arguments cannot be used.
    """
    try:
        rclpy.init(
            args=None if args is None else list(args),
            signal_handler_options=SignalHandlerOptions.NO)
    except Exception as error:  # rclpy's own types for this are private
        reason = str(error).partition(', at /')[0]
        raise DepthPersonError(f'the ROS arguments cannot be used: {reason}') from error
    try:
        yield
    finally:
        rclpy.try_shutdown()
