"""A person at a known distance tells the camera's focal length, or their own size."""
from average_body import seen, standing_at
import cv2
import numpy as np
import pytest
import yaml

from depth_person.camera.calibration import load_camera_info, save_camera_info
from depth_person.camera.intrinsics import Intrinsics
from depth_person.cli import main
from depth_person.distance.estimator import Body
from depth_person.distance.estimators import make_estimator
from depth_person.distance.person_calibration import (
    focal_length,
    largest_person,
    shoulder_width,
    Stand,
    stature,
)
from depth_person.errors import DepthPersonError
from depth_person.pose import pipeline
from depth_person.pose.people import People

CAMERA = Intrinsics(1280, 720, 900.0, 900.0, 639.5, 359.5)
#: Of the average body.
WIDTH, STATURE = 0.336, 1.69


def stand(distance, *, yaw_deg=0.0, size=1.0, frames=20, noise=0.5, sigma=0.03, seed=1):
    rng = np.random.default_rng(seed)
    body = standing_at((0.1, 0.0, np.sqrt(distance ** 2 - 0.01)), yaw_deg=yaw_deg, size=size)
    people = seen(np.repeat(body[None], frames, axis=0), camera=CAMERA)
    people.keypoints[..., :2] += rng.normal(0, noise, (frames, 18, 2))
    people.keypoints[:, 1, :2] = people.keypoints[:, [2, 5], :2].mean(axis=1)
    return Stand(people, distance, sigma)


def found_focal_length(stands, estimator='skeleton', **body):
    return focal_length(
        stands, width=1280, height=720,
        estimator=make_estimator(estimator, body=Body(**body)))


@pytest.mark.parametrize(('estimator', 'body'), [
    ('shoulder', {'shoulder_width': WIDTH}), ('skeleton', {'shoulder_width': WIDTH}),
    ('skeleton', {'stature': STATURE}),
    ('skeleton', {'shoulder_width': WIDTH, 'shoulder_width_sigma': 0.02}),
])
def test_the_focal_length_is_right_within_its_sigma(estimator, body):
    result = found_focal_length([stand(3.0), stand(5.0, seed=2)], estimator, **body)
    assert result.value == pytest.approx(900.0, abs=2 * result.sigma)
    assert 0.003 < result.sigma / result.value < 0.1
    assert result.frames == 40


def test_a_wrong_shoulder_width_shows_in_the_focal_length():
    right = found_focal_length([stand(4.0)], 'shoulder', shoulder_width=WIDTH)
    wrong = found_focal_length([stand(4.0)], 'shoulder', shoulder_width=WIDTH * 1.1)
    assert wrong.value == pytest.approx(right.value / 1.1, rel=1e-3)


def test_more_distances_leave_what_the_body_leaves():
    body = {'shoulder_width': WIDTH, 'shoulder_width_sigma': 0.05}
    one = found_focal_length([stand(4.0)], **body)
    three = found_focal_length([stand(3.0), stand(4.0), stand(5.0)], **body)
    assert three.sigma <= one.sigma * 1.05
    assert three.sigma > one.sigma / np.sqrt(3) * 1.2


def test_distances_that_contradict_each_other_are_named():
    lied = Stand(stand(5.0).people, 4.0, 0.03)
    with pytest.raises(DepthPersonError, match=r'contradict each other.* at 3 m.* at 4 m'):
        found_focal_length([stand(3.0), lied], stature=STATURE)


@pytest.mark.parametrize('size', [0.9, 1.0, 1.08])
def test_stature_and_shoulder_width_come_back(size):
    stands = [stand(3.0, size=size), stand(4.5, size=size, seed=3)]
    wide, tall = shoulder_width(stands, CAMERA), stature(stands, CAMERA)
    assert wide.value == pytest.approx(WIDTH * size, abs=2 * wide.sigma)
    assert tall.value == pytest.approx(STATURE * size, abs=2 * tall.sigma)
    assert wide.sigma < 0.02
    assert tall.sigma < 0.12


def test_a_person_who_turns_is_asked_to_face_the_camera():
    turning = [stand(4.0, yaw_deg=yaw, frames=6) for yaw in (0, 25, 50, 70, 85)]
    with pytest.raises(DepthPersonError, match='facing the camera'):
        shoulder_width(turning, CAMERA)


@pytest.mark.parametrize(('distance', 'sigma'), [(0.0, 0.05), (-3.0, 0.05), (3.0, 2.0)])
def test_a_distance_of_no_use_is_refused(distance, sigma):
    with pytest.raises(DepthPersonError, match='of no use'):
        Stand(stand(3.0).people, distance, sigma)


def test_too_few_frames_are_refused():
    with pytest.raises(DepthPersonError, match='2 frames tell something, 5 are needed'):
        found_focal_length([stand(3.0, frames=2)])


def test_of_several_people_the_largest_is_taken():
    near, far = standing_at((0.0, 0.0, 3.0)), standing_at((1.0, 0.0, 6.0))
    lost = np.full((18, 3), np.nan)
    people = seen(np.stack([far, lost, near]))
    assert largest_person(people).track_ids.tolist() == people.track_ids[2:].tolist()
    assert len(largest_person(People.nobody())) == 0


@pytest.fixture
def three_metres(tmp_path, monkeypatch):
    """A folder of images in which a faultless network sees the average body at 3 m."""
    people = stand(3.0, frames=1).people

    class Faultless:
        def __init__(self, options):
            pass

        def estimate(self, frame):
            return people

    monkeypatch.setattr(pipeline, 'PoseEstimator', Faultless)
    folder = tmp_path / 'three_metres'
    folder.mkdir()
    for i in range(6):
        cv2.imwrite(str(folder / f'{i}.png'), np.zeros((720, 1280, 3), np.uint8))
    return folder


def test_the_command_writes_the_focal_length_of_a_person(three_metres, tmp_path, capsys):
    out = tmp_path / 'camera.yaml'
    assert main(['calibrate', '--at', '3', str(three_metres), '--stature', str(STATURE),
                 '-o', str(out)]) == 0
    _, found = load_camera_info(str(out))
    assert found.fx == pytest.approx(900.0, rel=0.05)
    assert (found.width, found.height) == (1280, 720)
    assert 'from 6 frames' in capsys.readouterr().out


def test_the_command_writes_the_parameters_of_a_person(three_metres, tmp_path):
    camera, out = tmp_path / 'camera.yaml', tmp_path / 'me.yaml'
    save_camera_info(camera, 'camera', CAMERA)
    assert main(['calibrate', '--person', '--camera-info-url', str(camera),
                 '--at', '3', str(three_metres), '-o', str(out)]) == 0
    parameters = yaml.safe_load(out.read_text())['/**/depth_node']['ros__parameters']
    assert parameters['shoulder_width'] == pytest.approx(WIDTH, abs=0.01)
    assert parameters['stature'] == pytest.approx(STATURE, abs=0.1)
    assert 0.01 < parameters['shoulder_width_sigma'] < 0.05


@pytest.mark.parametrize(('size', 'complaint'), [
    ((640, 480), 'calibrate at the size in use'), (None, '--person needs the camera')])
def test_a_person_needs_the_calibration_of_this_camera(
        three_metres, tmp_path, capsys, size, complaint):
    options = []
    if size is not None:
        save_camera_info(tmp_path / 'c.yaml', 'camera', CAMERA.scaled(width=640, height=480))
        options = ['--camera-info-url', str(tmp_path / 'c.yaml')]
    assert main(['calibrate', '--person', *options, '--at', '3', str(three_metres),
                 '-o', str(tmp_path / 'me.yaml')]) == 1
    assert complaint in capsys.readouterr().err


def test_a_distance_that_is_no_number_is_named(three_metres, tmp_path, capsys):
    assert main(['calibrate', '--at', 'three', str(three_metres),
                 '-o', str(tmp_path / 'c.yaml')]) == 1
    assert "not 'three'" in capsys.readouterr().err
