import warnings

from average_body import CAMERA, only, seen, standing_at
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
import numpy as np
import pytest

from depth_person.camera.intrinsics import Intrinsics
from depth_person.distance.conventions import CONVENTIONS
from depth_person.distance.estimator import Body, Cue, Distances, Mounting, Reason
from depth_person.distance.estimators import ESTIMATORS, make_estimator
from depth_person.distance.shoulder import ShoulderEstimator
from depth_person.errors import DepthPersonError
from depth_person.pose.people import People
from depth_person.pose.skeleton import Keypoint

#: The average body's shoulders are this far apart.
BODY = Body(shoulder_width=0.336)
LENS = Intrinsics(
    1280, 720, 700.0, 820.0, 630.0, 365.0, 'plumb_bob', (-0.2, 0.05, 0.001, -0.001, 0.0))


@pytest.fixture(autouse=True)
def _warnings_are_errors():
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        yield


def measure(people, *, body=BODY, camera=CAMERA):
    return ShoulderEstimator(body).estimate(people, camera)


def with_neck(people):
    """Return the people as a network that marks the neck itself gives them."""
    return People(people.keypoints, people.track_ids, True, people.convention)


def person(left, right, neck=None, *, score=1.0):
    """Return one person of two shoulders, and a measured neck if there is one."""
    keypoints = np.full((1, 18, 3), np.nan, np.float32)
    for row, pixel in ((Keypoint.L_SHOULDER, left), (Keypoint.R_SHOULDER, right),
                       (Keypoint.NECK, neck)):
        if pixel is not None:
            keypoints[0, row] = (*pixel, score)
    return People(keypoints, np.zeros(1, np.int32), neck is not None, 'mesh')


@pytest.mark.parametrize('camera', [CAMERA, LENS], ids=['pinhole', 'lens with fx != fy'])
@pytest.mark.parametrize('position', [(0, 0, 3), (2, -1, 6), (-5, 1, 12)])
def test_shoulders_parallel_to_the_image_are_where_they_are(camera, position):
    distances = measure(seen(standing_at(position), camera=camera), camera=camera)
    np.testing.assert_allclose(distances.position[0], position, rtol=1e-3, atol=1e-3)
    assert distances.range[0] == pytest.approx(np.linalg.norm(position), rel=1e-3)
    assert distances.depth[0] == pytest.approx(position[2], rel=1e-3)
    assert distances.cues[0] == Cue.SHOULDERS
    assert distances.reason[0] == Reason.NONE


@pytest.mark.parametrize('camera', [CAMERA, LENS], ids=['pinhole', 'lens with fx != fy'])
@pytest.mark.parametrize('yaw_deg', [-50, -20, 35, 150])
def test_a_measured_neck_tells_the_turning_and_the_midpoint_does_not(camera, yaw_deg):
    people = seen(standing_at((0, 0.3, 3), yaw_deg=yaw_deg), camera=camera)
    told = measure(with_neck(people), camera=camera)
    np.testing.assert_allclose(told.position[0], (0, 0.3, 3), rtol=0.01, atol=0.01)
    assert told.cues[0] == Cue.SHOULDERS | Cue.NECK
    blind = measure(people, camera=camera)
    assert blind.depth[0] == pytest.approx(3 / abs(np.cos(np.radians(yaw_deg))), rel=0.02)


def test_someone_who_faces_the_camera_off_its_axis_reads_short_by_the_cosine():
    bearing = np.radians(30)
    position = 8 * np.array([np.sin(bearing), 0, np.cos(bearing)])
    distances = measure(seen(standing_at(position, yaw_deg=-30)))
    assert distances.depth[0] == pytest.approx(position[2] * np.cos(bearing), rel=0.01)


def test_the_paper_s_width_is_assumed_where_none_is_given():
    people = seen(standing_at((0, 0, 5)))
    assert measure(people, body=Body()).range[0] == pytest.approx(5 * 0.35 / 0.336, rel=1e-3)


def test_a_missing_neck_falls_back_on_the_midpoint():
    people = with_neck(only(seen(standing_at((0, 0, 5))), 'L_SHOULDER', 'R_SHOULDER'))
    distances = measure(people)
    assert distances.range[0] == pytest.approx(5, rel=1e-3)
    assert distances.cues[0] == Cue.SHOULDERS


@pytest.mark.parametrize(('left', 'right', 'neck', 'reason'), [
    (None, (600, 300), None, Reason.NO_SHOULDERS),
    (None, None, None, Reason.NO_SHOULDERS),
    ((np.inf, 300), (600, 300), None, Reason.NO_SHOULDERS),
    ((600, 300), (600, 300), None, Reason.COINCIDENT_SHOULDERS),
    ((602, 300), (600, 300), None, Reason.COINCIDENT_SHOULDERS),
    ((650, 300), (600, 300), (700, 300), Reason.IMPLAUSIBLE_SKELETON),
    ((650, 300), (600, 300), (650, 250), Reason.IMPLAUSIBLE_SKELETON),
    ((650, 300), (600, 300), None, Reason.NONE),
    ((650, 300), (600, 300), (625, 290), Reason.NONE),
])
def test_a_person_without_a_range_has_a_reason_and_nothing_else(left, right, neck, reason):
    distances = measure(person(left, right, neck))
    assert distances.reason.tolist() == [reason]
    numbers = np.concatenate([distances.range, distances.range_sigma, distances.position[0]])
    if reason:
        assert np.isnan(numbers).all()
        assert distances.cues[0] == Cue.NONE
    else:
        assert np.isfinite(numbers).all()
    assert distances.known.tolist() == [not reason]


def test_people_beyond_a_hundred_metres_are_out_of_range():
    tele = Intrinsics(1280, 720, 20000.0, 20000.0, 639.5, 359.5)
    people = seen([standing_at((0, 0, z)) for z in (90, 110)], camera=tele)
    assert measure(people, camera=tele).reason.tolist() == [Reason.NONE, Reason.OUT_OF_RANGE]


def test_nobody_is_no_distances():
    assert len(measure(People.nobody())) == 0
    assert len(measure(People.nobody(), camera=LENS)) == 0


@pytest.mark.parametrize(('measured', 'yaw_deg'), [(False, 0), (False, 40), (True, 20)])
def test_sigma_is_the_spread_that_the_noise_makes(measured, yaw_deg):
    people = seen([standing_at((0.5, 0, 2.5), yaw_deg=yaw_deg)] * 4000)
    if measured:
        people = with_neck(people)
    px_per_m = np.array([CAMERA.fx / 2.5])
    noise_px = CONVENTIONS['mesh'].noise_px(np.ones((1, 18)), px_per_m=px_per_m)[0, 0]
    random = np.random.default_rng(3)
    noisy = people.keypoints.copy()
    noisy[..., :2] += random.normal(0, noise_px, noisy[..., :2].shape)
    body = Body(shoulder_width=0.336, shoulder_width_sigma=0.0)
    clean = measure(People(people.keypoints[:1], people.track_ids[:1], measured, 'mesh'),
                    body=body)
    shaken = measure(People(noisy, people.track_ids, measured, 'mesh'), body=body)
    spread = np.nanstd(np.log(shaken.range)) * clean.range[0]
    assert clean.range_sigma[0] == pytest.approx(spread, rel=0.15)


def test_the_spread_of_shoulder_widths_is_part_of_sigma():
    people = seen(standing_at((0, 0, 5)))
    sure, unsure = (measure(people, body=Body(shoulder_width=0.336, shoulder_width_sigma=sigma))
                    for sigma in (0.0, 0.2))
    assert unsure.range_sigma[0] ** 2 - sure.range_sigma[0] ** 2 == pytest.approx(1.0, rel=0.01)


@given(st.lists(st.floats(0.2, 1.0), min_size=2, max_size=2), st.booleans())
def test_a_lower_score_never_shrinks_sigma(scores, measured):
    unsure, sure = sorted(scores)
    neck = (622, 300) if measured else None
    sigma = [measure(person((665, 300), (580, 310), neck, score=score)).range_sigma[0]
             for score in (unsure, sure)]
    assert sigma[0] >= sigma[1] > 0


@given(arrays.arrays(np.float32, (3, 18, 3), elements=st.floats(width=32)), st.booleans(),
       st.sampled_from([CAMERA, LENS]))
def test_no_keypoints_raise_and_numbers_are_there_or_not_together(keypoints, measured, camera):
    people = People(keypoints, np.arange(3, dtype=np.int32), measured, 'nobody knows')
    distances = measure(people, camera=camera)
    numbers = np.column_stack([distances.range, distances.range_sigma, distances.position])
    np.testing.assert_array_equal(np.isfinite(numbers), np.repeat(distances.known[:, None], 5, 1))
    assert (distances.range[distances.known] > 0).all()
    assert (distances.range_sigma[distances.known] >= 0).all()


def test_estimators_are_made_by_name():
    for name in ESTIMATORS:
        estimator = make_estimator(name, body=BODY)
        assert estimator.name == name
        assert len(estimator.estimate(seen(standing_at((0, 0, 5))), CAMERA, Mounting())) == 1
    with pytest.raises(DepthPersonError, match=r'no estimator .pixie.; there are .*shoulder'):
        make_estimator('pixie')


@pytest.mark.parametrize('wrong', [
    {'shoulder_width': 0.0}, {'shoulder_width': 35.0}, {'shoulder_width': np.nan},
    {'stature': -1.7}, {'stature': 170.0}, {'stature_sigma': -0.1},
    {'shoulder_width_sigma': np.nan}, {'shoulder_width_sigma': 3.0}])
def test_a_body_that_nobody_has_is_refused(wrong):
    with pytest.raises(DepthPersonError, match='between'):
        Body(**wrong)


def test_distances_of_people_without_any_are_all_nan():
    distances = Distances.none(2, Reason.UNCALIBRATED)
    assert distances.reason.tolist() == [Reason.UNCALIBRATED] * 2
    assert np.isnan(distances.position).all()
    assert np.isnan(distances.range_sigma).all()
    assert not distances.known.any()
