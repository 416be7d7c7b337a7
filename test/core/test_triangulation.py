import warnings

from hypothesis import assume, given
from hypothesis import strategies as st
import numpy as np
import pytest

from depth_person.distance.triangulation import shoulder_depth

F, WIDTH = 900.0, 0.35


@pytest.fixture(autouse=True)
def _warnings_are_errors():
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        yield


def shoulders(neck, direction, width=WIDTH):
    """Return the shoulders and the neck in space, left first, for a unit direction."""
    neck, half = np.asarray(neck, float), np.asarray(direction, float) * width / 2
    return neck + half, neck - half, neck


def images(points, f=F):
    return [f * np.asarray(p)[:2] / p[2] for p in points]


def turned(z, yaw_deg):
    """Return the images of a person on the axis at depth z."""
    yaw = np.radians(yaw_deg)
    return images(shoulders((0, 0, z), (np.cos(yaw), 0, np.sin(yaw))))


def by_the_law_of_sines(left, right, neck, f, width):
    """Return the depth by the paper's steps, one triangle after the other."""
    def length(v):
        return np.linalg.norm(v)

    def angle(a, b):
        return np.arctan2(length(np.cross(a, b)), a @ b)

    left, right, neck = (np.append(point, f) for point in (left, right, neck))
    if length(left) < length(right):
        left, right = right, left
    beta = angle(-left, right - left)
    gamma = np.pi - angle(-right, left - right)
    theta = angle(left, right)
    ratio = length(neck - left) / length(neck - right)
    cot = (ratio * np.sin(beta) / np.sin(gamma) - np.cos(theta)) / np.sin(theta)
    alpha = np.arctan2(1, cot)
    a = width / 2 * np.sin(alpha + theta) / np.sin(beta)
    b = width / 2 * np.sin(alpha) / np.sin(gamma)
    return (a + b) / length(left - right) * f


@pytest.mark.parametrize(('z', 'yaw_deg', 'midpoint'), [
    (3, 0, 3.00), (3, 40, 3.91), (5, 40, 6.52), (5, 60, 9.99), (10, 0, 10.00)])
def test_the_true_neck_gives_the_depth_and_the_midpoint_a_longer_one(z, yaw_deg, midpoint):
    left, right, neck = turned(z, yaw_deg)
    exact = shoulder_depth(left, right, neck, focal_length=F, shoulder_width=WIDTH)
    blind = shoulder_depth(left, right, None, focal_length=F, shoulder_width=WIDTH)
    assert exact == pytest.approx(z, rel=1e-12)
    assert blind == pytest.approx(midpoint, abs=0.006)


@pytest.mark.parametrize(('z', 'yaw_deg', 'median', 'low', 'high'), [
    (3, 0, 2.97, 2.86, 3.01), (3, 40, 3.00, 2.5, 3.6), (5, 40, 4.81, 2.9, 6.4),
    (5, 60, 4.49, 2.1, 9.2), (10, 0, 5.55, 2.6, 9.6)])
def test_half_a_pixel_of_noise_makes_a_measured_neck_worthless_far_away(
        z, yaw_deg, median, low, high):
    random = np.random.default_rng(7)
    noisy = [point + random.normal(0, 0.5, (40_000, 2)) for point in turned(z, yaw_deg)]
    depth = shoulder_depth(*noisy, focal_length=F, shoulder_width=WIDTH)
    assert np.percentile(depth, [50, 10, 90]) == pytest.approx([median, low, high], rel=0.04)


@pytest.mark.parametrize('side', [1, -1], ids=['right of the axis', 'left of the axis'])
@pytest.mark.parametrize(('near', 'far', 'neck'), [
    # Shoulders (1, 0, 5) and (3, 0, 4), or (1, 0, 4) and (3, 0, 5); the neck is (2, 0, 4.5).
    (20.0, 75.0, 400 / 9), (25.0, 60.0, 400 / 9)], ids=['outer forward', 'inner forward'])
def test_all_four_cases_of_the_paper_are_one_formula(side, near, far, neck):
    left, right, neck = ([side * x, 0.0] for x in (near, far, neck))
    for one, other in ((left, right), (right, left)):
        depth = shoulder_depth(one, other, neck, focal_length=100, shoulder_width=5 ** 0.5)
        assert depth == pytest.approx(4.5, rel=1e-12)
        assert by_the_law_of_sines(*map(np.array, (one, other, neck)), 100, 5 ** 0.5) == (
            pytest.approx(4.5, rel=1e-9))


finite = {'allow_nan': False, 'allow_infinity': False}
bearings = st.floats(-1.5, 1.5)


@st.composite
def people(draw):
    """Draw shoulders anywhere before the camera, their line in any direction but the view's."""
    z = draw(st.floats(0.5, 40))
    neck = np.array([draw(bearings) * z, draw(bearings) * z, z])
    direction = np.array([draw(st.floats(-1, 1)) for _ in range(3)])
    assume(np.linalg.norm(direction) > 0.1)
    direction /= np.linalg.norm(direction)
    assume(np.linalg.norm(np.cross(direction, neck)) > 0.02 * np.linalg.norm(neck))
    return shoulders(neck, direction)


@given(people())
def test_the_true_neck_gives_the_depth_for_a_shoulder_line_in_any_place_and_direction(points):
    depth = shoulder_depth(*images(points), focal_length=F, shoulder_width=WIDTH)
    assert depth == pytest.approx(points[2][2], rel=1e-6)


@given(people(), st.floats(-0.3, 0.3))
def test_it_is_the_paper_s_law_of_sines_for_any_neck_between_the_shoulders(points, shift):
    left, right, neck = images(points)
    neck = neck + shift * np.minimum(
        np.linalg.norm(left - neck), np.linalg.norm(right - neck)) * (
        (right - left) / np.linalg.norm(right - left))
    depth = shoulder_depth(left, right, neck, focal_length=F, shoulder_width=WIDTH)
    assert depth == pytest.approx(by_the_law_of_sines(left, right, neck, F, WIDTH), rel=1e-4)


@given(people(), st.floats(0, 2 * np.pi), st.floats(0.1, 10))
def test_swapping_mirroring_and_rolling_change_nothing_and_scaling_scales(points, roll, scale):
    left, right, neck = images(points)
    depth = shoulder_depth(left, right, neck, focal_length=F, shoulder_width=WIDTH)
    turn = np.array([[np.cos(roll), -np.sin(roll)], [np.sin(roll), np.cos(roll)]])
    same = [
        (right, left, neck), tuple(p * (-1, 1) for p in (left, right, neck)),
        tuple(turn @ p for p in (left, right, neck))]
    for one, other, middle in same:
        again = shoulder_depth(one, other, middle, focal_length=F, shoulder_width=WIDTH)
        assert again == pytest.approx(depth, rel=1e-7)
    larger = shoulder_depth(left, right, neck, focal_length=F, shoulder_width=scale * WIDTH)
    assert larger == pytest.approx(scale * depth, rel=1e-12)


@pytest.mark.parametrize('neck', [None, (0.0, 0.0)])
def test_arguments_are_broadcast_together(neck):
    depth = shoulder_depth(
        np.tile([-10.0, 0.0], (4, 1, 1)), [[10.0, 0.0], [20.0, 0.0], [np.nan, 0.0]], neck,
        focal_length=[100.0, 200.0, 100.0], shoulder_width=1.0)
    assert depth.shape == (4, 3)
    assert depth[0, 0] == pytest.approx(5.0)
    assert np.isnan(depth[:, 2]).all()


def test_a_neck_beside_the_line_counts_as_its_foot():
    given_at = {'focal_length': 100.0, 'shoulder_width': 1.0}
    on_line = shoulder_depth([-10, 0], [10, 0], [3, 0], **given_at)
    beside = shoulder_depth([-10, 0], [10, 0], [3, -7], **given_at)
    assert beside == on_line


@pytest.mark.parametrize('x', [-11.0, -10.0, 10.0, 12.0])
def test_a_neck_on_a_shoulder_or_beyond_it_has_no_depth(x):
    assert np.isnan(shoulder_depth(
        [-10, 0], [10, 0], [x, 1], focal_length=100.0, shoulder_width=1.0))


@pytest.mark.parametrize(('left', 'right', 'neck', 'f', 'width'), [
    ((5, 5), (5, 5), (5, 5), 100, 0.35), ((5, 5), (5, 5), None, 100, 0.35),
    ((np.nan, 0), (5, 0), (2, 0), 100, 0.35), ((0, 0), (5, 0), (np.nan, 0), 100, 0.35),
    ((np.inf, 0), (5, 0), None, 100, 0.35), ((-np.inf, 0), (np.inf, 0), (0, 0), 100, 0.35),
    ((1e308, 0), (-1e308, 0), (0, 0), 100, 0.35), ((0, 0), (5, 0), None, 0, 0.35),
    ((0, 0), (5, 0), None, -100, 0.35), ((0, 0), (5, 0), None, np.nan, 0.35),
    ((0, 0), (5, 0), None, 100, 0.0), ((0, 0), (5, 0), None, 100, -0.35),
    ((0, 0), (5, 0), None, 100, np.inf)])
def test_what_has_no_depth_is_nan(left, right, neck, f, width):
    assert np.isnan(shoulder_depth(left, right, neck, focal_length=f, shoulder_width=width))


@given(*[st.tuples(st.floats(), st.floats())] * 3, st.floats(), st.floats())
def test_any_numbers_give_a_positive_depth_or_nan(left, right, neck, f, width):
    depth = shoulder_depth(left, right, neck, focal_length=f, shoulder_width=width)
    assert np.isnan(depth) or 0 < depth < np.inf
