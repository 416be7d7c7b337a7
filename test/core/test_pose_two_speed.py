"""People are followed on crops: found once, marked at every frame, and never made up."""
from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from walking_woman import frame, picture

from depth_person.camera.sources import open_source
from depth_person.errors import DepthPersonError
from depth_person.pose.pipeline import PoseEstimator, PoseOptions
from depth_person.pose.refine import Refiner
from depth_person.pose.skeleton import Keypoint

CROSSING = Path(__file__).parents[1] / 'regression/bags/crossing'
SHOULDERS = [Keypoint.R_SHOULDER, Keypoint.L_SHOULDER]
FRAME_S = 0.1
#: Upper left of her picture, 150 pixels wide, in the frames; she is 128 from there.
HOME = (240, 180)


@pytest.fixture
def stage(network):
    """Return a function that opens the pose stage with options."""
    network('movenet-lightning')
    return lambda **options: PoseEstimator(PoseOptions(**options))


def walk(stage, times_s, **options):
    """Return what is found of somebody who goes to the right at 60 pixels a second."""
    pose = stage(**options)
    return [pose.estimate(frame(picture((HOME[0] + int(60 * time_s), HOME[1])), time_s))
            for time_s in times_s]


def test_who_is_tracked_is_marked_on_crops_without_looking_again(stage):
    found = walk(stage, np.arange(8) * FRAME_S, detection_budget=0.0)
    assert [people.track_ids.tolist() for people in found] == [[1]] * 8
    places = np.array([people.keypoints[0, SHOULDERS, 0].mean() for people in found])
    went = np.array([int(60 * index * FRAME_S) for index in range(8)])
    np.testing.assert_allclose(places - places[0], went, atol=4)
    assert {people.convention for people in found} == {'movenet_crops'}


def test_the_same_frames_give_the_same_people(stage):
    first, again = (walk(stage, np.arange(6) * FRAME_S) for _ in range(2))
    for one, other in zip(first, again, strict=True):
        np.testing.assert_array_equal(one.keypoints, other.keypoints)
        np.testing.assert_array_equal(one.track_ids, other.track_ids)


@pytest.mark.parametrize(('away_s', 'ids'), [(0.5, [1]), (1.8, [1]), (2.5, [2])])
def test_who_is_hidden_is_not_given_and_comes_back_with_the_same_id(stage, away_s, ids):
    pose = stage(detection_budget=50.0)
    there, empty = picture(HOME), picture()
    assert pose.estimate(frame(there)).track_ids.tolist() == [1]
    for time_s in np.arange(FRAME_S, away_s, 0.3):
        assert len(pose.estimate(frame(empty, time_s))) == 0
    back = [pose.estimate(frame(there, away_s + index * FRAME_S)) for index in range(4)]
    assert back[-1].track_ids.tolist() == ids


def test_somebody_new_is_found_within_the_budget(stage):
    pose = stage(detection_budget=20.0)
    pose.estimate(frame(picture(HOME)))
    seen = [len(pose.estimate(frame(picture(HOME, (20, 30)), (index + 1) * FRAME_S)))
            for index in range(8)]
    assert seen[-1] == 2
    assert sorted(seen) == seen


def test_the_nearest_are_given_first_and_only_so_many(stage):
    image = picture((20, 20), side=120)
    image[160:460, 300:600] = picture((0, 0), side=300)[:300, :300]
    both = stage().estimate(frame(image))
    assert len(both) == 2
    widths = np.abs(np.diff(both.keypoints[:, SHOULDERS, 0]))[:, 0]
    assert widths[0] > 1.5 * widths[1]
    nearest = stage(max_people=1).estimate(frame(image))
    np.testing.assert_allclose(
        nearest.keypoints[0, SHOULDERS, :2], both.keypoints[0, SHOULDERS, :2], atol=1)


def test_a_clock_set_back_starts_anew_without_using_an_id_twice(stage):
    pose = stage(detection_budget=0.0)
    assert pose.estimate(frame(picture(HOME), 5.0)).track_ids.tolist() == [1]
    assert pose.estimate(frame(picture(HOME), 1.0)).track_ids.tolist() == [2]


def test_without_a_refiner_the_network_does_it_all(stage):
    people = stage(refiner='none').estimate(frame(picture(HOME)))
    assert len(people) == 1
    assert people.convention == 'movenet'


@pytest.mark.parametrize(('options', 'said'), [
    ({'refiner': 'movenet-multipose'}, 'movenet-lightning'),
    ({'refiner': 'nobody'}, 'movenet-lightning'),
    ({'detection_budget': -1.0}, 'detection_budget'),
    ({'detection_budget': float('nan')}, 'detection_budget')])
def test_wrong_options_are_refused(stage, options, said):
    with pytest.raises(DepthPersonError, match=said):
        stage(**options)


def test_marks_go_with_the_crop(network):
    """The same crop of a shifted image gives the same marks, shifted; alone or in a batch."""
    refiner = Refiner(network('movenet-lightning'))
    image, shift = picture(HOME), np.array([37, 21])
    centre, side = np.array([HOME], np.float32) + 75, np.array([180], np.float32)
    here = refiner(image, centre, side)
    moved = np.roll(image, shift[::-1], (0, 1))
    there = refiner(
        moved, np.concatenate([centre, centre + shift.astype(np.float32)]), side.repeat(2))
    np.testing.assert_allclose(there[1, :, :2] - here[0, :, :2], [shift] * 18, atol=0.05)
    np.testing.assert_allclose(there[1, :, 2], here[0, :, 2], atol=1e-3)


@pytest.mark.parametrize('times', [2, 4, 8])
def test_marks_grow_with_the_image(network, times):
    """However often the frame is halved on the way, marks stay where they were."""
    refiner = Refiner(network('movenet-lightning'))
    image = picture(HOME)
    centre, side = np.array([HOME], np.float32) + 75, np.array([200], np.float32)
    small = refiner(image, centre, side)[0]
    large = refiner(
        np.repeat(np.repeat(image, times, 0), times, 1), (centre + 0.5) * times - 0.5,
        side * times)[0]
    sure = small[:, 2] > 0.4
    apart = (large[sure, :2] + 0.5) / times - (small[sure, :2] + 0.5)
    assert np.median(np.abs(apart)) < 0.3


def test_a_crop_may_reach_beyond_the_image(network):
    refiner = Refiner(network('movenet-lightning'))
    keypoints = refiner(picture((0, 0)), np.zeros((1, 2), np.float32), np.full(1, 400, np.float32))
    assert np.isfinite(keypoints).all()


def test_nobody_needs_no_crop(network):
    refiner = Refiner(network('movenet-lightning'))
    none = refiner(picture(), np.empty((0, 2), np.float32), np.empty(0, np.float32))
    assert none.shape == (0, 18, 3)
    assert refiner.inference_s == 0.0


@pytest.mark.parametrize('shift', [2, 3])
def test_people_who_cross_in_their_first_second_keep_their_ids(stage, shift):
    """They are seen apart in the first five frames, whether these are found or recalled."""
    with open_source(str(CROSSING)) as source:
        frames = [replace(each, image=np.roll(each.image, shift, 1))
                  for each in iter(source.read, None)]
    whole, resumed = stage(), stage()
    found = [whole.estimate(each) for each in frames]
    assert {*found[0].track_ids} == {*found[-1].track_ids} == {1, 2}
    for each, people in zip(frames[:5], found, strict=False):
        resumed.recall(each, people.keypoints, people.track_ids)
    for each, people in zip(frames[5:], found[5:], strict=True):
        again = resumed.estimate(each)
        assert again.track_ids.tolist() == people.track_ids.tolist()
        np.testing.assert_array_equal(again.keypoints, people.keypoints)
