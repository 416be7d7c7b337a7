from average_body import standing_at
from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from depth_person.distance.canonical import canonicalise, LEFT, MIRRORED, RIGHT, TEMPLATE
from depth_person.pose.skeleton import Keypoint

EVERY = np.ones((1, 18), bool)


def rays_of(points):
    points = np.reshape(points, (-1, 18, 3))
    return points / np.linalg.norm(points, axis=-1, keepdims=True)


def rotation(axis, degrees):
    angle = np.radians(degrees)
    first, second = [(1, 2), (2, 0), (0, 1)][axis]
    matrix = np.eye(3)
    matrix[first, first] = matrix[second, second] = np.cos(angle)
    matrix[first, second], matrix[second, first] = -np.sin(angle), np.sin(angle)
    return matrix


BODY = standing_at((0.4, -0.2, 6.0), yaw_deg=30)


def test_pairs_are_left_and_right_of_the_same_joint():
    for left, right in zip(LEFT, RIGHT, strict=True):
        assert Keypoint(left).name[2:] == Keypoint(right).name[2:]
    assert (MIRRORED[MIRRORED] == np.arange(18)).all()


@given(pan=st.floats(-50, 50), tilt=st.floats(-50, 50), roll=st.floats(-180, 180))
@settings(max_examples=50)
def test_turning_the_camera_on_the_spot_changes_nothing_but_its_rotation(pan, tilt, roll):
    turn = rotation(2, roll) @ rotation(0, tilt) @ rotation(1, pan)
    plain = canonicalise(rays_of(BODY), EVERY)
    turned = canonicalise(rays_of(BODY @ turn.T), EVERY)
    np.testing.assert_allclose(turned.points, plain.points, atol=1e-9)
    np.testing.assert_allclose(turned.guess, plain.guess, rtol=1e-9)
    np.testing.assert_allclose(turned.rotation @ turn, plain.rotation, atol=1e-9)


@given(shown=st.lists(st.booleans(), min_size=18, max_size=18).filter(lambda x: sum(x) >= 2))
@settings(max_examples=50)
def test_a_mirror_image_gives_mirrored_points(shown):
    known = np.array([shown])
    plain = canonicalise(rays_of(BODY), known)
    mirrored = canonicalise(rays_of(BODY * (-1, 1, 1))[:, MIRRORED], known[:, MIRRORED])
    np.testing.assert_allclose(
        mirrored.points, (plain.points * (-1, 1))[:, MIRRORED], atol=1e-9)


def test_points_are_upright_and_centred():
    points = canonicalise(rays_of(BODY @ rotation(2, 140).T), EVERY).points[0]
    np.testing.assert_allclose(points.mean(axis=0), 0, atol=1e-12)
    assert points[Keypoint.NOSE, 1] < points[Keypoint.L_HIP, 1] < points[Keypoint.L_ANKLE, 1]
    assert points[Keypoint.L_SHOULDER, 0] > points[Keypoint.R_SHOULDER, 0]


def test_the_template_at_a_distance_is_guessed_there_from_any_part_of_it():
    points = np.concatenate([TEMPLATE, np.full((18, 1), 50.0)], axis=1)
    for rows in (range(18), [2, 5, 8, 11], [14, 15, 16, 17], [9, 10]):
        known = np.zeros((1, 18), bool)
        known[0, list(rows)] = True
        assert canonicalise(rays_of(points), known).guess[0] == pytest.approx(50, rel=1e-3)


def test_nobody_and_a_single_keypoint_have_no_guess_but_raise_nothing():
    assert canonicalise(np.empty((0, 18, 3)), np.empty((0, 18), bool)).guess.shape == (0,)
    known = np.zeros((2, 18), bool)
    known[1, 3] = True
    assert np.isnan(canonicalise(rays_of([BODY, BODY]), known).guess).all()
