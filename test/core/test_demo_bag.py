"""The bundled walking sequence, and what pose and distance make of it without ROS."""
import json
from pathlib import Path
import subprocess
import sys

import cv2
import numpy as np
import pytest

from depth_person.camera.sources import open_source
from depth_person.distance.estimator import Body
from depth_person.distance.estimators import make_estimator
from depth_person.pose.pipeline import PoseEstimator, PoseOptions
from depth_person.replay.bags import BagReader

DEMO = Path(__file__).parents[2] / 'demo'
BAG = DEMO / 'walk'
EVERY = 4  # so many frames are one for these tests
SAME_PERSON_PX = 40
AWAY, ACROSS, TURNING = range(3)  # the people's ids: what they do
ALWAYS = slice(None)
FACING = slice(0, 8)  # frames in which TURNING looks within 30 degrees of the camera


def true_people(message):
    """Return the truth of one frame as a structured array."""
    layout = np.dtype({
        'names': [field.name for field in message.fields],
        'formats': [{7: '<f4', 5: '<i4'}[field.datatype] for field in message.fields],
        'offsets': [field.offset for field in message.fields], 'itemsize': message.point_step})
    return message.data.view(layout)


def read_truth(path):
    """Return the truths of a bag by stamp (ns)."""
    with BagReader(path) as bag:
        return {message.header.stamp.sec * 10**9 + message.header.stamp.nanosec:
                true_people(message) for _, _, message in bag.messages(['/person_truth'])}


@pytest.fixture(scope='module')
def frames():
    """Return every frame of the bundled bag."""
    with open_source(str(BAG)) as source:
        return list(iter(source.read, None))


@pytest.fixture(scope='module')
def sightings(frames):
    """Return (frame, people, truth) of one frame in EVERY."""
    pose, truth = PoseEstimator(PoseOptions()), read_truth(BAG)
    return [(frame, pose.estimate(frame), truth[frame.stamp_ns]) for frame in frames[::EVERY]]


def ratios(sightings, person, estimator):
    """Return measured / true range of a person, of each frame in which there is one."""
    found = []
    for frame, people, truth in sightings:
        true = truth[truth['track_id'] == person][0]
        neck = frame.intrinsics.project([true['x'], true['y'], true['z']])
        distances = estimator.estimate(people, frame.intrinsics)
        pixels = np.linalg.norm(frame.intrinsics.project(distances.position) - neck, axis=1)
        if (pixels < SAME_PERSON_PX).any():
            found.append(distances.range[np.nanargmin(pixels)] / true['range'])
    return np.array(found)


def test_the_bag_is_small_and_whole(frames):
    assert sum(file.stat().st_size for file in BAG.iterdir()) < 10e6
    assert len(frames) == len(read_truth(BAG)) == 96
    assert np.diff([frame.stamp_ns for frame in frames]) == pytest.approx(1e9 / 12, rel=1e-3)
    for frame in frames:
        assert frame.frame_id == 'camera_optical_frame'
        assert frame.intrinsics.fits(frame.image)


def test_the_true_range_is_the_length_of_the_true_position():
    for people in read_truth(BAG).values():
        positions = np.stack([people[axis] for axis in 'xyz'], axis=-1)
        assert np.linalg.norm(positions, axis=1) == pytest.approx(people['range'], rel=1e-3)


@pytest.mark.parametrize(('person', 'limit'), [
    (AWAY, 0.115),  # is larger than most: true keypoints read 0.915
    (ACROSS, 0.06), (TURNING, 0.08)])
def test_skeletons_give_the_range_of_whoever_walks_or_turns(sightings, person, limit):
    measured = ratios(sightings, person, make_estimator('skeleton'))
    assert len(measured) >= 0.8 * len(sightings)
    assert np.median(np.abs(measured - 1)) < limit


def test_nobody_is_seen_who_is_not_there_and_sigmas_tell_the_errors(sightings):
    strange, in_sigmas = [], []
    for frame, people, truth in sightings:
        distances = make_estimator('skeleton').estimate(people, frame.intrinsics)
        seen, true = (frame.intrinsics.project(positions) for positions in (
            distances.position, np.stack([truth[axis] for axis in 'xyz'], axis=-1)))
        pixels = np.linalg.norm(seen[:, None] - true, axis=2)
        known = pixels.min(axis=1) < SAME_PERSON_PX
        strange += (~known).tolist()
        error = distances.range - truth['range'][pixels.argmin(axis=1)]
        in_sigmas += np.abs(error / distances.range_sigma)[known].tolist()
    assert np.mean(strange) < 0.05
    assert np.mean(np.array(in_sigmas) < 2) > 0.7


@pytest.mark.parametrize(('person', 'when'), [(AWAY, ALWAYS), (TURNING, FACING)])
def test_shoulders_give_the_range_of_who_is_square_to_the_camera(sightings, person, when):
    assert shoulders_are_right(sightings[when], person, shoulder_width=0.35)


@pytest.mark.parametrize('shoulder_width', [0.25, 0.5])
def test_a_wrong_shoulder_width_is_noticed(sightings, shoulder_width):
    assert not shoulders_are_right(sightings, AWAY, shoulder_width=shoulder_width)


def shoulders_are_right(sightings, person, *, shoulder_width):
    estimator = make_estimator('shoulder', body=Body(shoulder_width=shoulder_width))
    measured = ratios(sightings, person, estimator)
    return len(measured) >= 0.7 * len(sightings) and abs(np.median(measured) - 1) < 0.2


@pytest.fixture
def sequence(tmp_path):
    """Return a folder of two small frames with one person each."""
    folder = tmp_path / 'sequence'
    (folder / 'gt').mkdir(parents=True)
    (folder / 'images').mkdir()
    for index in range(2):
        picture = f'images/{index}.png'
        cv2.imwrite(str(folder / picture), np.full((48, 64, 3), 100 + 50 * index, np.uint8))
        frame = {
            'image': picture, 'width': 64, 'height': 48, 'time_s': index / 10,
            'K': {'fx': 50.0, 'fy': 51.0, 'cx': 31.5, 'cy': 23.5}, 'dist_plumb_bob': [0.1] * 5,
            'persons': [{'id': 7, 'neck_cam_m': [3.0, 0.0, 4.0], 'range_m': 5.0}]}
        (folder / f'gt/{index}.json').write_text(json.dumps(frame))
    return folder


def make_bag(*arguments):
    return subprocess.run(
        [sys.executable, DEMO / 'make_bag.py', *arguments], capture_output=True, text=True,
        check=False)


def test_a_made_bag_holds_what_the_sequence_says(sequence, tmp_path):
    assert make_bag(sequence, tmp_path / 'bag').returncode == 0
    with open_source(str(tmp_path / 'bag')) as source:
        dark, light = iter(source.read, None)
    assert light.stamp_ns - dark.stamp_ns == 10**8
    assert (dark.image.mean(), light.image.mean()) == pytest.approx((100, 150), abs=2)
    assert light.intrinsics.distortion == (0.1,) * 5
    assert (light.intrinsics.fx, light.intrinsics.fy) == (50, 51)
    people = read_truth(tmp_path / 'bag')[light.stamp_ns]
    assert people.tolist() == [(3, 0, 4, 5, 7)]


def test_the_same_sequence_makes_the_same_bag(sequence, tmp_path):
    first, second = (tmp_path / name / 'bag' for name in ('first', 'second'))
    for bag in (first, second):
        bag.parent.mkdir()
        assert make_bag(sequence, bag).returncode == 0
    assert (first / 'bag.mcap').read_bytes() == (second / 'bag.mcap').read_bytes()


def test_a_folder_without_frames_makes_no_bag(tmp_path):
    made = make_bag(tmp_path, tmp_path / 'bag')
    assert made.returncode == 1
    assert made.stderr.startswith(f'make_bag: {tmp_path} holds no gt/*.json; give the folder')
    assert not (tmp_path / 'bag').exists()


@pytest.mark.parametrize('lost', [(), (51,), (47, 50, 53)])
def test_people_who_cross_keep_their_ids_even_if_frames_are_lost(frames, lost):
    pose, orders = PoseEstimator(PoseOptions()), []
    for index in range(30, 75):
        if index not in lost:
            people = pose.estimate(frames[index])
            from_left = np.argsort(np.nanmean(people.keypoints[..., 0], axis=1))
            orders.append(people.track_ids[from_left].tolist())
    left, middle, right = orders[0]
    assert orders[-1] == [middle, left, right]
