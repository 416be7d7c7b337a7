"""The networks find in photographs what the original graphs find, and where the shoulders are."""
from __future__ import annotations

import cv2
import matplotlib.cbook
import matplotlib.image
from movenet_original import ORIGINAL
import numpy as np
import onnxruntime
import pytest
import skimage.data

from depth_person.camera.frame import Frame
from depth_person.pose.movenet import MoveNet
from depth_person.pose.pipeline import PoseEstimator, PoseOptions
from depth_person.pose.skeleton import COCO17_ROWS, Keypoint

SIDES = {'movenet-lightning': 192, 'movenet-thunder': 256, 'movenet-multipose': 256}

#: Right and left shoulder in pixels of the photograph, told by eye.
SHOULDERS = {'astronaut': [(105, 245), (315, 262)], 'grace_hopper': [(76, 425), (460, 425)]}


def photograph(name):
    """Return a photograph that a package carries, as BGR."""
    if name == 'astronaut':
        rgb = skimage.data.astronaut()
    else:
        path = matplotlib.cbook.get_sample_data('grace_hopper.jpg', asfileobj=False)
        rgb = matplotlib.image.imread(path)
    return np.ascontiguousarray(rgb[:, :, ::-1])


def fitted(image, side):
    """Return an image as the original graphs were given it."""
    scale = side / max(image.shape[:2])
    height, width = (round(length * scale) for length in image.shape[:2])
    result = np.zeros((side, side, 3), np.uint8)
    result[:height, :width] = cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA)
    return result


@pytest.mark.parametrize(('model', 'photo'), list(ORIGINAL))
def test_keypoints_and_scores_are_those_of_the_original_graph(network, model, photo):
    side, least = SIDES[model], 1e-3
    movenet = MoveNet(network(model), input_size=side, min_score=least, max_people=20)
    person = movenet(fitted(photograph(photo), side))[0]
    expected = np.array(ORIGINAL[model, photo])[:, [1, 0, 2]]
    found = np.empty((17, 3))
    marked = COCO17_ROWS >= 0
    found[COCO17_ROWS[marked]] = person[marked]
    found[:, :2] = (found[:, :2] + 0.5) / side
    scored = expected[:, 2] > 2 * least
    np.testing.assert_allclose(found[scored], expected[scored], rtol=0, atol=1e-3)
    assert not (found[~scored, 2] > 3 * least).any()


@pytest.mark.parametrize('input_size', [256, PoseOptions().input_size])
@pytest.mark.parametrize('model', list(SIDES))
@pytest.mark.parametrize('photo', list(SHOULDERS))
def test_shoulders_are_found_where_they_are(network, model, photo, input_size):
    estimator = PoseEstimator(PoseOptions(model=str(network(model)), input_size=input_size))
    image = photograph(photo)
    people = estimator.estimate(Frame(image, stamp_ns=0, frame_id='camera_optical_frame'))
    assert len(people) == 1
    shoulders = people.keypoints[0, [Keypoint.R_SHOULDER, Keypoint.L_SHOULDER], :2]
    np.testing.assert_allclose(shoulders, SHOULDERS[photo], atol=0.06 * image.shape[1])


def test_nine_people_are_nine_though_the_original_stops_at_six(network):
    image = photograph('astronaut')
    side = len(image)
    movenet = MoveNet(
        network('movenet-multipose'), input_size=768, min_score=0.2, max_people=20)
    noses = movenet(np.tile(image, (3, 3, 1)))[:, Keypoint.NOSE, :2]
    assert len(noses) == 9
    cells, places = np.divmod(noses, side)
    assert len(np.unique(cells, axis=0)) == 9
    np.testing.assert_allclose(places, [(222, 122)] * 9, atol=5)


def test_a_network_for_one_person_takes_a_batch(network):
    session = onnxruntime.InferenceSession(network('movenet-lightning'))
    images = np.stack([fitted(photograph(photo), 192) for photo in SHOULDERS])
    together = session.run(None, {'image': images})
    for index in range(len(images)):
        alone = session.run(None, {'image': images[index:index + 1]})
        for one, all_ in zip(alone, together, strict=True):
            np.testing.assert_allclose(one[0], all_[index], atol=1e-3)


@pytest.mark.parametrize('size', [(32, 32), (64, 96), (288, 512)])
def test_the_network_for_many_takes_any_multiple_of_32(network, size):
    session = onnxruntime.InferenceSession(network('movenet-multipose'))
    center, *_ = session.run(None, {'image': np.zeros((1, *size, 3), np.uint8)})
    assert center.shape == (1, 1, size[0] // 4, size[1] // 4)
