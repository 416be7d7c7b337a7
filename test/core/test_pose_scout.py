"""Frames that come fast do not wait for looks, and the same frames still give the same people."""
from __future__ import annotations

from collections import Counter
import threading
import time

import numpy as np
import pytest
from walking_woman import frame, picture

from depth_person.errors import DepthPersonError
from depth_person.pose.detector import Detector
from depth_person.pose.pipeline import PoseEstimator, PoseOptions
from depth_person.pose.runtime import halves

FAST_S, SLOW_S = 1 / 30, 1 / 10
SHE, ANOTHER = (40, 180), (430, 60)
#: Frames in which another woman comes, and the first one goes.
COMES, GOES, COUNT = 12, 28, 40


def frames(count=COUNT, every_s=FAST_S, *, comes=COMES, goes=GOES):
    """Return frames of a woman who walks, and of another one."""
    for index in range(count):
        places = [(SHE[0] + index, SHE[1])] * (index < goes) + [ANOTHER] * (index >= comes)
        yield frame(picture(*places), 1 + index * every_s)


@pytest.fixture
def stage(network):
    """Return a function that opens the pose stage."""
    network('movenet-lightning')
    return lambda **options: PoseEstimator(PoseOptions(**{'threads': 2, **options}))


@pytest.fixture
def finds(monkeypatch):
    """Return how many looks each thread takes, and a list of what to do before the scout's."""
    find, counts, before = Detector.find, Counter(), []

    def counted(self, image, looks):
        name = threading.current_thread().name.split('_')[0]
        counts[name] += len(looks)
        if name == 'scout':
            for each in before:
                each()
        return find(self, image, looks)

    monkeypatch.setattr(Detector, 'find', counted)
    return counts, before


def ids_of(found):
    return [sorted(people.track_ids.tolist()) for people in found]


def assert_same(found, again):
    assert ids_of(found) == ids_of(again)
    for one, other in zip(found, again, strict=True):
        np.testing.assert_array_equal(one.keypoints, other.keypoints)


@pytest.mark.parametrize(('every_s', 'beside'), [(FAST_S, True), (1 / 15, True), (SLOW_S, False)])
def test_looks_that_would_hold_up_the_next_frame_are_taken_beside_it(
        stage, finds, every_s, beside):
    counts, _ = finds
    pose = stage()
    stream = frames(COUNT, every_s, comes=COUNT, goes=COUNT)
    pose.estimate(next(stream))
    counts.clear()
    assert ids_of(map(pose.estimate, stream)) == [[1]] * (COUNT - 1)
    taken, other = ('scout', 'MainThread') if beside else ('MainThread', 'scout')
    assert counts[taken] > 3
    assert counts[other] == 0


def test_who_comes_and_who_goes_is_noticed_beside_fast_frames(stage, finds):
    counts, _ = finds
    ids = ids_of(map(stage().estimate, frames()))
    assert counts['scout'] > 1
    first_both = ids.index([1, 2])
    assert ids == [[1]] * first_both + [[1, 2]] * (GOES - first_both) + [[2]] * (COUNT - GOES)
    assert COMES <= first_both < COMES + 15


def test_how_fast_looks_are_changes_nothing(stage, finds):
    _, before = finds
    found = [*map(stage().estimate, frames())]
    before.append(lambda: time.sleep(0.3))
    assert_same(found, [*map(stage().estimate, frames())])


def test_one_thread_gives_the_same_people_without_another(stage, finds):
    counts, _ = finds
    found = [*map(stage(threads=2).estimate, frames())]
    counts.clear()
    assert_same(found, [*map(stage(threads=1).estimate, frames())])
    assert set(counts) == {'MainThread'}


def test_while_a_look_is_outstanding_no_other_is_spent(stage, finds):
    """At 20 ms a frame the next one, of 49 ms, is paid for before the report is due."""
    counts, _ = finds
    ids_of(map(stage(detection_budget=20.0).estimate, frames(28, comes=COUNT, goes=COUNT)))
    assert counts['scout'] == 5  # due in the fourth frame after, the next begun in the fifth


def test_who_is_lost_is_looked_for_before_the_report_is_due(stage, finds):
    """The look is sent in the very frame in which she is gone, and due four frames later."""
    counts, _ = finds
    pose, looks = stage(), []
    for each in frames(GOES + 2):
        taken = counts['MainThread']
        pose.estimate(each)
        looks.append(counts['MainThread'] - taken)
    assert looks[GOES:] == [0, 1]


@pytest.mark.parametrize('cut', [6, 11, 22, GOES + 1])
def test_frames_may_be_recalled_while_a_look_is_outstanding(stage, cut):
    found = [*map(stage().estimate, frames())]
    resumed, stream = stage(), frames()
    for _, people, each in zip(range(cut), found, stream, strict=False):
        resumed.recall(each, people.keypoints, people.track_ids)
    # zip took nothing beyond the cut: the range is the first to end.
    assert_same(found[cut:], [resumed.estimate(each) for each in stream])


def test_a_look_that_fails_costs_one_frame(stage, finds):
    _, before = finds

    def fail():
        before.clear()
        raise DepthPersonError('the network is damaged')

    before.append(fail)
    pose, stream = stage(), frames()
    with pytest.raises(DepthPersonError, match='the network is damaged'):
        ids_of(map(pose.estimate, stream))
    assert ids_of(map(pose.estimate, stream))[-1] == [2]


def test_a_stream_that_begins_anew_forgets_the_look(stage, finds):
    _, before = finds
    before.append(lambda: time.sleep(0.2))
    pose = stage()
    for each in frames(12, comes=COUNT):
        pose.estimate(each)
    again = [pose.estimate(each) for each in frames(12, comes=0, goes=0)]
    assert ids_of(again) == [[2]] * 12


@pytest.mark.parametrize(
    ('threads', 'expected'), [(1, (0, 1)), (2, (1, 1)), (3, (1, 2)), (8, (4, 4))])
def test_two_networks_share_the_threads(threads, expected):
    assert halves(threads) == expected
