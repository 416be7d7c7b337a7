"""PoseEstimator gives tracked people, and says what is wrong with what it is told."""
from __future__ import annotations

import numpy as np
import pytest
import skimage.data

from depth_person.camera.frame import Frame
from depth_person.errors import DepthPersonError
from depth_person.pose.movenet import MoveNet
from depth_person.pose.pipeline import PoseEstimator, PoseOptions
from depth_person.pose.runtime import open_session, Session
from depth_person.pose.skeleton import Keypoint


@pytest.fixture(scope='module')
def scene():
    """Return a frame-sized image with one person in it, who is not in its upper left."""
    image = np.full((480, 640, 3), 90, np.uint8)
    image[200:456, 300:556] = skimage.data.astronaut()[::2, ::2, ::-1]
    return image


def frame(image, stamp_ns=0):
    return Frame(image, stamp_ns=stamp_ns, frame_id='camera_optical_frame')


def test_a_person_keeps_one_track_over_frames(network, scene):
    estimator = PoseEstimator(PoseOptions(model=str(network('movenet-multipose'))))
    tracks = [
        estimator.estimate(frame(np.roll(scene, 4 * index, 1), index * 50_000_000)).track_ids
        for index in range(4)]
    np.testing.assert_array_equal(tracks, [[1]] * 4)
    assert 0 < estimator.inference_s < 60


@pytest.fixture(scope='module')
def person(network, scene):
    estimator = PoseEstimator(PoseOptions(
        model=str(network('movenet-multipose')), min_score=0.3))
    return estimator.estimate(frame(scene)).keypoints[0]


def test_a_keypoint_is_whole_or_missing(person):
    missing = np.isnan(person)
    np.testing.assert_array_equal(missing.any(1), missing.all(1))
    assert missing.any()  # her knees and ankles are not in the picture


def test_scores_are_between_the_least_and_one(person):
    scores = person[np.isfinite(person[:, 2]), 2]
    assert (scores >= 0.3).all()
    assert (scores <= 1).all()


def test_the_neck_is_between_the_shoulders_and_not_measured(network, scene, person):
    shoulders = person[[Keypoint.R_SHOULDER, Keypoint.L_SHOULDER]]
    np.testing.assert_allclose(person[Keypoint.NECK, :2], shoulders[:, :2].mean(0), atol=1e-3)
    estimator = PoseEstimator(PoseOptions(model=str(network('movenet-multipose'))))
    assert not estimator.estimate(frame(scene)).neck_measured


@pytest.mark.parametrize('model', ['movenet-multipose', 'movenet-lightning'])
def test_nobody_is_found_where_nobody_is(network, model):
    estimator = PoseEstimator(PoseOptions(model=str(network(model))))
    people = estimator.estimate(frame(np.full((720, 1280, 3), 127, np.uint8)))
    assert people.keypoints.shape == (0, 18, 3)


def test_a_frame_of_one_pixel_shows_nobody(network):
    estimator = PoseEstimator(PoseOptions(model=str(network('movenet-multipose'))))
    assert len(estimator.estimate(frame(np.zeros((1, 1, 3), np.uint8)))) == 0


@pytest.mark.parametrize('image', [
    np.zeros((480, 640, 4), np.uint8), np.zeros((480, 640), np.uint8),
    np.zeros((480, 640, 3), np.uint16), np.zeros((0, 640, 3), np.uint8)])
def test_movenet_takes_no_other_images(network, scene, image):
    movenet = MoveNet(
        network('movenet-multipose'), input_size=256, min_score=0.2, max_people=6)
    assert len(movenet(scene)) == 1
    with pytest.raises(DepthPersonError, match='is no \\(height, width, 3\\) uint8'):
        movenet(image)


@pytest.mark.parametrize('refiner', ['none', 'movenet-lightning'])
def test_heads_that_are_no_numbers_are_an_error_not_an_empty_scene(network, scene, monkeypatch,
                                                                   refiner):
    estimator = PoseEstimator(PoseOptions(model=str(network('movenet-multipose')),
                                          refiner=refiner))
    run = Session.run

    def damaged(session, names, feed):
        is_refiner = 'movenet-lightning' in session.name
        broken = is_refiner or refiner == 'none'
        return [head * np.float32(np.nan if broken else 1) for head in run(session, names, feed)]

    monkeypatch.setattr(Session, 'run', damaged)
    with pytest.raises(DepthPersonError, match='holds NaN or infinity'):
        estimator.estimate(frame(scene))


def test_only_so_many_people_are_kept(network, scene):
    crowd = np.concatenate([scene[150:, 250:]] * 2, 1)
    for max_people in (1, 2):
        estimator = PoseEstimator(PoseOptions(
            model=str(network('movenet-multipose')), max_people=max_people))
        assert len(estimator.estimate(frame(crowd))) == max_people


def test_frames_may_change_their_size(network, scene):
    estimator = PoseEstimator(PoseOptions(model=str(network('movenet-multipose'))))
    whole = estimator.estimate(frame(scene)).keypoints[0]
    larger = np.repeat(np.repeat(scene, 2, 0), 2, 1)
    doubled = estimator.estimate(frame(larger, 1)).keypoints[0]
    seen = np.isfinite(whole[:, 2]) & np.isfinite(doubled[:, 2])
    # The centre of pixel n becomes that of the pixels 2 n and 2 n + 1.
    apart = np.abs(doubled[seen, :2] - (2 * whole[seen, :2] + 0.5))
    assert np.median(apart) < 3.2  # a pixel of the crop is 4 wide here


@pytest.mark.parametrize(('options', 'message'), [
    ({'input_size': 500}, 'input_size 500 is not a multiple of 32'),
    ({'input_size': 0}, 'input_size 0'),
    ({'input_size': 4096}, 'from 128 to 2048'),
    ({'min_score': 0.0}, 'min_score 0 is not between 0 and 1'),
    ({'min_score': float('nan')}, 'min_score nan'),
    ({'max_people': 0}, 'max_people 0 is not from 1 to 100'),
    ({'threads': -1}, 'threads -1 is negative'),
    ({'provider': 'gpu'}, "unknown provider 'gpu'; choose cpu, cuda, tensorrt, openvino"),
])
def test_options_out_of_their_range_are_refused(options, message):
    with pytest.raises(DepthPersonError, match=message):
        PoseOptions(**options)


def test_a_provider_that_is_not_here_is_refused_with_those_that_are(network):
    with pytest.raises(DepthPersonError, match=r"no provider 'tensorrt' here; it has cpu"):
        open_session(network('movenet-lightning'), provider='tensorrt')


@pytest.mark.parametrize('content', [b'', b'not a network', None])
def test_a_file_that_is_no_whole_network_is_refused(network, tmp_path, content):
    path = tmp_path / 'net.onnx'
    if content is None:
        content = network('movenet-lightning').read_bytes()[:100_000]
    path.write_bytes(content)
    with pytest.raises(DepthPersonError, match=r'cannot open .*net\.onnx'):
        MoveNet(path, input_size=256, min_score=0.2, max_people=1)
