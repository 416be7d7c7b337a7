"""Diagnostics come once a second, and at once when something changes."""
import time

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
import pytest
import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from depth_person.nodes import diagnostics_output
from depth_person.nodes.diagnostics_output import DiagnosticsOutput
from depth_person.nodes.monitor import Level, Monitor


class Harness:
    """A node that publishes diagnostics, and what came of them."""

    def __init__(self, number):
        self.context = Context()
        rclpy.init(context=self.context, domain_id=number)
        self.node = Node('sick', context=self.context)
        self.monitor = Monitor(lambda *_: None)
        self.arrived = []
        self.node.create_subscription(
            DiagnosticArray, '/diagnostics',
            lambda array: self.arrived.append(array.status[0]), 50)
        self.output = DiagnosticsOutput(self.node, self.monitor, check=lambda: None)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)

    def spin(self, seconds):
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            self.executor.spin_once(timeout_sec=0.02)

    def spin_until(self, done):
        deadline = time.monotonic() + 60
        while not done():
            assert time.monotonic() < deadline
            self.executor.spin_once(timeout_sec=0.02)

    def close(self):
        self.executor.shutdown()
        self.node.destroy_node()
        rclpy.try_shutdown(context=self.context)


@pytest.fixture(scope='module')
def running(shared_domain):
    result = Harness(shared_domain.number)
    result.spin_until(lambda: result.arrived)
    yield result
    result.close()


@pytest.fixture
def harness(running):
    running.monitor.clear('a')
    running.spin(0.2)
    running.arrived.clear()
    return running


@pytest.fixture
def patient(domain, monkeypatch):
    """Return a node whose diagnostics come at changes only."""
    monkeypatch.setattr(diagnostics_output, '_PERIOD_S', 3600.0)
    result = Harness(domain.number)

    def heard():
        result.monitor.fault('a', Level.WARN, 'flutters')
        result.monitor.clear('a')
        return result.arrived

    result.spin_until(heard)
    result.spin(0.3)
    yield result
    result.close()


def test_once_a_second_while_nothing_changes(harness):
    seconds = []
    timer = harness.node.create_timer(1.0, lambda: seconds.append(1))  # a busy machine delays both
    harness.spin_until(lambda: len(seconds) == 4)
    harness.spin(0.1)
    harness.node.destroy_timer(timer)
    assert 3 <= len(harness.arrived) <= 5


def test_a_fault_and_its_end_come_without_waiting_for_the_second(patient):
    for act, level in ((lambda: patient.monitor.fault('a', Level.ERROR, 'broken'), 2),
                       (lambda: patient.monitor.clear('a'), 0)):
        patient.arrived.clear()
        act()
        patient.spin_until(
            lambda: patient.arrived and patient.arrived[-1].level == bytes([level]))  # noqa: B023


def test_a_fault_that_comes_and_goes_is_not_published_every_time_but_its_last_state_is(harness):
    began = time.monotonic()
    for _ in range(40):
        harness.monitor.fault('a', Level.WARN, 'flutters')
        harness.monitor.clear('a')
        harness.spin(0.01)
    harness.monitor.fault('a', Level.WARN, 'flutters')
    harness.spin(0.3)
    assert len(harness.arrived) < 4 + 10 * (time.monotonic() - began)
    harness.spin_until(lambda: harness.arrived and harness.arrived[-1].message == 'flutters')


def test_a_fault_that_only_counts_on_is_no_change(patient):
    patient.arrived.clear()
    for second in range(40):
        patient.monitor.fault('a', Level.WARN, f'silent for {second} s')
        patient.spin(0.01)
    patient.spin_until(lambda: patient.arrived)
    patient.spin(0.3)
    assert len(patient.arrived) == 1
    assert patient.monitor.status('n').level == DiagnosticStatus.WARN
