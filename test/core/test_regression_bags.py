"""The regression bags give their golden values, and would not if a formula were wrong."""
from collections import Counter
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
import json
from unittest import mock

import cv2
import make_bags
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
import numpy as np
import pytest
from regression_cases import BAGS, CASES, GOLDEN, measure, sightings
from rosbags.rosbag2 import Reader
from scenes import ACROSS, AWAY, Sequence, TURNING
import update

from depth_person.camera.bag import BagReader
from depth_person.camera.bag_source import BagSource
from depth_person.camera.intrinsics import Intrinsics
from depth_person.camera.message_fields import stamp_ns
from depth_person.distance import shoulder, triangulation
from depth_person.distance.skeleton import SkeletonEstimator
from depth_person.pose.skeleton import Keypoint
from depth_person.replay.clouds import cloud_points
from depth_person.replay.compare import compare
from depth_person.replay.golden import read_golden

_SHOULDERS = [Keypoint.R_SHOULDER, Keypoint.L_SHOULDER]


@pytest.fixture(scope='module')
def seen(network):
    """Return a function that gives the people of a case's bag, found once for all tests."""
    network('movenet-multipose')
    found = {}

    def of(case):
        if case.bag not in found:
            found[case.bag] = sightings(case)
        return found[case.bag]

    return of


def comparison(name, seen):
    """Return what moved from a case's golden values."""
    golden, tolerances = read_golden(GOLDEN / f'{name}.json')
    return compare(golden, measure(CASES[name], seen(CASES[name])), tolerances)


@pytest.mark.parametrize('name', CASES)
def test_a_bag_gives_its_golden_values(seen, name):
    result = comparison(name, seen)
    assert result.agree, np.flatnonzero(result.beyond)
    assert not result.id_moved.any()


def patched(owner, name, change):
    """Return a patch that replaces a function by one that is given it first."""
    original = getattr(owner, name)
    return mock.patch.object(owner, name, lambda *args, **more: change(original, *args, **more))


def wider(shoulder_depth, *args, shoulder_width, **more):
    return shoulder_depth(*args, shoulder_width=1.05 * shoulder_width, **more)


def exchanged(estimate, estimator, people, *args):
    keypoints = people.keypoints.copy()
    keypoints[:, _SHOULDERS] = keypoints[:, _SHOULDERS[::-1]]
    return estimate(estimator, replace(people, keypoints=keypoints), *args)


def longer(undistort, intrinsics, pixels):
    return undistort(intrinsics, pixels) / 1.05


MUTATIONS = {
    'shoulders taken for 5 % wider': (
        partial(patched, shoulder, 'shoulder_depth', wider),
        ['walker_shoulders', 'measured_neck']),
    'left and right shoulder exchanged in the formula': (
        partial(patched, triangulation, '_split', lambda split, *ends: 1 - split(*ends)),
        ['measured_neck']),
    'left and right shoulder exchanged among the keypoints': (
        partial(patched, SkeletonEstimator, 'estimate', exchanged), ['drone']),
    'focal length 5 % too long': (
        partial(patched, Intrinsics, 'undistort', longer),
        ['walker', 'turned', 'far', 'drone', 'distorted']),
    'distortion ignored': (
        partial(mock.patch.object, Intrinsics, 'distorted', False), ['distorted']),
}


@pytest.mark.parametrize('mutation', MUTATIONS)
def test_a_broken_formula_is_noticed(seen, mutation):
    broken, cases = MUTATIONS[mutation]
    for name in cases:
        seen(CASES[name])
    with broken():
        assert [name for name in cases if comparison(name, seen).agree] == []
    assert all(comparison(name, seen).agree for name in cases)


@pytest.mark.parametrize('name', CASES)
def test_golden_values_are_near_the_truth(name):
    golden, _ = read_golden(GOLDEN / f'{name}.json')
    with BagReader(CASES[name].path) as bag:
        truth = {stamp_ns(message.header): cloud_points(message).ravel()
                 for _, _, message in bag.messages(['/person_truth'])}
    assert sorted(truth) == golden.stamps_ns.tolist()
    assert len(golden.people) == pytest.approx(sum(map(len, truth.values())), rel=0.1)
    ratios = [
        np.abs(golden.people.range[row] / truth[golden.stamps_ns[frame]]['range'] - 1).min()
        for row, frame in enumerate(golden.people.frame)]
    limit = 0.2 if CASES[name].settings.estimator == 'shoulder' else 0.15
    assert np.median(ratios or [0]) < limit


def test_the_bags_are_small_and_of_every_kind():
    assert sum(file.stat().st_size for file in BAGS.rglob('*') if file.is_file()) < 8e6
    assert {case.bag for case in CASES.values()} == {path.name for path in BAGS.iterdir()}
    assert {f'{name}.json' for name in CASES} == {path.name for path in GOLDEN.iterdir()}
    assert {'walker', 'crossing', 'half_hidden', 'turned', 'far', 'drone', 'nobody',
            'distorted'} <= {path.name for path in BAGS.iterdir()}
    with BagSource(BAGS / 'distorted', frame_id='') as source:
        assert source.read().intrinsics.distorted


@pytest.mark.parametrize('path', sorted(BAGS.iterdir()), ids=lambda path: path.name)
def test_other_tools_read_the_bags(path):
    with (path / f'{path.name}.mcap').open('rb') as file:
        found = Counter(
            channel.topic for _, channel, _, _ in
            make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages())
    with Reader(path) as reader:
        assert found == {topic: info.msgcount for topic, info in reader.topics.items()}
    assert set(found) > {'/camera_info', '/person_truth'}


@pytest.mark.parametrize('name', make_bags.KEYPOINTS)
def test_a_bag_of_keypoints_is_made_again_as_it_is(tmp_path, name):
    make_bags.write_keypoints(tmp_path / name, make_bags.KEYPOINTS[name]())
    with BagReader(tmp_path / name) as made, BagReader(BAGS / name) as kept:
        for (topic, time, new), (_, _, old) in zip(
                made.messages(), kept.messages(), strict=True):
            assert time == stamp_ns(old.header) == stamp_ns(new.header)
            if topic == '/person_keypoints':
                for field in ('u', 'v', 'score', 'track_id'):
                    assert cloud_points(new)[field] == pytest.approx(
                        cloud_points(old)[field], abs=1e-3)


@contextmanager
def golden_folder(folder):
    with mock.patch.object(update, 'GOLDEN', folder):
        yield


def test_updating_shows_what_moved_and_keeps_it(tmp_path, capsys):
    golden = tmp_path / 'drone.json'
    text = (GOLDEN / 'drone.json').read_text()
    kept = json.loads(text)
    kept['frames'][4]['people'][1]['range'] *= 1.1
    golden.write_text(json.dumps(kept))
    with golden_folder(tmp_path):
        assert not update.update('drone', check=True)
        assert golden.read_text() == json.dumps(kept)
        assert not update.update('drone', check=False)
        assert '#2 -> #2  range 1' in capsys.readouterr().out
        assert update.update('drone', check=True)
    assert len(golden.read_text().splitlines()) == len(text.splitlines())


def test_a_case_without_golden_values_is_not_the_same(tmp_path, capsys):
    with golden_folder(tmp_path):
        assert not update.update('drone', check=True)
        assert 'has no golden values yet' in capsys.readouterr().out
        assert list(tmp_path.iterdir()) == []
        assert update.update('drone', check=False)
        assert update.update('drone', check=True)


@pytest.fixture
def sequence(tmp_path):
    """Return a sequence of six frames in which three white squares are on a grey ground."""
    (tmp_path / 'gt').mkdir()
    for index in range(6):
        image = np.full((90, 160, 3), 90, np.uint8)
        boxes = [(20 + 15 * index, 30, 30 + 15 * index, 60),
                 (130 - 12 * index, 20, 138 - 12 * index, 40), (70, 65, 80, 80)]
        for left, top, right, bottom in boxes:
            image[top:bottom, left:right] = 255
        cv2.imwrite(str(tmp_path / f'{index}.png'), image)
        (tmp_path / 'gt' / f'{index}.json').write_text(json.dumps({
            'image': f'{index}.png', 'width': 160, 'height': 90, 'time_s': index / 10,
            'K': {'fx': 100, 'fy': 100, 'cx': 79.5, 'cy': 44.5},
            'persons': [{'id': person, 'bbox_full': box, 'neck_cam_m': [person, 0, 5]}
                        for person, box in enumerate(boxes)]}))
    with mock.patch('scenes.MARGIN', 2), mock.patch('scenes.EVERY', 1):
        yield Sequence(tmp_path)


@pytest.mark.parametrize('person', [AWAY, ACROSS, TURNING])
def test_people_are_left_out_of_a_scene_without_a_trace(sequence, person):
    empty, = sequence.shots([3], people=[])
    assert np.abs(empty.image.astype(int) - 90).max() <= 2
    assert empty.necks == {}
    shot, = sequence.shots([1], people=[person])
    there = cv2.connectedComponents((shot.image[..., 0] > 170).astype(np.uint8))[0]
    assert there == 2  # the ground and the one square
    assert shot.necks == {person: (person, 0, 5)}
