"""The age of results: judged by hand-worked cases, and bounded in a running depth_node."""
import itertools
import time

from depth_harness import camera_info, DepthNode, FACE_TO_FACE, keypoints, RELIABLE
import pytest
from sensor_msgs.msg import LaserScan, PointCloud2
from visualization_msgs.msg import MarkerArray

from depth_person.nodes.monitor import Level, Monitor
from depth_person.nodes.watchdog import Age, Watchdog

NOW = 1_700_000_000 * 10**9


@pytest.mark.parametrize(('age_s', 'max_age_s', 'judged', 'level'), [
    (0.0, 0.4, Age.FRESH, Level.OK),
    (0.399, 0.4, Age.FRESH, Level.OK),
    (0.401, 0.4, Age.STALE, Level.ERROR),
    (59.0, 0.4, Age.STALE, Level.ERROR),
    (61.0, 0.4, Age.UNKNOWN, Level.WARN),
    (1e9, 0.4, Age.UNKNOWN, Level.WARN),
    (-0.3, 0.4, Age.FRESH, Level.OK),  # clocks are never quite the same
    (-0.5, 0.4, Age.UNKNOWN, Level.WARN),
    (-1.7e9, 0.4, Age.UNKNOWN, Level.WARN),  # sim time before the first /clock
    (30.0, 0.0, Age.FRESH, Level.OK),
    (1e9, 0.0, Age.FRESH, Level.OK),
])
def test_an_age_is_judged(age_s, max_age_s, judged, level):
    monitor = Monitor(lambda *_: None)
    stamp_ns = NOW - round(age_s * 1e9)
    assert Watchdog(monitor).judge(
        stamp_ns=stamp_ns, now_ns=NOW, max_age_s=max_age_s) is judged
    assert monitor.status('n').level == level.value


def test_the_first_fresh_result_mends_it_and_the_count_stays():
    monitor = Monitor(lambda *_: None)
    watchdog = Watchdog(monitor)
    for age_ms in (900, 900, 30):
        watchdog.judge(stamp_ns=NOW - age_ms * 10**6, now_ns=NOW, max_age_s=0.4)
    status = monitor.status('n')
    assert status.message == 'running'
    assert ('results dropped for their age', '2') in [
        (pair.key, pair.value) for pair in status.values]


@pytest.mark.parametrize(('passed_s', 'stamps_s', 'jump'), [
    (0.1, (10.0, 10.1, 9.9, 10.3), ''),  # one is late
    (0.1, (10.0, 10.1, 3.0, 3.1), 'jumped by -7.1 s'),  # a bag begins anew
    (0.1, (10.0, 10.1, 3600.0, 3600.1), 'jumped by 3589.9 s'),  # the clock is set
    (5.0, (10.0, 15.0, 20.0, 25.0), ''),  # slow, but in time
])
def test_stamps_that_jump_are_named_once(passed_s, stamps_s, jump):
    monitor = Monitor(lambda *_: None)
    watchdog = Watchdog(monitor, clock=itertools.count(0.0, passed_s).__next__)
    said = []
    for seconds in stamps_s:
        watchdog.judge(stamp_ns=round(seconds * 1e9), now_ns=NOW, max_age_s=0.0)
        said.append(monitor.status('n').message)
    assert said[:2] == ['running'] * 2
    assert jump in said[2]
    assert (said[2] == 'running') == (not jump)
    assert said[3] == 'running'


def _stamp(message):
    first = message.markers[0] if isinstance(message, MarkerArray) else message
    return first.header.stamp


class Harness(DepthNode):
    """A depth_node, keypoints of any age, and what comes of them."""

    def __init__(self, domain):
        super().__init__(domain, *RELIABLE, outputs={
            'person_depth/people': PointCloud2, 'person_depth': MarkerArray,
            'person_depth/scan': LaserScan})
        self.camera_info.publish(camera_info())
        domain.spin_for(0.5)

    def send(self, age_s, wanted):
        """Return where people come in images of this age, sent until they do where wanted."""
        stamps, topics = [], set()

        def sent():
            cloud = keypoints(FACE_TO_FACE)
            stamp_ns = time.time_ns() - round(age_s * 1e9)
            cloud.header.stamp.sec, cloud.header.stamp.nanosec = divmod(stamp_ns, 10**9)
            stamps.append(cloud.header.stamp)
            self.keypoints.publish(cloud)
            self.domain.spin_for(0.5)
            topics.update(
                topic for topic, messages in self.outputs.items() if any(
                    _stamp(message) in stamps for message in messages))
            return topics >= wanted

        self.domain.spin_until(sent)
        return topics


def test_stale_results_are_dropped_and_those_of_another_clock_kept_from_autopilots(domain):
    harness = Harness(domain)
    everything = set(harness.outputs)
    unscanned = everything - {'person_depth/scan'}
    assert harness.send(0.0, everything) == everything
    assert harness.send(2.0, set()) == set()
    assert 'max_age' in domain.fault('depth_node', 'results are dropped').message
    assert harness.send(1e6, unscanned) == unscanned
    domain.fault('depth_node', 'the age of images is not known')
    assert harness.send(0.0, everything) == everything
    domain.status('depth_node', lambda status: 'past their stamps' not in status.message)
    assert domain.set_parameter('depth_node', 'max_age', 0.0).successful
    assert harness.send(2.0, everything) == everything
