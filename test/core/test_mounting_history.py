"""What is said of a time between, before and after samples."""
import math

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from depth_person.distance.attitude import rotation_from, turned
from depth_person.mounting.history import blend_numbers, History, NotKnown, Pose, Taken

MILLISECOND = 1_000_000
ANGLES = st.floats(-3.0, 3.0)


def history(*samples, reach_s=0.1):
    result = History(blend_numbers, reach_s=reach_s)
    for milliseconds, value in samples:
        result.add(milliseconds * MILLISECOND, value)
    return result


@pytest.mark.parametrize(('samples', 'at_ms', 'value', 'beyond_s'), [
    ([(0, 1.0), (20, 2.0)], 0, 1.0, 0.0),
    ([(0, 1.0), (20, 2.0)], 5, 1.25, 0.0),
    ([(0, 1.0), (20, 2.0), (40, 9.0)], 30, 5.5, 0.0),
    ([(0, 1.0)], 60, 1.0, 0.06),  # no rate is known
    ([(0, 1.0)], -60, 1.0, 0.06),
    ([(0, 1.0), (60, 4.0)], 100, 6.0, 0.04),  # goes on at 50 a second
    ([(0, 0.0), (30, 7.0), (60, 6.0)], 90, 9.0, 0.03),  # the rate of 60 ms, not of the noise
    ([(0, 1.0), (20, 2.0)], -10, 1.0, 0.01),
    ([(0, 1.0), (900, 4.0)], 850, 4.0, 0.05),  # too far apart to say what was between
])
def test_a_value_at_a_time(samples, at_ms, value, beyond_s):
    found = history(*samples).at(at_ms * MILLISECOND)
    assert (found.value, found.beyond_s) == (pytest.approx(value), pytest.approx(beyond_s))


@pytest.mark.parametrize(('samples', 'at_ms', 'said'), [
    ([], 0, 'nothing has come'),
    ([(0, 1.0)], 101, '0.10 s before the image'),
    ([(500, 1.0)], 0, '0.50 s after the image'),
    ([(0, 1.0), (900, 4.0)], 450, '0.45 s'),
])
def test_a_time_of_which_nothing_is_known(samples, at_ms, said):
    with pytest.raises(NotKnown, match=said):
        history(*samples).at(at_ms * MILLISECOND)


def test_a_late_sample_is_left_out_and_a_clock_that_jumps_back_starts_anew():
    samples = history((10_000, 1.0), (10_020, 2.0))
    assert samples.add(10_010 * MILLISECOND, 5.0) is Taken.LATE
    assert samples.at(10_010 * MILLISECOND).value == 1.5
    assert samples.add(3_000 * MILLISECOND, 7.0) is Taken.JUMPED
    assert samples.at(3_000 * MILLISECOND).value == 7.0
    with pytest.raises(NotKnown):
        samples.at(10_010 * MILLISECOND)


def test_old_samples_make_room():
    samples = history(*((each, float(each)) for each in range(5000)))
    assert samples.at(4999 * MILLISECOND).value == 4999
    with pytest.raises(NotKnown):
        samples.at(0)


def about_z(angle):
    return rotation_from((0, 0, math.sin(angle / 2), math.cos(angle / 2)))


@given(one=ANGLES, turn=ANGLES, share=st.floats(0, 1))
def test_a_turn_goes_round_evenly(one, turn, share):
    between = turned(about_z(one), about_z(one + turn), share)
    error = 1e-6 if abs(turn) > 2e-5 else 2e-5  # OpenCV takes less than 1e-5 for no turn
    assert between == pytest.approx(about_z(one + share * turn), abs=error)


@given(angles=st.tuples(ANGLES, ANGLES, ANGLES), position=st.tuples(ANGLES, ANGLES, ANGLES))
def test_there_and_back_is_where_one_was(angles, position):
    turn = np.array(angles) / max(1.0, float(np.linalg.norm(angles)))
    w = math.sqrt(max(0.0, 1 - float(turn @ turn)))
    pose = Pose(rotation_from((*turn, w)), np.array(position))
    same = pose.then(pose.inverted())
    assert same.rotation == pytest.approx(np.eye(3), abs=1e-9)
    assert same.position == pytest.approx(np.zeros(3), abs=1e-9)
