"""Which way is down, from angles and quaternions, worked by hand."""
import math

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from depth_person.distance.attitude import (
    down_of,
    level_gravity,
    optical_from_body,
    rotation_from,
)
from depth_person.errors import DepthPersonError

HALF = math.sqrt(0.5)
ANGLES = st.floats(-math.pi, math.pi)


@pytest.mark.parametrize(('pitch_deg', 'roll_deg', 'down'), [
    (0, 0, (0, 1, 0)),
    (90, 0, (0, 0, 1)),  # looking straight down, down is ahead
    (30, 0, (0, math.cos(math.radians(30)), 0.5)),
    (0, 90, (1, 0, 0)),  # on its right side, down is to the right
    (-90, 0, (0, 0, -1)),
])
def test_gravity_of_a_camera_on_a_level_body(pitch_deg, roll_deg, down):
    gravity = level_gravity(pitch_down=math.radians(pitch_deg), roll_cw=math.radians(roll_deg))
    assert gravity == pytest.approx(down, abs=1e-12)


@pytest.mark.parametrize(('quaternion', 'down'), [
    ((0, 0, 0, 1), (0, 0, -1)),
    ((0, 0, HALF, HALF), (0, 0, -1)),  # a yaw changes nothing
    ((HALF, 0, 0, HALF), (0, -1, 0)),  # rolled right by 90 degrees: down is to the right
    ((0, HALF, 0, HALF), (1, 0, 0)),  # nose down by 90 degrees: down is ahead
    ((1, 0, 0, 0), (0, 0, 1)),  # upside down
])
def test_gravity_of_a_turned_body(quaternion, down):
    assert down_of(rotation_from(quaternion)) == pytest.approx(down, abs=1e-12)


@given(pitch=ANGLES, roll=ANGLES)
def test_a_mounting_is_a_rotation(pitch, roll):
    rotation = optical_from_body(pitch_down=pitch, roll_cw=roll)
    assert rotation @ rotation.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(rotation) == pytest.approx(1)


@given(pitch=ANGLES)
def test_a_nose_that_drops_is_a_camera_that_looks_down(pitch):
    dropped = down_of(rotation_from((0, math.sin(pitch / 2), 0, math.cos(pitch / 2))))
    assert optical_from_body(pitch_down=0.0, roll_cw=0.0) @ dropped == pytest.approx(
        level_gravity(pitch_down=pitch, roll_cw=0.0), abs=1e-12)


@given(roll=ANGLES)
def test_a_body_that_rolls_right_is_a_camera_that_rolls_clockwise(roll):
    rolled = down_of(rotation_from((math.sin(roll / 2), 0, 0, math.cos(roll / 2))))
    assert optical_from_body(pitch_down=0.0, roll_cw=0.0) @ rolled == pytest.approx(
        level_gravity(pitch_down=0.0, roll_cw=roll), abs=1e-12)


@pytest.mark.parametrize('quaternion', [
    (0, 0, 0, 0), (0, 0, 0, 1.1), (math.nan, 0, 0, 1), (math.inf, 0, 0, 1)])
def test_a_quaternion_that_is_no_orientation_is_refused(quaternion):
    with pytest.raises(DepthPersonError, match='quaternion'):
        down_of(rotation_from(quaternion))
