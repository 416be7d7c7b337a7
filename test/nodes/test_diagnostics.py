"""Diagnostics come once a second, and at once when something changes."""
import time

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
import pytest
import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from depth_person.nodes.diagnostics_output import DiagnosticsOutput
from depth_person.nodes.monitor import Level, Monitor


class Harness:
    """A node that publishes diagnostics, and when each came."""

    def __init__(self, number):
        self.context = Context()
        rclpy.init(context=self.context, domain_id=number)
        self.node = Node('sick', context=self.context)
        self.monitor = Monitor(lambda *_: None)
        self.arrived = []
        self.node.create_subscription(
            DiagnosticArray, '/diagnostics',
            lambda array: self.arrived.append((time.monotonic(), array.status[0])), 50)
        self.output = DiagnosticsOutput(self.node, self.monitor, check=lambda: None)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)

    def spin(self, seconds):
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            self.executor.spin_once(timeout_sec=0.02)

    def close(self):
        self.executor.shutdown()
        self.node.destroy_node()
        rclpy.try_shutdown(context=self.context)


@pytest.fixture(scope='module')
def running(shared_domain):
    result = Harness(shared_domain.number)
    result.spin(1.5)  # until the subscription has been found
    yield result
    result.close()


@pytest.fixture
def harness(running):
    running.monitor.clear('a')
    running.spin(0.2)
    running.arrived.clear()
    return running


def test_once_a_second_while_nothing_changes(harness):
    harness.spin(3.2)
    assert 2 <= len(harness.arrived) <= 4


def test_a_fault_and_its_end_come_at_once(harness):
    for act, level in ((lambda: harness.monitor.fault('a', Level.ERROR, 'broken'), 2),
                       (lambda: harness.monitor.clear('a'), 0)):
        harness.arrived.clear()
        began = time.monotonic()
        act()
        while not (harness.arrived and harness.arrived[-1][1].level == bytes([level])):
            harness.spin(0.02)
            assert time.monotonic() - began < 0.6
        harness.spin(0.2)


def test_a_fault_that_comes_and_goes_is_not_published_every_time_but_its_last_state_is(harness):
    began = time.monotonic()
    for _ in range(40):
        harness.monitor.fault('a', Level.WARN, 'flutters')
        harness.monitor.clear('a')
        harness.spin(0.01)
    harness.monitor.fault('a', Level.WARN, 'flutters')
    harness.spin(0.3)
    assert len(harness.arrived) < 4 + 10 * (time.monotonic() - began)
    assert harness.arrived[-1][1].message == 'flutters'


def test_a_fault_that_only_counts_on_is_no_change(harness):
    harness.monitor.fault('a', Level.WARN, 'silent for 0 s')
    harness.spin(0.3)
    harness.arrived.clear()
    for second in range(1, 40):
        harness.monitor.fault('a', Level.WARN, f'silent for {second} s')
        harness.spin(0.01)
    assert len(harness.arrived) <= 2
    assert harness.monitor.status('n').level == DiagnosticStatus.WARN
