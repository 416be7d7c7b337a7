"""Our messages in the hands of MAVROS, ArduPilot and PX4, as they are documented."""
import math

import numpy as np
import pytest
from sensor_msgs.msg import Range
from std_msgs.msg import Header
from vehicle_doubles import ArduPilotProximity, mavros_converts, Px4CollisionPrevention, UNKNOWN

from depth_person.autopilot.choice import Target
from depth_person.autopilot.scan import scan, ScanOptions
from depth_person.autopilot.vehicle import CameraOnBody, LevelView
from depth_person.camera.intrinsics import Intrinsics
from depth_person.distance.estimator import Distances
from depth_person.distance.tracked import TrackedPeople
from depth_person.nodes.autopilot_messages import encode_nearest, encode_scan, encode_target
from depth_person.nodes.image_messages import header
from depth_person.pose.people import People

CAMERA = Intrinsics(1280, 720, 900.0, 900.0, 639.5, 359.5)
IMAGE = header(stamp_ns=7_123_456_789, frame_id='camera_optical_frame')
EXACT = ScanOptions(sigmas=0.0)


def ahead(*metres):
    """Return people in the middle of the image, of whom only the necks are known."""
    keypoints = np.full((len(metres), 18, 3), np.nan, np.float32)
    keypoints[:, 1] = 639.5, 359.5, 0.9
    position = np.array([(0.0, 0.0, metre) for metre in metres]).reshape(-1, 3)
    return TrackedPeople.unfiltered(
        People(keypoints, np.arange(len(metres), dtype=np.int32)), Distances.of(
            position=position, range_sigma=np.full(len(metres), 0.1),
            reason=np.zeros(len(metres), np.uint8), cues=np.ones(len(metres), np.uint8)))


def message_of(tracked, *, bearing_deg=0.0, options=EXACT):
    view = LevelView.of(CameraOnBody.mounted(yaw_right=math.radians(bearing_deg)), None)
    return encode_scan(
        scan(tracked, CAMERA, view, options), IMAGE, frame_id='base_link_frd', options=options)


def test_the_scan_is_what_mavros_takes():
    message = message_of(ahead(5.0))
    assert message.header == Header(stamp=IMAGE.stamp, frame_id='base_link_frd')
    assert len(message.ranges) == 72
    assert message.angle_min == 0.0
    assert math.degrees(message.angle_increment) == pytest.approx(5.0, abs=1e-6)
    assert math.degrees(message.angle_max) == pytest.approx(355.0, abs=1e-4)
    assert (message.range_min, message.range_max) == (np.float32(0.2), np.float32(30.0))
    assert (message.scan_time, message.time_increment, len(message.intensities)) == (0, 0, 0)


@pytest.mark.parametrize(('bearing', 'sector'), [(0, 0), (90, 2), (-30, 7), (180, 4)])
def test_bearings_land_in_ardupilots_sectors(bearing, sector):
    proximity = ArduPilotProximity()
    proximity.take(mavros_converts(message_of(ahead(5.0), bearing_deg=bearing)), now_s=0.0)
    assert proximity.sectors(now_s=0.0) == {sector: 5.0}


def test_silence_of_half_a_second_turns_ardupilots_sensor_unhealthy():
    proximity = ArduPilotProximity()
    assert not proximity.healthy(now_s=0.0)
    for now_s in np.arange(0.0, 2.0, 0.1):
        proximity.take(mavros_converts(message_of(ahead(5.0))), now_s)
    assert proximity.healthy(now_s=1.9 + 0.49)
    assert not proximity.healthy(now_s=1.9 + 0.51)


def test_who_has_left_is_forgotten_by_ardupilot_after_a_second_of_nobody():
    proximity = ArduPilotProximity()
    proximity.take(mavros_converts(message_of(ahead(5.0))), now_s=0.0)
    for now_s in np.arange(0.1, 1.2, 0.1):
        proximity.take(mavros_converts(message_of(ahead())), now_s)
        assert proximity.healthy(now_s)
    assert proximity.sectors(now_s=0.9) == {0: 5.0}
    assert proximity.sectors(now_s=1.1) == {}


def test_every_distance_survives_the_cast():
    options = ScanOptions(sigmas=0.0, range_min=0.29, range_max=655.0)
    for metres in np.concatenate([np.arange(0.0, 1.0, 0.01), np.arange(1.0, 655.0, 3.217)]):
        sent = mavros_converts(message_of(ahead(metres + 1e-4), options=options))
        assert sent.min_distance == 29
        assert sent.max_distance == 65500
        assert sent.distances[0] == max(int(metres * 100 + 0.02), 29)
        # Who is nearer than a body is broad is all round.
        assert (sent.distances[36] == UNKNOWN) == (metres > 0.295)
    beyond = mavros_converts(message_of(ahead(660.0), options=options))
    assert set(beyond.distances) == {UNKNOWN}


@pytest.mark.parametrize('range_max', [3.3, 10.0, 20.3, 29.99, 654.99])
def test_clear_is_beyond_the_limit_for_all_of_them(range_max):
    options = ScanOptions(sigmas=0.0, range_max=range_max, clear=True)
    sent = mavros_converts(message_of(ahead(), options=options))
    assert sent.max_distance < sent.distances[0] < UNKNOWN
    proximity, prevention = ArduPilotProximity(), Px4CollisionPrevention()
    proximity.take(sent, now_s=0.0)
    assert proximity.healthy(now_s=0.0)
    assert proximity.sectors(now_s=0.0) == {}
    prevention.take(sent, now_s=0.0)
    assert prevention.obstacles(now_s=0.0) == {}
    assert prevention.may_fly(0, now_s=0.0)
    assert not prevention.may_fly(180, now_s=0.0)


@pytest.mark.parametrize('bearing', range(-180, 180, 7))
def test_px4s_coarser_map_sees_a_far_person_at_any_bearing(bearing):
    prevention = Px4CollisionPrevention()
    prevention.take(mavros_converts(message_of(ahead(25.0), bearing_deg=bearing)), now_s=0.0)
    (own, metres), = prevention.obstacles(now_s=0.0).items()
    assert metres == pytest.approx(25.0, abs=0.01)
    assert abs((own * 10 - bearing + 180) % 360 - 180) <= 7.5


def test_what_unknown_and_silence_mean_to_px4():
    unknown = mavros_converts(message_of(ahead()))
    person = mavros_converts(message_of(ahead(1.5)))
    strict, lenient = Px4CollisionPrevention(), Px4CollisionPrevention(go_no_data=True)
    for prevention in strict, lenient:
        prevention.take(unknown, now_s=0.0)
        assert not prevention.may_fly(0, now_s=0.0)  # nothing is known at all
        prevention.take(person, now_s=0.1)
        assert not prevention.may_fly(0, now_s=0.2)
    assert not strict.may_fly(90, now_s=0.2)
    assert lenient.may_fly(90, now_s=0.2)
    assert not lenient.may_fly(90, now_s=0.7)  # silence
    # Where a person has once been, unknown is no longer taken for free.
    person_aside = mavros_converts(message_of(ahead(4.0), bearing_deg=45))
    lenient.take(person_aside, now_s=1.0)
    assert not lenient.may_fly(0, now_s=1.1)


def test_a_scan_in_another_frame_would_not_do():
    prevention = Px4CollisionPrevention()
    with pytest.raises(AssertionError, match='north-aligned'):
        prevention.take(mavros_converts(message_of(ahead(5.0)), mav_frame='GLOBAL'), now_s=0.0)


def test_the_nearest_is_a_range_in_the_images_frame():
    message = encode_nearest(
        IMAGE, distance=4.25, sigma=0.5, max_range=100.0, intrinsics=CAMERA)
    assert message.header == IMAGE
    assert (message.range, message.variance, message.max_range) == (4.25, 0.25, 100.0)
    assert math.degrees(message.field_of_view) == pytest.approx(70.79, abs=0.01)
    assert message.radiation_type == Range.INFRARED


def test_the_target_is_a_pose_of_unknown_heading():
    covariance = np.diag([0.25, 0.01, 0.01])
    message = encode_target(
        Target(3, np.array([5.0, -1.0, 0.5]), covariance), IMAGE, frame_id='base_link')
    assert message.header == Header(stamp=IMAGE.stamp, frame_id='base_link')
    position = message.pose.pose.position
    assert (position.x, position.y, position.z) == (5.0, -1.0, 0.5)
    assert message.pose.pose.orientation.w == 1.0
    told = np.reshape(message.pose.covariance, (6, 6))
    assert (told[:3, :3] == covariance).all()
    assert np.diagonal(told)[3:] == pytest.approx([math.pi ** 2 / 3] * 3)
