from average_body import CAMERA, seen, standing_at
import numpy as np
import pytest

from depth_person.distance.conventions import Placement
from depth_person.distance.estimator import Cue, Mounting
from depth_person.distance.ground import ground_range, LEGS, SHANK, TORSO
from depth_person.distance.skeleton import SkeletonEstimator

DOWN = np.array([0.0, 1.0, 0.0])
HEIGHT = 1.6
MESH = Placement()


def told(points, *, hidden=(), noise=1e-3, mounting=None, placement=MESH):
    points = np.array(points)
    neck = points[1] / np.linalg.norm(points[1])
    rays = points / np.linalg.norm(points, axis=1, keepdims=True)
    rays[list(hidden)] = np.nan
    mounting = Mounting(gravity=DOWN, height=HEIGHT) if mounting is None else mounting
    log_range, sigma = ground_range(
        rays[None], np.full((1, 18), noise), neck[None], mounting, placement=placement)
    return np.exp(log_range[0]), sigma[0]


def on_ground(distance, *, box=0.0, height=HEIGHT):
    """Stand a body on the level its keypoints' heights belong to, or on a box above it."""
    sole = standing_at((0.3, 0.0, distance))
    ankles = sole[[10, 13], 1].mean()
    return sole + np.array([0, height - LEGS[0][1] - box - ankles, 0])


@pytest.mark.parametrize('distance', [2.0, 4.0, 8.0, 15.0])
def test_feet_on_the_ground_give_the_range_of_the_neck(distance):
    points = on_ground(distance)
    estimate, sigma = told(points)
    assert estimate == pytest.approx(np.linalg.norm(points[1]), rel=0.02)
    assert 0.01 < sigma < 0.6


def test_the_lowest_visible_leg_keypoint_is_used_and_higher_ones_are_less_sure():
    points = on_ground(4.0)
    truth = np.linalg.norm(points[1])
    ankles, knees, hips = (
        told(points), told(points, hidden=(10, 13)), told(points, hidden=(9, 10, 12, 13)))
    assert ankles[1] < knees[1] < hips[1]
    for estimate, sigma in (ankles, knees, hips):
        assert abs(np.log(estimate / truth)) < 2 * sigma


@pytest.mark.parametrize(('rows', 'hidden', 'placement', 'raised'), [
    ([10, 13], (), Placement(ankle_drop=-0.07), 0.07 * SHANK),
    ([8, 11], (9, 10, 12, 13), Placement(hip_drop=-0.06), 0.06 * TORSO)])
def test_a_network_that_marks_legs_higher_up_is_allowed_for(rows, hidden, placement, raised):
    mesh = on_ground(8.0)
    marked = mesh.copy()
    marked[rows, 1] -= raised
    truth = told(mesh, hidden=hidden)[0]
    assert told(marked, hidden=hidden)[0] > 1.01 * truth
    assert told(marked, hidden=hidden, placement=placement)[0] == pytest.approx(truth, rel=1e-3)


@pytest.mark.parametrize('worse', [
    {'noise': 5e-3}, {'mounting': Mounting(DOWN, 0.03, HEIGHT, 0.05)},
    {'mounting': Mounting(DOWN, 0.01, HEIGHT, 0.2)}, {'hidden': (13,)}])
def test_every_source_of_error_widens_the_spread(worse):
    assert told(on_ground(6.0), **worse)[1] > told(on_ground(6.0))[1]


def test_pitch_error_is_what_the_spread_says_far_away():
    points, sigma = on_ground(15.0), told(on_ground(15.0))[1]
    tilted = np.array([0.0, np.cos(0.01), np.sin(0.01)])
    off = told(points, mounting=Mounting(tilted, 0.01, HEIGHT, 0.05))[0]
    assert 0.5 * sigma < abs(np.log(off / told(points)[0])) < 1.5 * sigma


def test_one_degree_is_four_metres_at_twenty_from_two_metres_up():
    points = on_ground(20.0, height=2.0)
    estimate, sigma = told(points, mounting=Mounting(DOWN, np.radians(1.0), 2.0, 0.0))
    assert estimate * sigma == pytest.approx(4.0, abs=0.4)


@pytest.mark.parametrize(('distance', 'attitude_deg', 'used'), [
    (4.0, 1.0, True), (20.0, 0.1, True), (20.0, 1.0, False), (4.0, 5.0, False)])
def test_the_ground_is_used_only_where_its_error_says_so(distance, attitude_deg, used):
    points = on_ground(distance, height=2.0)
    mounting = Mounting(DOWN, np.radians(attitude_deg), 2.0, 0.05)
    alone, both = (SkeletonEstimator().estimate(seen(points), CAMERA, each)
                   for each in (Mounting(gravity=DOWN, gravity_sigma=mounting.gravity_sigma),
                                mounting))
    assert bool(both.cues[0] & Cue.GROUND) == used
    assert (both.range_sigma[0] < 0.97 * alone.range_sigma[0]) == used
    assert (both.range[0] != alone.range[0]) == used


def test_someone_on_a_box_seems_farther_away():
    assert told(on_ground(5.0, box=0.5))[0] > 1.3 * told(on_ground(5.0))[0]


@pytest.mark.parametrize('mounting', [
    Mounting(), Mounting(gravity=DOWN), Mounting(height=HEIGHT), Mounting(DOWN, 0.01, 0.2, 0.05),
    Mounting(-DOWN, 0.01, HEIGHT, 0.05)])
def test_without_gravity_or_height_or_below_the_knees_the_ground_tells_nothing(mounting):
    assert np.isnan(told(on_ground(5.0), mounting=mounting)).all()


def test_no_legs_tell_nothing():
    assert np.isnan(told(on_ground(5.0), hidden=range(8, 14))).all()
