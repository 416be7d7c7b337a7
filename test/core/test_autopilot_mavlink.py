"""MAVLink over loopback: every message, field by field, and peers that are gone or flood."""
from contextlib import contextmanager
import math
import os
import threading
import time
import tty

from autopilot_double import AutopilotDouble, dialect
import numpy as np
import pytest
from senders import free_port

from depth_person.autopilot import mavlink_messages
from depth_person.autopilot.geodesy import ned_from_body, Place
from depth_person.autopilot.mavlink_link import MavlinkLink
from depth_person.autopilot.mavlink_messages import Companion
from depth_person.autopilot.mavlink_peer import Peer, PeerClock
from depth_person.autopilot.mavlink_transport import Connection, parse_connection
from depth_person.autopilot.scan import centimetres
from depth_person.errors import DepthPersonError
from depth_person.settings.mavlink import MavlinkSettings

COMPANION = {'system_id': 1, 'component_id': 196, 'follow_system_id': 200}
SECOND = 1_000_000_000


class Wire:
    """A link to a double, running."""

    def __init__(self, double, connection=None):
        self.double = double
        self.companion = Companion(**COMPANION)
        self.peer = Peer(1)
        self.link = MavlinkLink(
            connection or parse_connection(f'udpout:127.0.0.1:{double.port}'), self.companion,
            self.peer, now_ns=time.time_ns)

    def arrives(self, *packets):
        """Send packets; return the messages of the last one's type that come out."""
        self.double.listen_until(lambda: self.link.send(packets))
        expected = dialect.MAVLink(None).parse_buffer(packets[-1])[0].get_type()
        self.double.listen_until(lambda: len(self.double.of(expected)) >= len(packets))
        return self.double.of(expected)


@contextmanager
def running(link):
    stopping = threading.Event()
    thread = threading.Thread(target=link.run, args=[stopping])
    thread.start()
    try:
        yield
    finally:
        stopping.set()
        thread.join()


@pytest.fixture
def double():
    result = AutopilotDouble()
    yield result
    result.close()


@pytest.fixture
def wire(double):
    result = Wire(double)
    with running(result.link):
        yield result


def test_obstacle_distance(wire):
    ranges = np.full(72, np.nan, np.float32)
    ranges[[0, 18, 66, 36]] = centimetres([4.32, 0.2, 29.99, 30.02])
    message, = wire.arrives(wire.companion.obstacle_distance(
        ranges, stamp_ns=7 * SECOND + 123_456_789, range_min=np.float32(0.2),
        range_max=np.float32(30.0)))
    expected = [65535] * 72
    expected[0], expected[18], expected[66], expected[36] = 432, 20, 2999, 3002
    assert message.get_srcSystem() == 1
    assert message.get_srcComponent() == 196
    assert message.to_dict() == {
        'mavpackettype': 'OBSTACLE_DISTANCE', 'time_usec': 7_123_456,
        'sensor_type': dialect.MAV_DISTANCE_SENSOR_UNKNOWN, 'distances': expected,
        'increment': 5, 'increment_f': 5.0, 'min_distance': 20, 'max_distance': 3000,
        'angle_offset': 0.0, 'frame': dialect.MAV_FRAME_BODY_FRD}


def test_obstacles_3d_are_one_set_of_one_stamp(wire):
    people = [(3, np.array([4.0, -1.5, 0.25])), (65535 + 4, np.array([8.0, 2.0, -0.5]))]
    messages = wire.arrives(*wire.companion.obstacles_3d(
        people, boot_ms=2**32 + 5000, range_min=0.25, range_max=30.0))
    told = [message.to_dict() for message in messages]
    common = {
        'mavpackettype': 'OBSTACLE_DISTANCE_3D', 'time_boot_ms': 5000,
        'sensor_type': dialect.MAV_DISTANCE_SENSOR_UNKNOWN,
        'frame': dialect.MAV_FRAME_BODY_FRD, 'min_distance': 0.25, 'max_distance': 30.0}
    assert told == [
        {**common, 'obstacle_id': 3, 'x': 4.0, 'y': -1.5, 'z': 0.25},
        {**common, 'obstacle_id': 4, 'x': 8.0, 'y': 2.0, 'z': -0.5}]


def test_follow_target_comes_from_a_system_of_its_own(wire):
    message, = wire.arrives(wire.companion.follow_target(
        Place(-47.39774, 8.545594, 488.5), boot_ms=12_345, sigma_horizontal=0.75,
        sigma_vertical=0.25))
    assert message.get_srcSystem() == 200
    assert message.to_dict() == {
        'mavpackettype': 'FOLLOW_TARGET', 'timestamp': 12_345, 'est_capabilities': 1,
        'lat': -473_977_400, 'lon': 85_455_940, 'alt': 488.5, 'vel': [0.0, 0.0, 0.0],
        'acc': [0.0, 0.0, 0.0], 'attitude_q': [1.0, 0.0, 0.0, 0.0], 'rates': [0.0, 0.0, 0.0],
        'position_cov': [0.75, 0.25, 0.0], 'custom_state': 0}


def test_heartbeats_come_once_a_second_by_themselves(wire):
    came_s = []
    while len(came_s) < 4:
        wire.double.listen_until(lambda: len(wire.double.of('HEARTBEAT')) > len(came_s))
        came_s.append(time.monotonic())
    assert np.median(np.diff(came_s)) == pytest.approx(1.0, abs=0.3)
    message = wire.double.of('HEARTBEAT')[0]
    assert message.get_srcComponent() == 196
    assert message.to_dict() == {
        'mavpackettype': 'HEARTBEAT', 'type': dialect.MAV_TYPE_ONBOARD_CONTROLLER,
        'autopilot': dialect.MAV_AUTOPILOT_INVALID, 'base_mode': 0, 'custom_mode': 0,
        'system_status': dialect.MAV_STATE_ACTIVE, 'mavlink_version': 3}


def test_time_is_asked_for_answered_and_learned(wire):
    double = wire.double
    double.listen_until(lambda: wire.peer.clock.boot_ns is not None and abs(
        wire.peer.clock.boot_ns - double.boot_ns) < 0.05 * SECOND)
    stamp_ns = double.boot_ns + 1234 * SECOND
    assert abs(wire.peer.boot_ms(stamp_ns, else_boot_ns=0) - 1_234_000) < 50
    asked_ns = time.time_ns()
    double.send(dialect.MAVLink_timesync_message(0, 4711))
    double.listen_until(lambda: [
        message for message in double.of('TIMESYNC') if message.ts1 == 4711])
    answer, = [message for message in double.of('TIMESYNC') if message.ts1 == 4711]
    assert asked_ns <= answer.tc1 <= time.time_ns()


def test_sequence_numbers_rise_for_each_system(wire):
    wire.arrives(wire.companion.follow_target(
        Place(1.0, 2.0, 3.0), boot_ms=1, sigma_horizontal=1, sigma_vertical=1))
    messages = wire.arrives(*[wire.companion.heartbeat() for _ in range(5)])
    numbers = [message.get_seq() for message in messages]
    assert numbers == sorted(set(numbers))
    assert wire.double.of('FOLLOW_TARGET')[0].get_seq() == 0


def test_a_fastest_answer_counts_and_a_restart_is_seen():
    clock = PeerClock()
    for asked, delay, told in ((10, 4, 3), (20, 1, 11), (30, 6, 23)):
        clock.ask(asked * SECOND)
        clock.take_answer(
            tc1=told * SECOND, ts1=asked * SECOND, now_ns=(asked + delay) * SECOND)
    assert clock.boot_ns == 9.5 * SECOND
    clock.take_answer(tc1=1, ts1=12345, now_ns=40 * SECOND)  # not our question
    assert clock.boot_ns == 9.5 * SECOND
    clock.ask(50 * SECOND)
    clock.take_answer(tc1=2 * SECOND, ts1=50 * SECOND, now_ns=50 * SECOND)
    assert clock.boot_ns == 48 * SECOND


def test_a_peer_is_alive_while_its_heartbeats_come(wire):
    double = wire.double
    double.listen_until(lambda: double.peer)
    assert not wire.peer.alive(time.time_ns())
    assert wire.peer.silent_s(time.time_ns()) is None
    sent_ns = time.time_ns()
    double.heartbeat()
    double.listen_until(lambda: wire.peer.alive(time.time_ns()))
    assert wire.peer.alive(sent_ns + 2 * SECOND)
    assert not wire.peer.alive(time.time_ns() + 4 * SECOND)
    assert not wire.peer.alive(time.time_ns() - 60 * SECOND)  # a clock that jumps back


def test_what_others_say_is_not_taken_for_the_vehicle():
    double = AutopilotDouble(system_id=2)
    wire = Wire(double)
    with running(wire.link):
        double.listen_until(lambda: double.peer)
        double.heartbeat()
        double.send_bytes(b'no mavlink at all')
        double.listen_until(lambda: wire.link.foreign and wire.link.damaged)
    assert wire.link.received == 0
    assert not wire.peer.alive(time.time_ns())
    double.close()


def test_a_link_that_listens_answers_only_to_the_vehicle(double):
    stranger = AutopilotDouble(system_id=77)
    port = free_port()
    wire = Wire(double, parse_connection(f'udpin:127.0.0.1:{port}'))
    with running(wire.link):
        double.peer = stranger.peer = ('127.0.0.1', port)
        deadline = time.monotonic() + 10
        while not double.of('HEARTBEAT') and time.monotonic() < deadline:
            stranger.heartbeat()
            double.heartbeat()
            double.listen()
            stranger.listen()
    assert double.of('HEARTBEAT')
    assert not stranger.heard
    stranger.close()


def test_a_flood_is_heard_in_part_and_named(wire):
    double = wire.double
    double.listen_until(lambda: double.peer)
    noise = os.urandom(8000)
    deadline = time.monotonic() + 10
    while not wire.link.flooded and time.monotonic() < deadline:
        double.send_bytes(noise)
    assert wire.link.flooded
    assert wire.link.dropped > 0
    before = len(double.of('HEARTBEAT'))
    double.listen_until(lambda: len(double.of('HEARTBEAT')) > before)  # it still lives
    # Noise may end in what looks like the beginning of a message, which swallows some more.
    double.listen_until(lambda: double.heartbeat() or wire.peer.alive(time.time_ns()))
    double.listen_until(lambda: not wire.link.flooded)


def test_a_serial_line_carries_both_ways():
    controller, line = os.openpty()
    tty.setraw(line)
    os.set_blocking(controller, False)
    name = os.ttyname(line).replace('/dev/', '')
    companion, peer = Companion(**COMPANION), Peer(1)
    link = MavlinkLink(
        parse_connection(f'/dev/{name},57600'), companion, peer, now_ns=time.time_ns)
    parser, heard = dialect.MAVLink(None), []
    parser.robust_parsing = True
    vehicle = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
    with running(link):
        deadline = time.monotonic() + 10
        while not (heard and peer.alive(time.time_ns())) and time.monotonic() < deadline:
            os.write(controller, dialect.MAVLink_heartbeat_message(2, 3, 0, 0, 4, 3).pack(vehicle))
            time.sleep(0.05)
            try:
                heard += parser.parse_buffer(os.read(controller, 4096)) or []
            except BlockingIOError:
                continue
    os.close(controller)
    os.close(line)
    assert peer.alive(time.time_ns())
    assert heard
    assert {message.get_type() for message in heard} <= {'HEARTBEAT', 'TIMESYNC'}


def test_a_line_that_is_not_there_is_named_and_nothing_is_sent():
    companion = Companion(**COMPANION)
    link = MavlinkLink(
        Connection('serial', '/dev/no_such_line', 57600), companion, Peer(1),
        now_ns=time.time_ns)
    with running(link):
        deadline = time.monotonic() + 5
        while 'no_such_line' not in link.problem and time.monotonic() < deadline:
            time.sleep(0.01)
        assert 'no_such_line' in link.problem
        assert not link.send([companion.heartbeat()])


@pytest.mark.parametrize(('text', 'expected'), [
    ('udpout:10.0.0.2:14550', Connection('udpout', '10.0.0.2', 14550)),
    ('udpin:0.0.0.0:14540', Connection('udpin', '0.0.0.0', 14540)),
    ('udp:0.0.0.0:14540', Connection('udpin', '0.0.0.0', 14540)),
    ('/dev/ttyAMA0,921600', Connection('serial', '/dev/ttyAMA0', 921600)),
    ('/dev/ttyACM0', Connection('serial', '/dev/ttyACM0', 115200))])
def test_connections_are_written_as_in_pymavlink(text, expected):
    assert parse_connection(text) == expected


@pytest.mark.parametrize('text', [
    '', 'udpout:', 'udpout:host', 'udpout:host:0', 'udpout:host:99999', 'tcp:host:5760',
    '14550', '/dev/ttyAMA0,fast'])
def test_a_connection_that_is_none(text):
    with pytest.raises(DepthPersonError, match='connection'):
        parse_connection(text)


@pytest.mark.parametrize(('wrong', 'said'), [
    ({'connection': 'tcp:host:5760'}, 'is not of the form'),
    ({'follow_system_id': 1}, 'do not follow themselves'),
    ({'scan_range_min': 5.0, 'scan_range_max': 4.0}, 'not within')])
def test_settings_that_do_not_go_together(wrong, said):
    with pytest.raises(DepthPersonError, match=said):
        MavlinkSettings(**wrong)


def test_without_pymavlink_it_says_what_to_install(monkeypatch):
    def absent(name):
        raise ImportError(f'No module named {name!r}')

    monkeypatch.setattr(mavlink_messages, 'import_module', absent)
    with pytest.raises(DepthPersonError, match=r'pip install .depth_person\[mavlink\]'):
        Companion(**COMPANION)


def test_a_place_is_as_far_as_it_was_moved():
    place = Place(47.0, 8.0, 500.0).moved(1000.0, -2000.0, 30.0)
    # A degree of latitude at 47 degrees is 111,173 m, one of longitude 76,057 m (WGS84).
    assert (place.latitude - 47) * 111_173 == pytest.approx(1000.0, rel=1e-4)
    assert (place.longitude - 8) * 76_057 == pytest.approx(-2000.0, rel=1e-4)
    assert place.altitude == 470.0
    assert Place(0.0, 179.9999, 0.0).moved(0.0, 100.0, 0.0).longitude < -179.99


@pytest.mark.parametrize(('roll', 'pitch', 'yaw', 'seen', 'expected'), [
    (0, 0, 90, (10, 0, 0), (0, 10, 0)), (0, 0, 0, (0, 5, 0), (0, 5, 0)),
    (0, 30, 0, (10, 0, 0), (8.660, 0, -5)), (90, 0, 0, (0, 3, 0), (0, 0, 3)),
    (0, 90, 90, (10, 0, 0), (0, 0, -10))])
def test_attitudes_turn_the_body_as_mavlink_says(roll, pitch, yaw, seen, expected):
    rotation = ned_from_body(
        roll=math.radians(roll), pitch=math.radians(pitch), yaw=math.radians(yaw))
    assert rotation @ seen == pytest.approx(expected, abs=1e-3)


@pytest.mark.parametrize('message', [
    dialect.MAVLink_attitude_message(0, math.inf, 0, 0, 0, 0, 0),
    dialect.MAVLink_attitude_message(0, 0, 0, math.nan, 0, 0, 0),
    dialect.MAVLink_global_position_int_message(
        0, 2**31 - 1, 80_000_000, 500_000, 0, 0, 0, 0, 0)])
def test_what_no_vehicle_can_be_at_is_passed_over(message):
    peer = Peer(1)
    peer.take(dialect.MAVLink_attitude_message(0, 0, 0, 0, 0, 0, 0), SECOND)
    peer.take(dialect.MAVLink_global_position_int_message(
        0, 470_000_000, 80_000_000, 500_000, 0, 0, 0, 0, 0), SECOND)
    peer.take(message, 2 * SECOND)
    place, rotation = peer.place_of(np.zeros(3), SECOND * 5 // 4)
    assert (place.latitude, place.longitude) == pytest.approx((47.0, 8.0))
    assert rotation == pytest.approx(np.eye(3))
    assert peer.place_of(np.zeros(3), 2 * SECOND) is None


def test_the_limits_of_any_scan_can_be_sent():
    packet = Companion(**COMPANION).obstacle_distance(
        np.full(72, np.nan, np.float32), stamp_ns=SECOND, range_min=math.nan, range_max=math.inf)
    message, = dialect.MAVLink(None).parse_buffer(packet)
    assert (message.min_distance, message.max_distance) == (0, 65534)


def test_a_speed_that_a_serial_line_cannot_have_is_a_problem_of_the_line():
    controller, line = os.openpty()
    with pytest.raises(OSError, match='takes no 99999999999 baud'):
        Connection('serial', os.ttyname(line), 99_999_999_999).open()
    os.close(controller)
    os.close(line)


def test_a_target_is_placed_by_where_the_vehicle_was_when_it_was_seen():
    peer = Peer(1)
    stamp_ns = 100 * SECOND

    def attitude(yaw_deg):
        return dialect.MAVLink_attitude_message(0, 0, 0, math.radians(yaw_deg), 0, 0, 0)

    peer.take(attitude(90), stamp_ns - SECOND // 10)
    peer.take(attitude(180), stamp_ns + SECOND // 5)
    assert peer.place_of(np.array([10.0, 0, 0]), stamp_ns) is None  # no position yet
    peer.take(dialect.MAVLink_global_position_int_message(
        0, 0, 0, 0, 0, 0, 0, 0, 0), stamp_ns)
    assert peer.place_of(np.array([10.0, 0, 0]), stamp_ns) is None  # no fix
    peer.take(dialect.MAVLink_global_position_int_message(
        0, 470_000_000, 80_000_000, 500_000, 0, 200, 0, -100, 0), stamp_ns - SECOND // 5)
    place, _ = peer.place_of(np.array([10.0, 0.0, 2.0]), stamp_ns)
    # Facing east, 10 m ahead and 2 m below; flown 0.4 m north and 0.2 m up since.
    assert (place.latitude - 47) * 111_173 == pytest.approx(0.4, abs=0.02)
    assert (place.longitude - 8) * 76_057 == pytest.approx(10.0, abs=0.02)
    assert place.altitude == pytest.approx(498.2)
    assert peer.place_of(np.array([10.0, 0, 0]), stamp_ns + SECOND) is None  # too long ago
