"""What the diagnostics say."""
from diagnostic_msgs.msg import DiagnosticStatus
import pytest

from depth_person.nodes.monitor import Level, Monitor
from depth_person.nodes.traffic import Traffic

SECOND = 1_000_000_000


class Harness:
    """A monitor with a clock that only the test moves, and what it logged."""

    def __init__(self):
        self.time_s = 100.0
        self.logged = []
        self.monitor = Monitor(
            lambda level, text: self.logged.append((level, text)), clock=lambda: self.time_s)

    @property
    def figures(self):
        return {pair.key: pair.value for pair in self.monitor.status('n').values}


@pytest.fixture
def harness():
    return Harness()


def test_a_node_without_faults_is_running(harness):
    status = harness.monitor.status('front/depth_node')
    assert (status.name, status.level, status.message) == (
        'front/depth_node', DiagnosticStatus.OK, 'running')
    assert harness.figures['rate'] == '0.0 Hz'
    assert harness.figures['age of last frame'] == 'none yet'


def test_the_worst_fault_comes_first_and_gives_the_level(harness):
    harness.monitor.fault('a', Level.WARN, 'slow')
    harness.monitor.fault('b', Level.ERROR, 'broken')
    harness.monitor.fault('c', Level.WARN, 'dark')
    status = harness.monitor.status('n')
    assert (status.level, status.message) == (
        DiagnosticStatus.ERROR, 'broken; slow; dark')
    harness.monitor.clear('b')
    assert harness.monitor.status('n').level == DiagnosticStatus.WARN
    harness.monitor.clear('a')
    harness.monitor.clear('c')
    harness.monitor.clear('c')
    assert harness.monitor.status('n').level == DiagnosticStatus.OK


def test_a_fault_that_stays_is_logged_every_ten_seconds(harness):
    for tenth in range(251):
        harness.time_s = 100 + tenth / 10
        harness.monitor.fault('a', Level.WARN, f'silent for {tenth} s')
    assert [text for _, text in harness.logged] == [
        'silent for 0 s', 'silent for 100 s', 'silent for 200 s']


def test_a_fault_that_changes_is_logged_once_a_second_at_most(harness):
    for tenth in range(21):
        harness.time_s = 100 + tenth / 10
        harness.monitor.fault('a', Level.WARN, 'x' * tenth)
    assert [len(text) for _, text in harness.logged] == [0, 10, 20]


def test_the_rate_is_that_of_the_last_seconds_and_falls_when_frames_stop(harness):
    for _ in range(41):
        harness.monitor.frame()
        harness.time_s += 0.25
    harness.time_s -= 0.25
    assert harness.figures['rate'] == '4.0 Hz'
    harness.time_s += 5
    assert float(harness.figures['rate'].split()[0]) < 3
    assert harness.figures['age of last frame'] == '5.00 s'
    harness.time_s += 60
    assert harness.figures['rate'] == '0.0 Hz'


def test_percentiles_are_of_all_samples(harness):
    for milliseconds in range(101):
        harness.monitor.sample('inference', milliseconds / 1000)
    assert [harness.figures[f'inference {name}'] for name in ('median', 'p95', 'p99')] == [
        '50.0 ms', '95.0 ms', '99.0 ms']


def test_latency_is_from_stamp_to_now(harness):
    harness.monitor.latency(stamp_ns=5 * SECOND, now_ns=5 * SECOND + 30_000_000)
    assert harness.figures['latency median'] == '30.0 ms'


def test_stamps_of_another_time_have_no_latency_until_they_are_mended(harness):
    harness.monitor.latency(stamp_ns=0, now_ns=1_600_000_000 * SECOND)
    assert 'use_sim_time' in harness.figures['latency']
    assert 'latency median' not in harness.figures
    harness.monitor.latency(stamp_ns=0, now_ns=20_000_000)
    assert 'latency' not in harness.figures
    assert harness.figures['latency median'] == '20.0 ms'


def test_counts_add_up(harness):
    harness.monitor.count('bad images')
    harness.monitor.count('bad images', 2)
    assert harness.figures['bad images'] == '3'


@pytest.mark.parametrize(('publishers', 'shared', 'reported'), [
    (1, False, False), (2, False, True), (2, True, False), (0, False, False)])
def test_several_publishers_on_one_topic_are_named(harness, publishers, shared, reported):
    traffic = Traffic('/image_raw', harness.monitor, shared=shared)
    traffic.check(publishers=publishers)
    assert ('2 publishers send on /image_raw' in harness.monitor.status('n').message) == reported
    assert bool(traffic.crowded) == reported
    traffic.check(publishers=1)
    assert harness.monitor.status('n').message == 'running'


def test_what_lasts_is_not_forgotten_and_a_state_comes_before_all(harness):
    harness.monitor.fault('a', Level.WARN, 'misspelt', lasting=True)
    harness.monitor.fault('b', Level.WARN, 'no provider')
    harness.monitor.keep()
    harness.monitor.fault('c', Level.ERROR, 'broken')
    harness.monitor.forget()
    harness.monitor.set_state(Level.WARN, 'inactive')
    assert harness.monitor.status('n').message == 'inactive; misspelt; no provider'
    harness.monitor.set_state(Level.OK, '')
    harness.monitor.clear('b')
    assert harness.monitor.status('n').message == 'misspelt'


def test_changes_are_told_and_repetitions_are_not(harness):
    changes = []
    harness.monitor.on_change = lambda: changes.append(1)
    for second in range(5):
        harness.monitor.fault('a', Level.WARN, f'silent for {second} s')
    assert len(changes) == 1
    harness.monitor.fault('a', Level.ERROR, 'silent for 6 s')
    harness.monitor.clear('a')
    harness.monitor.clear('a')
    assert len(changes) == 3


@pytest.mark.parametrize(('received', 'lost', 'reported'), [
    (10, 0, False), (10, 1, False), (10, 2, True), (0, 1, True)])
def test_more_than_one_lost_message_in_ten_is_reported(harness, received, lost, reported):
    traffic = Traffic('/image_raw', harness.monitor, optional=False)
    for _ in range(received):
        traffic.receive()
    traffic.lose(lost)
    traffic.check(publishers=1)
    message = harness.monitor.status('n').message
    assert ('qos_overrides./image_raw.subscription.reliability' in message) == reported
    traffic.receive()
    traffic.check(publishers=1)
    assert harness.monitor.status('n').message == 'running'
