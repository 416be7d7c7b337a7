"""People as a ring of distances: where they land, how wide, how near, and what stays unknown."""
from average_body import NECK_HEIGHT
from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest
from vehicle_scene import CAMERA, Scene, standing

from depth_person.autopilot.scan import BINS, centimetres, scan, ScanOptions
from depth_person.autopilot.vehicle import LevelView
from depth_person.camera.intrinsics import Intrinsics
from depth_person.distance.estimator import Mounting
from depth_person.distance.stage import DistanceOptions, DistanceStage
from depth_person.distance.tracked import TrackedPeople
from depth_person.errors import DepthPersonError
from depth_person.pose.people import People

EXACT = ScanOptions(sigmas=0.0)
WIDE = Intrinsics.from_horizontal_fov(100.0, width=1280, height=720)


def bins_of(ranges):
    return [int(index) for index in np.flatnonzero(np.isfinite(ranges))]


def test_a_ring_has_72_bins_of_which_only_the_persons_hold_a_distance():
    scene = Scene()
    ranges = scan(scene.tracked((0, 5.0, 0.0)), CAMERA, scene.view, EXACT)
    assert ranges.shape == (72,)
    assert ranges.dtype == np.float32
    # Wrists 0.21 m beside the neck at 4.94 m and 0.15 m of body: 4.2 degrees to both sides.
    assert bins_of(ranges) == [0, 1, 71]
    assert ranges[0] == pytest.approx(5.0, abs=0.011)


@pytest.mark.parametrize(('look_right', 'bins'), [
    (0, [71, 0, 1]), (90, [17, 18, 19]), (-30, [65, 66, 67]), (180, [35, 36, 37])])
def test_the_camera_may_look_anywhere(look_right, bins):
    scene = Scene(look_right=look_right)
    ranges = scan(scene.tracked((look_right, 5.0, 0.0)), CAMERA, scene.view, EXACT)
    assert bins_of(ranges) == sorted(bins)


@given(
    bearing=st.floats(-30, 30), distance=st.floats(4, 20), below=st.floats(-1, 4),
    nose_up=st.floats(-20, 20), roll=st.floats(-30, 30), look_down=st.floats(0, 40))
@settings(max_examples=60)
def test_angle_and_distance_are_the_level_ones_however_the_vehicle_tilts(
        bearing, distance, below, nose_up, roll, look_down):
    scene = Scene(nose_up=nose_up, roll_right=roll, look_down=look_down)
    tracked = scene.tracked((bearing, distance, below))
    ranges = scan(tracked, WIDE, scene.view, ScanOptions(sigmas=0.0, range_max=50.0))
    if tracked.distances.position[0, 2] < 0.1:  # behind the camera
        return
    assert ranges[round(bearing / 5) % 72] == pytest.approx(distance, abs=0.011)


def test_a_camera_pitched_by_30_degrees_on_a_rolled_body():
    scene = Scene(look_down=30, nose_up=-5, roll_right=15, camera_at=(0.2, 0.1, 0.05))
    people = [(-12, 6.0, 2.5), (14, 9.0, 3.0)]
    ranges = scan(scene.tracked(*people), CAMERA, scene.view, EXACT)
    for bearing, distance, below in people:
        inside = standing(bearing, distance, below)
        joints = np.degrees(np.arctan2(inside[:, 1], inside[:, 0]))
        for joint in joints:
            assert ranges[round(joint / 5) % 72] == pytest.approx(distance, abs=0.011)
    taken_for_level = scan(
        scene.tracked(*people), CAMERA, Scene(look_down=30).view, EXACT)
    assert not np.allclose(ranges, taken_for_level, equal_nan=True)


@pytest.mark.parametrize(('nose_up', 'roll'), [(0, 0), (-8, 12), (10, -20)])
def test_from_keypoints_to_scan_with_a_camera_pitched_by_30_degrees(nose_up, roll):
    scene = Scene(look_down=30, nose_up=nose_up, roll_right=roll)
    truth = [(-14, 7.0, 3.0), (9, 10.0, 3.0)]  # on flat ground, 4.36 m below the camera
    stage = DistanceStage(DistanceOptions())
    mounting = Mounting(gravity=scene.gravity, height=3.0 + NECK_HEIGHT)
    tracked = stage.measure(
        scene.tracked(*truth).people, CAMERA, mounting, stamp_ns=1_000_000_000)
    ranges = scan(tracked, CAMERA, LevelView.of(scene.camera, mounting.gravity), EXACT)
    for bearing, distance, _ in truth:
        assert ranges[round(bearing / 5) % 72] == pytest.approx(distance, rel=0.05)
    assert len(bins_of(ranges)) <= 7


@pytest.mark.parametrize(('sigmas', 'expected'), [(0.0, 8.0), (1.0, 7.5), (2.0, 7.0), (5.0, 5.5)])
def test_people_are_taken_to_be_nearer_by_some_sigmas(sigmas, expected):
    scene = Scene()
    ranges = scan(
        scene.tracked((0, 8.0, 0.0), sigma=0.5), CAMERA, scene.view, ScanOptions(sigmas=sigmas))
    assert ranges[0] == pytest.approx(expected, abs=0.011)


def test_the_near_bound_lies_on_the_view_ray_so_far_below_it_is_flat():
    scene = Scene(look_down=40)
    tracked = scene.tracked((0, 6.0, 4.5), sigma=1.0)
    distance = np.hypot(6.0, 4.5)
    ranges = scan(tracked, CAMERA, scene.view, ScanOptions(sigmas=2.0))
    assert ranges[0] == pytest.approx((distance - 2.0) * 6.0 / distance, abs=0.011)


def test_who_may_be_here_already_is_at_the_smallest_distance():
    scene = Scene()
    ranges = scan(
        scene.tracked((0, 3.0, 0.0), sigma=4.0), CAMERA, scene.view, ScanOptions(range_min=0.3))
    assert ranges[0] == np.float32(0.3)


def test_the_nearer_of_two_people_behind_each_other_counts():
    scene = Scene()
    for people in ((0, 4.0, 0.0), (0, 9.0, 0.0)), ((0, 9.0, 0.0), (0, 4.0, 0.0)):
        ranges = scan(scene.tracked(*people), CAMERA, scene.view, EXACT)
        assert ranges[0] == pytest.approx(4.0, abs=0.011)


def test_who_is_beyond_the_limit_is_left_out_and_who_is_at_it_is_not():
    scene = Scene()
    options = ScanOptions(sigmas=0.0, range_max=10.0)
    assert not bins_of(scan(scene.tracked((0, 10.2, 0.0)), CAMERA, scene.view, options))
    assert bins_of(scan(scene.tracked((0, 9.999, 0.0)), CAMERA, scene.view, options))


@given(bearing=st.floats(-30, 30))
@settings(max_examples=50)
def test_a_far_person_fills_two_bins_so_that_one_of_them_is_even(bearing):
    scene = Scene()
    filled = bins_of(scan(scene.tracked((bearing, 25.0, 0.0)), CAMERA, scene.view, EXACT))
    assert len(filled) == 2
    assert round(bearing / 5) % 72 in filled


def test_a_person_cut_by_the_border_reaches_beyond_it():
    scene = Scene()
    whole = scene.tracked((34.0, 3.0, 0.0))
    keypoints = whole.people.keypoints.copy()
    keypoints[keypoints[..., 0] > CAMERA.width - 1] = np.nan
    assert np.isnan(keypoints[0, :, 0]).any()
    cut = TrackedPeople.unfiltered(
        People(keypoints, whole.people.track_ids), whole.distances)
    # The border is at 35.4 degrees, bin 8 begins at 37.5.
    assert bins_of(scan(cut, CAMERA, scene.view, EXACT)) == [5, 6, 7, 8]


def test_a_person_who_is_only_predicted_is_as_broad_as_a_body():
    scene = Scene()
    seen = scene.tracked((0, 2.0, 0.0), sigma=0.1)
    hidden = TrackedPeople.unfiltered(
        People(np.full_like(seen.people.keypoints, np.nan), seen.people.track_ids),
        seen.distances)
    # 0.3 m at 2 m: 8.6 degrees to both sides.
    assert bins_of(scan(hidden, CAMERA, scene.view, EXACT)) == [0, 1, 2, 70, 71]


def test_right_above_a_person_every_direction_is_taken():
    scene = Scene(look_down=80)
    ranges = scan(scene.tracked((0, 0.25, 6.0)), CAMERA, scene.view, EXACT)
    assert len(bins_of(ranges)) == BINS


def test_nobody_is_all_unknown():
    scene = Scene()
    nobody = TrackedPeople.unfiltered(
        People.nobody(), scene.tracked((0, 5.0, 0.0)).distances.none(0, 0))
    assert np.isnan(scan(nobody, CAMERA, scene.view, EXACT)).all()


def test_a_person_without_a_range_is_unknown_and_never_clear():
    scene = Scene()
    tracked = scene.tracked((0, 5.0, 0.0), (20, 6.0, 0.0), unknown=[0])
    ranges = scan(tracked, CAMERA, scene.view, EXACT)
    assert bins_of(ranges) == [3, 4, 5]
    clear = scan(tracked, CAMERA, scene.view, ScanOptions(sigmas=0.0, clear=True))
    assert np.isnan(clear[[0, 1, 71]]).all()
    assert clear[69] == np.float32(30.02)


def test_clear_is_only_what_is_in_view_at_the_vehicles_level():
    level = Scene()
    nobody = TrackedPeople.unfiltered(
        People.nobody(), level.tracked((0, 5.0, 0.0)).distances.none(0, 0))
    clear = ScanOptions(clear=True)
    # The view is 35.4 degrees to both sides; bin 7 would end at 37.5.
    seen = bins_of(scan(nobody, CAMERA, level.view, clear))
    assert seen == [*range(7), *range(66, 72)]
    # Half the view is 21.8 degrees high: looking down by more, the level is not in the image.
    assert not bins_of(scan(nobody, CAMERA, Scene(look_down=25).view, clear))
    tilted = Scene(look_down=25, nose_up=25)
    assert bins_of(scan(nobody, CAMERA, tilted.view, clear)) == seen


def test_clear_ends_where_a_barrel_lens_folds_back():
    lens = Intrinsics(
        1280, 720, 900.0, 900.0, 639.5, 359.5, 'plumb_bob', (-0.35, 0.1, 0.0, 0.0, 0.0))
    scene = Scene()
    nobody = TrackedPeople.unfiltered(
        People.nobody(), scene.tracked((0, 5.0, 0.0)).distances.none(0, 0))
    seen = bins_of(scan(nobody, lens, scene.view, ScanOptions(clear=True)))
    assert 0 in seen
    assert not set(range(12, 61)) & set(seen)


def test_every_centimetre_stays_itself_when_cut():
    whole = np.arange(1, 65_501)
    metres = centimetres(whole / 100)
    assert (np.float32(metres.astype(np.float64) * 100).astype(np.uint16) == whole).all()
    assert ((metres.astype(np.float64) * 100).astype(np.uint16) == whole).all()
    assert np.abs(metres - whole / 100).max() < 1e-4


@given(st.floats(0.02, 655.0))
def test_clear_lies_beyond_the_limit_after_the_cut(range_max):
    cut = int(np.float64(np.float32(range_max + 0.02)) * 100)
    assert int(np.float64(centimetres(range_max)) * 100) < cut < 65535


@pytest.mark.parametrize(('wrong', 'said'), [
    ({'sigmas': -1.0}, 'further away'), ({'sigmas': float('nan')}, 'further away'),
    ({'range_min': 0.0}, 'not within'), ({'range_min': 31.0}, 'not within'),
    ({'range_max': 700.0}, 'not within')])
def test_options_that_cannot_be(wrong, said):
    with pytest.raises(DepthPersonError, match=said):
        ScanOptions(**wrong)


def test_a_vehicle_that_points_straight_up_has_no_bearings():
    assert Scene(nose_up=85).view is None
    assert Scene(nose_up=70).view is not None
