from average_body import average_body, CAMERA, NECK_HEIGHT, only, seen, standing_at
from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from depth_person.camera.intrinsics import Intrinsics
from depth_person.distance.canonical import MIRRORED
from depth_person.distance.conventions import CONVENTIONS, place
from depth_person.distance.estimator import Body, Cue, Mounting, Reason
from depth_person.distance.estimators import make_estimator
from depth_person.pose.people import People
from depth_person.pose.skeleton import Keypoint

ESTIMATOR = make_estimator('skeleton')
DOWN = np.array([0.0, 1.0, 0.0])
FACE = ('NOSE', 'R_EYE', 'L_EYE', 'R_EAR', 'L_EAR')
SHOULDERS = ('R_SHOULDER', 'L_SHOULDER')
ARMS = ('R_ELBOW', 'L_ELBOW', 'R_WRIST', 'L_WRIST')
HIPS = ('R_HIP', 'L_HIP')
LEFT = tuple(row.name for row in Keypoint if row.name.startswith('L_'))


def measure(people, mounting=Mounting(), estimator=ESTIMATOR, camera=CAMERA):
    return estimator.estimate(people, camera, mounting)


def assert_true(distances, truth, sigmas=2.5):
    assert distances.known.all(), distances.reason
    assert (np.abs(distances.range - truth) < sigmas * distances.range_sigma).all()


yaws = st.floats(-180, 180)
ranges = st.floats(2.5, 25)


@given(distance=ranges, yaw=yaws, x=st.floats(-0.4, 0.4), y=st.floats(-0.2, 0.2))
@settings(max_examples=60)
def test_an_average_adult_is_found_within_sigma_at_any_range_and_yaw(distance, yaw, x, y):
    position = np.array([x, y, 1.0]) * distance
    distances = measure(seen(standing_at(position, yaw_deg=yaw)))
    truth = np.linalg.norm(position)
    assert_true(distances, truth)
    assert distances.range_sigma[0] < 0.15 * truth
    assert np.linalg.norm(distances.position[0]) == pytest.approx(distances.range[0])
    direction = distances.position[0] / distances.range[0]
    assert direction @ position / truth > np.cos(0.2 / truth)


@pytest.mark.parametrize(('names', 'widest'), [
    ((*FACE, *SHOULDERS, *ARMS, *HIPS), 0.10), ((*FACE, *SHOULDERS, *ARMS), 0.13),
    ((*FACE, *SHOULDERS), 0.16), (FACE, 0.30), ((*SHOULDERS, *HIPS), 0.15), (LEFT, 0.15)])
def test_a_part_of_the_body_gives_a_range_with_a_sigma_to_match(names, widest):
    people = seen(standing_at((0.3, 0.0, 4.0), yaw_deg=20))
    whole, part = measure(people), measure(only(people, *names))
    assert_true(part, np.hypot(0.3, 4.0))
    assert whole.range_sigma[0] < part.range_sigma[0] < widest * 4.0


def test_the_neck_is_found_where_the_shoulders_are_hidden():
    distances = measure(only(seen(standing_at((0.5, 0.2, 4.0))), *FACE))
    off = distances.position[0] / distances.position[0, 2] * 4.0 - (0.5, 0.2, 4.0)
    assert np.linalg.norm(off) < 0.12


@pytest.mark.parametrize('yaw', [180.0, 150.0, -160.0])
def test_from_behind_swapped_sides_and_a_missing_face_change_the_range_little(yaw):
    people = seen(standing_at((0.0, 0.0, 6.0), yaw_deg=yaw))
    keypoints = people.keypoints.copy()
    keypoints[:, [0, 14, 15]] = np.nan
    behind = People(keypoints, people.track_ids, convention='mesh')
    swapped = People(keypoints[:, MIRRORED], people.track_ids, convention='mesh')
    assert_true(measure(behind), 6.0)
    assert_true(measure(swapped), 6.0)
    assert measure(swapped).range[0] == pytest.approx(measure(behind).range[0], rel=0.1)


@pytest.mark.parametrize('pitch', [20, 40, 60])
@pytest.mark.parametrize('known', [False, True])
def test_a_drones_view_works_and_gravity_does_not_harm_it(pitch, known):
    angle = np.radians(pitch)
    down = np.array([[1, 0, 0], [0, np.cos(angle), -np.sin(angle)],
                     [0, np.sin(angle), np.cos(angle)]])
    neck = np.array([0.0, 8 * np.sin(angle), 8 * np.cos(angle)])
    people = seen(standing_at(neck, yaw_deg=30) @ down.T)
    mounting = Mounting(gravity=down @ DOWN) if known else Mounting()
    assert_true(measure(people, mounting), 8.0)


def test_each_networks_own_marks_give_the_same_range():
    body = standing_at((0.2, 0.1, 5.0), yaw_deg=15)
    for name, convention in CONVENTIONS.items():
        marked = place(body[None], convention.placement.as_array()[None])
        assert_true(measure(seen(marked, convention=name)), np.linalg.norm(body[1]))
    unknown = measure(seen(body, convention='never-heard-of'))
    assert_true(unknown, np.linalg.norm(body[1]))


# Properties


@given(yaw=yaws, scale=st.floats(0.4, 4.0))
@settings(max_examples=40)
def test_another_focal_length_with_the_same_rays_changes_no_range(yaw, scale):
    body = standing_at((0.4, 0.2, 6.0), yaw_deg=yaw)
    camera = Intrinsics(1280, 720, 900 * scale, 900 * scale, 639.5, 359.5)
    plain, zoomed = (
        measure(seen(body, camera=c), camera=c).range[0] for c in (CAMERA, camera))
    assert zoomed == pytest.approx(plain, rel=0.03)


@given(yaw=yaws, factor=st.floats(1.2, 3.0))
@settings(max_examples=40)
def test_a_person_who_looks_smaller_by_a_factor_is_farther_by_it(yaw, factor):
    near = measure(seen(standing_at((0, 0, 6.0), yaw_deg=yaw)))
    far = measure(seen(standing_at((0, 0, 6.0 * factor), yaw_deg=yaw)))
    assert far.range[0] / near.range[0] == pytest.approx(factor, rel=0.06)


def test_a_larger_body_of_known_size_is_farther_by_the_same_factor():
    def measured(size):
        estimator = make_estimator('skeleton', body=Body(stature=1.69 * size, stature_sigma=0.01))
        return measure(seen(standing_at((0, 0, 6.0 * size), size=size)), estimator=estimator)

    for size in (0.92, 1.1):
        assert measured(size).range[0] == pytest.approx(size * measured(1.0).range[0], rel=0.025)


@given(yaw=yaws, x=st.floats(-2, 2))
@settings(max_examples=40)
def test_a_mirrored_image_gives_the_mirrored_position(yaw, x):
    body = standing_at((x, 0.1, 5.0), yaw_deg=yaw)
    plain = measure(seen(body))
    mirrored = measure(seen((body * (-1, 1, 1))[MIRRORED]))
    np.testing.assert_allclose(
        mirrored.position, plain.position * (-1, 1, 1), rtol=1e-3, atol=1e-3)
    np.testing.assert_allclose(mirrored.range_sigma, plain.range_sigma, rtol=1e-3)


@given(yaw=yaws, roll=st.floats(-180, 180))
@settings(max_examples=40)
def test_rotating_about_the_optical_axis_changes_nothing_without_gravity(yaw, roll):
    cos, sin = np.cos(np.radians(roll)), np.sin(np.radians(roll))
    turn = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])
    body = standing_at((0.3, 0.1, 5.0), yaw_deg=yaw)
    plain, rolled = measure(seen(body)), measure(seen(body @ turn.T))
    np.testing.assert_allclose(rolled.range, plain.range, rtol=1e-3)
    np.testing.assert_allclose(rolled.position, plain.position @ turn.T, atol=1e-2)
    np.testing.assert_allclose(rolled.range_sigma, plain.range_sigma, rtol=1e-3)


@given(
    yaw=yaws, distance=ranges, data=st.data(),
    scores=st.lists(st.floats(0.2, 1.0), min_size=18, max_size=18))
@settings(max_examples=80)
def test_a_lower_score_never_shrinks_sigma(yaw, distance, data, scores):
    people = seen(standing_at((0, 0, distance), yaw_deg=yaw), convention='movenet')
    keypoints = people.keypoints.copy()
    keypoints[0, :, 2] = scores
    worse = keypoints.copy()
    rows = data.draw(st.sets(st.integers(0, 17), min_size=1))
    worse[0, list(rows), 2] *= data.draw(st.floats(0.5, 1.0))
    sure, unsure = (measure(People(k, people.track_ids, convention='movenet'))
                    for k in (keypoints, worse))
    if unsure.known[0]:
        assert unsure.range_sigma[0] >= sure.range_sigma[0] * (1 - 1e-5)


# Knowledge


def test_a_known_stature_narrows_sigma_and_moves_the_range_towards_it():
    people = seen(standing_at((0, 0, 6.0)))
    plain = measure(people)
    told = measure(people, estimator=make_estimator(
        'skeleton', body=Body(stature=1.69, stature_sigma=0.01)))
    tall = measure(people, estimator=make_estimator(
        'skeleton', body=Body(stature=1.85, stature_sigma=0.01)))
    assert told.range_sigma[0] < 0.8 * plain.range_sigma[0]
    assert tall.range[0] > 1.04 * told.range[0]


def test_a_wider_known_shoulder_means_farther():
    people = only(seen(standing_at((0, 0, 6.0))), *SHOULDERS, *HIPS)
    narrow, wide = (measure(people, estimator=make_estimator(
        'skeleton', body=Body(shoulder_width=width, shoulder_width_sigma=0.02)))
        for width in (0.31, 0.37))
    assert wide.range[0] > 1.02 * narrow.range[0]


def test_where_children_may_be_sigma_is_wider_and_a_small_person_nearer():
    small = seen(standing_at((0, 0, 4.0), size=0.7))
    adults, anyone = (measure(small, estimator=make_estimator(
        'skeleton', body=Body(children=children))) for children in (False, True))
    assert anyone.range[0] < adults.range[0]
    assert anyone.range_sigma[0] / anyone.range[0] > adults.range_sigma[0] / adults.range[0]


# Ground


def standing_on(level, *, size=1.0, height=1.6, distance=5.0):
    neck = (0.3, height - level - NECK_HEIGHT * size, distance)
    return seen(standing_at(neck, size=size)), np.linalg.norm(neck)


def test_with_height_and_gravity_the_ground_narrows_sigma_and_corrects_a_tall_body():
    mounting = Mounting(gravity=DOWN, gravity_sigma=0.005, height=1.6, height_sigma=0.02)
    people, truth = standing_on(0.0, size=1.08)
    body, both = measure(people), measure(people, mounting)
    assert both.cues[0] == Cue.SKELETON | Cue.GROUND
    assert body.cues[0] == Cue.SKELETON
    assert both.range_sigma[0] < body.range_sigma[0]
    assert abs(both.range[0] - truth) < abs(body.range[0] - truth)


def test_someone_on_a_box_contradicts_the_ground_which_is_left_out():
    mounting = Mounting(gravity=DOWN, gravity_sigma=0.005, height=1.6, height_sigma=0.02)
    people, truth = standing_on(0.6)
    both = measure(people, mounting)
    assert both.cues[0] == Cue.SKELETON
    assert_true(both, truth)


def test_a_gravity_nobody_can_rely_on_is_not_used():
    people = seen(standing_at((0, 0, 5.0)))
    wrong = Mounting(gravity=np.array([1.0, 0.0, 0.0]), gravity_sigma=0.5)
    assert measure(people, wrong).range[0] == measure(people).range[0]


# Bad input


def reason_of(keypoints, mounting=Mounting()):
    keypoints = np.asarray(keypoints, np.float32).reshape(-1, 18, 3)
    people = People(keypoints, np.arange(len(keypoints), dtype=np.int32), convention='mesh')
    distances = measure(people, mounting)
    assert np.isfinite(distances.range).all() == distances.known.all()
    return [Reason(reason) for reason in distances.reason]


GOOD = seen(standing_at((0, 0, 5.0))).keypoints[0]


def changed(value, rows=slice(None), columns=slice(None)):
    keypoints = GOOD.copy()
    keypoints[rows, columns] = value
    return keypoints


@pytest.mark.parametrize(('keypoints', 'reason'), [
    (changed(np.nan), Reason.TOO_FEW_KEYPOINTS),
    (changed(np.inf), Reason.TOO_FEW_KEYPOINTS),
    (changed(np.nan, slice(1, None)), Reason.TOO_FEW_KEYPOINTS),
    (changed(0.0, columns=2), Reason.TOO_FEW_KEYPOINTS),
    (changed(np.nan, columns=2), Reason.TOO_FEW_KEYPOINTS),
    (changed((600.0, 300.0), columns=slice(2)), Reason.TOO_FEW_KEYPOINTS),
    (changed(np.nan, [0, 1, 2, 3, 5, 6, 7, 8, 9, 11, 12, 13, 14, 15, 16, 17]),
     Reason.TOO_FEW_KEYPOINTS),
    (GOOD * (0.004, 0.004, 1), Reason.TOO_FEW_KEYPOINTS),
    (changed((1270.0, 10.0), 4, slice(2)), Reason.IMPLAUSIBLE_SKELETON),
    (changed((1e9, -1e9), 4, slice(2)), Reason.NONE),
    (GOOD, Reason.NONE),
    (changed(np.nan, 4), Reason.NONE),
    (changed((np.inf, 3.0, 1.0), 4), Reason.NONE),
])
def test_bad_keypoints_give_a_reason_and_never_raise(keypoints, reason):
    assert reason_of(keypoints) == [reason]


def test_farther_than_any_person_can_be_told_is_out_of_range():
    camera = Intrinsics(1280, 720, 54000.0, 54000.0, 639.5, 359.5)
    people = seen(standing_at((0, 0, 5.0)))
    assert measure(people, camera=camera).reason[0] == Reason.OUT_OF_RANGE


def test_a_keypoint_marked_twice_counts_once():
    keypoints = GOOD.copy()
    keypoints[Keypoint.R_WRIST] = keypoints[Keypoint.L_WRIST]
    assert reason_of(keypoints) == [Reason.NONE]
    alone = changed(np.nan, [row for row in Keypoint if row not in (4, 7)])
    alone[Keypoint.R_WRIST] = alone[Keypoint.L_WRIST]
    assert reason_of(alone) == [Reason.TOO_FEW_KEYPOINTS]


def test_upside_down_is_implausible_only_where_gravity_is_known():
    body = standing_at((0, 0, 5.0))
    hanging = seen(body * (-1, -1, 1)).keypoints
    assert reason_of(hanging) == [Reason.NONE]
    assert reason_of(hanging, Mounting(gravity=DOWN)) == [Reason.IMPLAUSIBLE_SKELETON]


def test_a_bad_person_does_not_disturb_the_others():
    bodies = [standing_at((x, 0, 5.0)) for x in (-1, 0, 1)]
    people = seen(bodies)
    alone = measure(seen(bodies[2]))
    people.keypoints[1] = np.inf
    together = measure(people)
    assert list(together.known) == [True, False, True]
    np.testing.assert_allclose(together.range[2], alone.range[0], rtol=1e-5)
    assert len(measure(People.nobody())) == 0


def test_the_body_of_the_tests_is_an_average_one():
    body = average_body()
    assert np.linalg.norm(body[2] - body[5]) == pytest.approx(0.336)
    assert body[Keypoint.L_ANKLE, 2] + NECK_HEIGHT == pytest.approx(0.09)
