import subprocess
import sys

from average_body import CAMERA, only, seen, standing_at
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
import numpy as np
import onnx
import pytest

from depth_person.camera.intrinsics import Intrinsics
from depth_person.distance.body_dimensions import (
    BodyDimensionsEstimator,
    BodyDimensionsModel,
    FEATURES,
    model_file,
    SMALLEST_SIGMA,
)
from depth_person.distance.estimator import Body, Cue, Mounting, Reason
from depth_person.distance.estimators import make_estimator
from depth_person.errors import DepthPersonError
from depth_person.pose.people import People
from depth_person.pose.skeleton import Keypoint

ESTIMATOR = make_estimator('body_dimensions')
PAPER = BodyDimensionsEstimator(model=BodyDimensionsModel(model_file('paper')))
PAPER_CAMERA = Intrinsics(6000, 4000, 24 / 3.9e-3, 24 / 3.9e-3, 2999.5, 1999.5)
DOWN = np.array([0.0, 1.0, 0.0])


@given(distance=st.floats(3.5, 25), yaw=st.floats(-180, 180), x=st.floats(-0.3, 0.3))
@settings(max_examples=30)
def test_an_average_adult_is_found_within_sigma_at_any_range_and_yaw(distance, yaw, x):
    position = np.array([x, -0.08, 1.0]) * distance
    distances, height = ESTIMATOR.measure(seen(standing_at(position, yaw_deg=yaw)), CAMERA)
    truth = np.linalg.norm(position)
    assert distances.known.all()
    assert abs(distances.range[0] - truth) < 2.5 * distances.range_sigma[0]
    assert distances.range_sigma[0] < 0.16 * truth
    assert distances.position[0] / distances.range[0] == pytest.approx(position / truth, abs=3e-3)
    assert 1.5 < height[0] < 1.85
    assert distances.cues[0] == Cue.BOX


def test_measuring_needs_none_of_what_training_needs():
    program = ('import sys; from depth_person.distance.estimators import make_estimator; '
               'make_estimator("body_dimensions"); '
               'print([name for name in ("sklearn", "skl2onnx", "scipy", "torch", "onnx") '
               'if name in sys.modules])')
    run = subprocess.run([sys.executable, '-c', program], capture_output=True, text=True)
    assert run.stdout.strip() == '[]', run.stderr


def test_gravity_makes_it_surer():
    people = seen(standing_at((0, 0.2, 8.0)))
    without = ESTIMATOR.estimate(people, CAMERA)
    level = ESTIMATOR.estimate(people, CAMERA, Mounting(gravity=DOWN))
    unsure = ESTIMATOR.estimate(people, CAMERA, Mounting(gravity=DOWN, gravity_sigma=0.3))
    assert level.range_sigma[0] < 0.9 * without.range_sigma[0]
    assert unsure.range[0] == without.range[0]


@pytest.mark.parametrize('size', [0.75, 1.0, 1.12])
def test_a_known_stature_takes_the_place_of_the_predicted_one(size):
    people = seen(standing_at((0, 0.2, 8.0), size=size))
    told = BodyDimensionsEstimator(Body(stature=1.69 * size, stature_sigma=0.01, children=True))
    distances, height = told.measure(people, CAMERA, Mounting(gravity=DOWN))
    assert height[0] == pytest.approx(1.69 * size, rel=1e-6)
    assert distances.range[0] == pytest.approx(np.hypot(0.2, 8.0), rel=0.06)
    loose = BodyDimensionsEstimator(Body(stature=1.69 * size, stature_sigma=0.08, children=True))
    assert loose.estimate(people, CAMERA, Mounting(gravity=DOWN)).range_sigma[0] > (
        1.2 * distances.range_sigma[0])


@pytest.mark.parametrize('names', [
    ('NOSE', 'R_SHOULDER', 'L_SHOULDER', 'R_HIP', 'L_HIP', 'R_KNEE'),
    ('R_SHOULDER', 'L_SHOULDER', 'R_HIP', 'L_HIP', 'R_ANKLE'), ('R_ANKLE',), ()])
def test_who_is_not_seen_from_head_to_ankles_has_no_range_for_that_reason(names):
    distances, height = ESTIMATOR.measure(only(seen(standing_at((0, 0, 5.0))), *names), CAMERA)
    assert distances.reason[0] == Reason.TOO_FEW_KEYPOINTS
    assert np.isnan(distances.range[0])
    assert np.isnan(height[0])


def test_a_face_and_one_ankle_are_enough():
    people = only(seen(standing_at((0, 0.2, 6.0))), 'NOSE', 'L_ANKLE')
    distances = ESTIMATOR.estimate(people, CAMERA)
    assert abs(distances.range[0] - 6.0) < 2.5 * distances.range_sigma[0]


def test_who_hangs_upside_down_is_no_person():
    people = seen(standing_at((0, 0, 5.0)))
    distances = ESTIMATOR.estimate(people, CAMERA, Mounting(gravity=-DOWN))
    assert distances.reason[0] == Reason.IMPLAUSIBLE_SKELETON


def test_who_is_a_speck_is_out_of_range():
    people = seen(standing_at((0, 0, 300.0)))
    assert ESTIMATOR.estimate(people, CAMERA).reason[0] == Reason.OUT_OF_RANGE


def test_people_are_measured_each_for_themselves():
    several = seen([standing_at((x, 0.1, z), yaw_deg=50 * x) for x, z in (
        (0, 4.0), (1, 7.0), (-2, 11.0))])
    together = ESTIMATOR.estimate(several, CAMERA)
    for i in range(3):
        alone = ESTIMATOR.estimate(
            People(several.keypoints[[i]], several.track_ids[[i]], convention='mesh'), CAMERA)
        assert alone.range[0] == pytest.approx(together.range[i], rel=1e-6)
    assert len(ESTIMATOR.estimate(People.nobody(), CAMERA)) == 0


def test_a_measured_neck_is_where_the_person_is():
    people = seen(standing_at((0, 0.2, 6.0)))
    keypoints = people.keypoints.copy()
    keypoints[0, Keypoint.NECK, 0] += 9.0
    moved = ESTIMATOR.estimate(
        People(keypoints, people.track_ids, neck_measured=True, convention='mesh'), CAMERA)
    assert moved.position[0, 0] / moved.position[0, 2] == pytest.approx(0.01, abs=1e-5)


@given(hnp.arrays(np.float32, (2, 18, 3), elements=st.floats(width=32)))
@settings(max_examples=30)
def test_no_keypoints_make_it_raise(keypoints):
    for estimator, camera in ((ESTIMATOR, CAMERA), (PAPER, PAPER_CAMERA)):
        distances = estimator.estimate(
            People(keypoints, np.arange(2, dtype=np.int32)), camera, Mounting(gravity=DOWN))
        assert np.isfinite(distances.range[distances.known]).all()
        assert (distances.range_sigma[distances.known] > 0).all()
        assert np.isnan(distances.range[~distances.known]).all()


@pytest.mark.parametrize(('depth', 'size'), [(3.81, 1.0), (5.0, 1.1), (6.5, 0.75), (6.81, 1.0)])
def test_the_paper_model_measures_before_its_own_camera(depth, size):
    # The camera is one metre above the floor, the neck 1.36 m (times size).
    people = seen(standing_at((0.3, 1.0 - 1.36 * size, depth), size=size), camera=PAPER_CAMERA)
    distances, height = PAPER.measure(people, PAPER_CAMERA)
    truth = np.linalg.norm((0.3, 1.0 - 1.36 * size, depth))
    assert distances.range[0] == pytest.approx(truth, rel=0.08)
    assert height[0] == pytest.approx(1.7 * size, rel=0.1)


@pytest.mark.parametrize('camera', [
    CAMERA, Intrinsics(6000, 4000, 4615.0, 4615.0, 2999.5, 1999.5),
    Intrinsics(4000, 6000, 24 / 3.9e-3, 24 / 3.9e-3, 1999.5, 2999.5)])
def test_the_paper_model_is_refused_before_another_camera(camera):
    with pytest.raises(DepthPersonError, match='normalised model, which holds for any camera'):
        PAPER.estimate(seen(standing_at((0, 0, 5.0))), camera)


class _Trees:
    """Gives the same answer for everybody in place of an ONNX Runtime session."""

    def __init__(self, quantiles):
        self._quantiles = np.array([quantiles], np.float32)

    def run(self, _names, feed):
        n = len(feed['features'])
        return np.full((n, 1), 1.7, np.float32), np.repeat(self._quantiles, n, axis=0)


@pytest.mark.parametrize(('quantiles', 'middle', 'sigma'), [
    ((-0.1, 0.0, 0.1), 0.0, 0.1), ((0.1, 0.0, -0.1), 0.0, 0.1), ((0.0, 0.2, 0.1), 0.1, 0.1),
    ((0.05, 0.05, 0.05), 0.05, None)])
def test_quantiles_that_cross_are_put_in_order(quantiles, middle, sigma):
    model = BodyDimensionsModel(model_file('normalised'))
    scale = model._sigma_scale
    model._session = _Trees(quantiles)
    told = model.predict(np.zeros((2, len(FEATURES['normalised']))))
    assert told.log_distance == pytest.approx([middle] * 2)
    expected = SMALLEST_SIGMA if sigma is None else scale * sigma
    assert told.log_sigma == pytest.approx([expected] * 2)


@pytest.mark.parametrize(('key', 'value'), [
    ('features', '["d2_width_px", "d1_height_px", "d3_center_x_px", "d4_center_y_px"]'),
    ('features', '[]'), ('kind', 'normalised'), ('kind', 'another')])
def test_a_model_with_another_feature_order_is_refused(tmp_path, key, value):
    model = onnx.load(model_file('paper'))
    for entry in model.metadata_props:
        if entry.key == key:
            entry.value = value
    path = tmp_path / 'other.onnx'
    onnx.save(model, path)
    with pytest.raises(DepthPersonError, match=r'other\.onnx is of kind .* and takes the fe'):
        BodyDimensionsModel(path)


@pytest.mark.parametrize('content', [b'', b'no model at all'])
def test_a_broken_model_is_refused(tmp_path, content):
    path = tmp_path / 'broken.onnx'
    path.write_bytes(content)
    with pytest.raises(DepthPersonError, match=r'cannot open .*broken\.onnx'):
        BodyDimensionsModel(path)


def test_a_model_without_metadata_is_refused(tmp_path):
    model = onnx.load(model_file('paper'))
    del model.metadata_props[:]
    onnx.save(model, tmp_path / 'bare.onnx')
    with pytest.raises(DepthPersonError, match='none named'):
        BodyDimensionsModel(tmp_path / 'bare.onnx')
