"""Gravity, height and pose of the camera from what a vehicle tells, worked by hand."""
import math
from types import SimpleNamespace as Fields

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest
from vehicle_messages import imu, NOW, odometry, pose, quaternion, rangefinder, transform

from depth_person.distance.attitude import level_gravity
from depth_person.mounting.camera_state import CameraTracker
from depth_person.mounting.vehicle_inputs import VehicleInputs
from depth_person.settings.inputs import InputSettings

EYE = 'eye'
TILTED = math.radians(30)
MOUNTED = {'camera_pitch': 30.0, 'camera_x': 0.2, 'camera_z': -0.1}
TAKERS = {'imu': imu, 'pose': pose, 'odometry': odometry}


class Notes:
    """Keeps what inputs report."""

    def __init__(self):
        self.faults = {}
        self.said = []
        self.counts = {}
        self.values = {}
        self.value = self.values.__setitem__

    def fault(self, key, message):
        self.faults[key] = message
        self.said.append(message)

    def clear(self, key):
        self.faults.pop(key, None)

    def count(self, name):
        self.counts[name] = self.counts.get(name, 0) + 1


class Harness:
    """A tracker of these parameters."""

    def __init__(self, **parameters):
        self.settings = InputSettings(**parameters)
        self.notes = Notes()
        self.inputs = VehicleInputs(self.notes, {'imu': '/mavros/imu/data'})
        self.tracker = CameraTracker(self.notes, self.inputs)

    def at(self, seconds=0.0):
        return self.tracker.at(NOW + round(seconds * 1e9), EYE, self.settings)

    def fault(self, key):
        return self.notes.faults.get(key, '')


def test_without_parameters_nothing_is_known_and_nothing_is_wrong():
    harness = Harness(camera_height=2.0)
    state = harness.at()
    assert (state.mounting.gravity, state.mounting.height, state.pose) == (None, None, None)
    assert state.on_body.rotation[:, 2] == pytest.approx((1, 0, 0))
    assert not harness.notes.said


def test_a_fixed_mounting_is_level_gravity_and_the_given_height():
    mounting = Harness(attitude='fixed', camera_height=1.5, **MOUNTED).at().mounting
    assert mounting.gravity == pytest.approx(level_gravity(pitch_down=TILTED, roll_cw=0.0))
    assert (mounting.height, mounting.height_sigma) == (1.5, 0.1)
    assert mounting.gravity_sigma == pytest.approx(math.radians(1))


@pytest.mark.parametrize('source', ['imu', 'pose', 'odometry'])
def test_an_attitude_between_two_samples_is_interpolated(source):
    harness = Harness(attitude=source)
    take = getattr(harness.inputs, f'take_{source}')
    take(TAKERS[source](-0.01, pitch=0.0))
    take(TAKERS[source](0.03, pitch=20.0))
    mounting = harness.at(0.01).mounting
    assert mounting.gravity == pytest.approx(
        level_gravity(pitch_down=math.radians(10), roll_cw=0.0), abs=1e-6)
    assert mounting.gravity_sigma == pytest.approx(math.radians(1))


def test_beyond_the_newest_sample_the_turn_goes_on_and_is_less_sure():
    harness = Harness(attitude='imu')
    harness.inputs.take_imu(imu(-0.10, pitch=0.0))
    harness.inputs.take_imu(imu(-0.04, pitch=6.0))
    mounting = harness.at().mounting
    assert mounting.gravity == pytest.approx(
        level_gravity(pitch_down=TILTED / 3, roll_cw=0.0), abs=1e-6)
    assert mounting.gravity_sigma == pytest.approx(math.hypot(math.radians(1), 0.02))
    assert harness.notes.values['imu age'] == '40 ms'
    assert harness.at(0.07).mounting.gravity is None
    assert 'no sample on /mavros/imu/data' in harness.fault('attitude')
    assert '0.11 s before the image' in harness.fault('attitude')
    harness.inputs.take_imu(imu(0.07, pitch=6.0))
    assert harness.at(0.07).mounting.gravity is not None
    assert not harness.notes.faults


@pytest.mark.parametrize('beyond_s', [0.0, 0.02, 0.05, 0.09])
def test_the_attitude_of_a_rocking_vehicle_is_as_wrong_as_its_spread_says(beyond_s):
    """It rocks by 10 degrees to both sides once a second, and tells so 50 times a second."""
    def pitch(seconds):
        return 10 * math.sin(2 * math.pi * seconds)

    errors = []
    for newest_s in np.arange(0.5, 1.5, 0.1):
        harness = Harness(attitude='imu', attitude_sigma=0.05)
        for seconds in np.arange(newest_s - 0.4, newest_s + 0.03, 0.02):
            if beyond_s == 0 or seconds <= newest_s + 1e-6:
                harness.inputs.take_imu(imu(seconds, pitch=pitch(seconds)))
        at_s = newest_s + (beyond_s or 0.01)
        mounting = harness.at(at_s).mounting
        truth = level_gravity(pitch_down=math.radians(pitch(at_s)), roll_cw=0.0)
        errors.append(math.acos(min(1.0, mounting.gravity @ truth)) / mounting.gravity_sigma)
    assert math.sqrt(np.mean(np.square(errors))) < 1.0
    assert max(errors) < 2.0


@given(roll=st.floats(-60, 60), pitch=st.floats(-30, 60), yaw=st.floats(-180, 180))
def test_odometry_and_the_same_by_transforms_agree(roll, pitch, yaw):
    where = {'x': 3.0, 'y': -1.0, 'z': 12.0, 'roll': roll, 'pitch': pitch, 'yaw': yaw}
    by_topic = Harness(attitude='odometry', height='odometry', camera_pose='odometry', **MOUNTED)
    by_topic.inputs.take_odometry(odometry(0.0, **where))
    by_tf = Harness(attitude='tf', height='tf', camera_pose='tf', mounting='tf')
    by_tf.inputs.take_transforms([transform(0.0, 'map', 'base_link', **where)])
    # The optical frame of a camera that looks ahead, pitched down: z ahead, x right.
    ahead = quaternion(pitch=30.0)
    forward = (-0.5, 0.5, -0.5, 0.5)
    x, y, z, w = multiplied((ahead.x, ahead.y, ahead.z, ahead.w), forward)
    ahead.x, ahead.y, ahead.z, ahead.w = x, y, z, w
    by_tf.inputs.take_transforms(
        [transform(0.0, 'base_link', EYE, x=0.2, z=-0.1, rotation=ahead)], static=True)
    one, other = by_topic.at(), by_tf.at()
    assert one.mounting.gravity == pytest.approx(other.mounting.gravity, abs=1e-9)
    assert one.mounting.height == pytest.approx(other.mounting.height)
    assert one.pose.rotation == pytest.approx(other.pose.rotation, abs=1e-9)
    assert one.pose.position == pytest.approx(other.pose.position)
    assert one.on_body.rotation == pytest.approx(other.on_body.rotation, abs=1e-9)
    assert one.pose.position[2] == pytest.approx(one.mounting.height)


def multiplied(one, other):
    (x1, y1, z1, w1), (x2, y2, z2, w2) = one, other
    return (w1 * x2 + x1 * w2 + y1 * z2 - z1 * y2, w1 * y2 - x1 * z2 + y1 * w2 + z1 * x2,
            w1 * z2 + x1 * y2 - y1 * x2 + z1 * w2, w1 * w2 - x1 * x2 - y1 * y2 - z1 * z2)


def test_a_gimbal_turns_the_camera_under_the_imu():
    harness = Harness(attitude='imu', mounting='tf')
    harness.inputs.take_imu(imu(0.0))
    assert harness.at().mounting.gravity is None
    assert "frame 'base_link' is unknown to TF, which has none" in harness.fault('mounting')
    down = quaternion(roll=-180.0, yaw=-90.0)  # x right, y back, z down
    harness.inputs.take_transforms([transform(0.0, 'base_link', EYE, rotation=down)])
    state = harness.at()
    assert state.mounting.gravity == pytest.approx((0, 0, 1), abs=1e-9)
    assert state.on_body.rotation[:, 2] == pytest.approx((0, 0, -1), abs=1e-9)


@pytest.mark.parametrize(('roll', 'height'), [
    (0.0, 4.0 - 0.1), (30.0, (4.0 - 0.1) * math.cos(math.radians(30)))])
def test_a_rangefinder_is_corrected_for_tilt_and_for_the_place_of_the_camera(roll, height):
    harness = Harness(attitude='imu', height='rangefinder', camera_x=0.2, camera_z=-0.1)
    harness.inputs.take_imu(imu(0.0, roll=roll))
    harness.inputs.take_rangefinder(rangefinder(0.0, 4.0))
    assert harness.at().mounting.height == pytest.approx(height)


def test_a_rangefinder_that_looks_aside_tells_no_height():
    harness = Harness(attitude='imu', height='rangefinder')
    harness.inputs.take_imu(imu(0.0, roll=60.0))
    harness.inputs.take_rangefinder(rangefinder(0.0, 4.0))
    state = harness.at()
    assert state.mounting.gravity is not None
    assert state.mounting.height is None
    assert 'tilted too far' in harness.fault('height')


def test_the_height_of_a_pose_is_above_the_given_ground():
    harness = Harness(attitude='fixed', height='pose', ground_level=-1.0)
    harness.inputs.take_pose(pose(0.0, z=5.0))
    assert harness.at().mounting.height == pytest.approx(6.0)
    harness.inputs.take_pose(pose(0.1, z=-3.0))
    assert harness.at(0.1).mounting.height is None
    assert 'pose says -2.00 m; check ground_level' in harness.fault('height')


def test_a_height_above_home_is_flagged_and_weak():
    harness = Harness(attitude='fixed', height='rel_alt')
    harness.inputs.take_rel_alt(Fields(data=8.0), stamp_ns=NOW)
    mounting = harness.at().mounting
    assert (mounting.height, mounting.height_sigma) == (8.0, pytest.approx(3.0, abs=0.01))
    assert 'above home' in harness.fault('rel_alt')


def fed(harness, seconds, *, height=4.0, roll=0.0):
    """Return the state after an Imu and a rangefinder have told this."""
    harness.inputs.take_imu(imu(seconds, roll=roll))
    harness.inputs.take_rangefinder(rangefinder(seconds, height))
    return harness.at(seconds)


@pytest.mark.parametrize(('height', 'roll', 'frozen'), [
    (lambda step: 4.0, lambda step: math.sin(step), True),
    (lambda step: 4.0 + 0.01 * (step % 2), lambda step: math.sin(step), False),
    (lambda step: 4.0, lambda step: 0.0, False),  # stands on the ground
])
def test_a_height_that_never_changes_while_the_vehicle_moves_is_not_used(height, roll, frozen):
    harness = Harness(attitude='imu', height='rangefinder')
    for step in range(70):
        state = fed(harness, step / 10, height=height(step), roll=roll(step))
        assert (state.mounting.height is None) == (frozen and step > 50), step
    assert ('without the least change' in harness.fault('height')) == frozen
    assert fed(harness, 7.0, height=4.5).mounting.height is not None


def test_a_frozen_height_is_noticed_without_an_attitude_sensor_too_and_on_demand_trusted():
    for after_s, known in ((5.0, False), (0.0, True)):
        harness = Harness(attitude='fixed', height='rangefinder', frozen_after=after_s)
        for step in range(70):
            harness.inputs.take_rangefinder(rangefinder(step / 10, 4.0))
            state = harness.at(step / 10)
        assert (state.mounting.height is not None) == known


@pytest.mark.parametrize(('name', 'message', 'said'), [
    ('imu', imu(0.0, orientation=Fields(x=0.0, y=0.0, z=0.0, w=0.0)), 'length 0 instead of 1'),
    ('imu', imu(0.0, orientation=Fields(x=0.0, y=0.0, z=0.0, w=1.2)), 'length 1.2'),
    ('rangefinder', rangefinder(0.0, math.inf), 'inf m is not within 0.2 to 40 m'),
    ('rangefinder', rangefinder(0.0, -1.0), '-1 m is not within'),
    ('rangefinder', rangefinder(0.0, math.nan), 'nan m is not within'),
    ('pose', pose(0.0, z=math.nan), 'not finite'),
])
def test_a_message_that_cannot_be_right_is_named_and_the_next_good_one_mends_it(
        name, message, said):
    harness = Harness()
    take = getattr(harness.inputs, f'take_{name}')
    take(message)
    assert said in harness.fault(f'bad {name}')
    assert harness.notes.counts == {f'bad {name} messages': 1}
    take({'imu': imu, 'pose': pose}.get(name, lambda s: rangefinder(s, 1.0))(0.1))
    assert not harness.notes.faults


def test_a_clock_that_jumps_back_is_named_and_what_was_before_forgotten():
    harness = Harness(attitude='imu')
    harness.inputs.take_imu(imu(100.0))
    assert harness.at(100.0).mounting.gravity is not None
    harness.inputs.take_imu(imu(0.0))
    assert 'stamps of /mavros/imu/data have jumped back' in harness.fault('clock of imu')
    assert harness.notes.counts == {'clock jumps': 1}
    assert harness.at(100.0).mounting.gravity is None
    assert harness.at(0.0).mounting.gravity is not None
    assert not harness.notes.faults


def test_an_input_that_is_refused_is_not_used():
    harness = Harness(attitude='imu', camera_height=2.0)
    harness.inputs.take_imu(imu(0.0))
    harness.inputs.refuse('imu', '2 publishers')
    assert harness.at().mounting.gravity is None
    assert '/mavros/imu/data is not used: 2 publishers' in harness.fault('attitude')
    harness.inputs.refuse('imu', '')
    assert harness.at().mounting.height == 2.0


def test_the_camera_goes_where_the_vehicle_goes():
    harness = Harness(attitude='pose', camera_pose='pose', camera_x=1.0)
    harness.inputs.take_pose(pose(0.0, x=10.0, z=2.0, yaw=90.0))
    camera = harness.at().pose
    assert camera.position == pytest.approx((10, 1, 2))
    assert camera.rotation @ np.array([0, 0, 1]) == pytest.approx((0, 1, 0), abs=1e-9)
