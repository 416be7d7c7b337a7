from average_body import CAMERA, seen, standing_at
import cv2
import numpy as np
import pytest

from depth_person.distance.estimators import make_estimator
from depth_person.distance.training.augment import AnnotatedImage, brightened, scaled, shifted
from depth_person.errors import DepthPersonError
from depth_person.pose.people import People

SPOT = (700.0, 300.0)


def example():
    """Return a black image with one white spot, which is the nose, in a box."""
    image = np.zeros((720, 1280, 3), np.uint8)
    cv2.circle(image, (700, 300), 4, (255, 255, 255), -1)
    keypoints = np.full((1, 18, 3), np.nan)
    keypoints[0, 0] = (*SPOT, 0.9)
    return AnnotatedImage(image, keypoints, np.array([[690.0, 280.0, 710.0, 400.0]]), CAMERA)


def spot(image):
    """Return where the middle of the white is."""
    y, x = np.nonzero(image[..., 0] > 127)
    return x.mean(), y.mean()


@pytest.mark.parametrize('change', [
    lambda e: shifted(e, right=40.0, down=-25.0), lambda e: shifted(e, right=-13.5),
    lambda e: scaled(e, factor=1.5), lambda e: scaled(e, factor=0.7),
    lambda e: brightened(e, gain=0.8, offset=5)])
def test_keypoints_and_boxes_go_where_the_image_goes(change):
    changed = change(example())
    nose = changed.keypoints[0, 0, :2]
    assert spot(changed.image) == pytest.approx(tuple(nose), abs=0.51)
    assert changed.keypoints[0, 0, 2] == 0.9
    assert np.isnan(changed.keypoints[0, 1:]).all()
    scale = changed.intrinsics.fx / CAMERA.fx
    corner = changed.boxes[0].reshape(2, 2)
    assert corner[1] - corner[0] == pytest.approx(scale * np.array([20.0, 120.0]))
    assert nose - corner[0] == pytest.approx(scale * np.array([10.0, 20.0]))


@pytest.mark.parametrize('change', [
    lambda e: shifted(e, right=100.0), lambda e: scaled(e, factor=0.6)])
def test_distances_stay_true_for_who_takes_angles(change):
    people = seen(standing_at((0.5, 0.2, 7.0), yaw_deg=20))
    before = AnnotatedImage(
        np.zeros((720, 1280, 3), np.uint8), people.keypoints, np.zeros((1, 4)), CAMERA)
    after = change(before)
    ranges = [make_estimator('body_dimensions').estimate(
        People(example.keypoints.astype(np.float32), people.track_ids, convention='mesh'),
        example.intrinsics).range[0] for example in (before, after)]
    assert ranges[1] == pytest.approx(ranges[0], rel=0.02)


def test_what_leaves_the_image_is_missing():
    assert np.isnan(shifted(example(), right=600.0).keypoints).all()
    assert np.isnan(scaled(example(), factor=20.0).keypoints).all()


def test_brightness_is_cut_off_at_black_and_white():
    image = np.array([[[0, 100, 200]]], np.uint8)
    given = AnnotatedImage(image, np.zeros((0, 18, 3)), np.zeros((0, 4)), CAMERA)
    assert brightened(given, gain=1.5).image.tolist() == [[[0, 150, 255]]]
    assert brightened(given, gain=1.0, offset=-120).image.tolist() == [[[0, 0, 80]]]


@pytest.mark.parametrize('wrong', [
    lambda e: brightened(e, gain=0.0), lambda e: brightened(e, gain=1.0, offset=float('nan')),
    lambda e: scaled(e, factor=0.0), lambda e: scaled(e, factor=float('inf'))])
def test_what_is_no_change_of_an_image_is_refused(wrong):
    with pytest.raises(DepthPersonError, match='positive'):
        wrong(example())
