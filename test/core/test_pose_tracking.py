"""People keep their number while they can be told apart, and nobody gets another's."""
from __future__ import annotations

from drawn_heads import FIGURE
from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from depth_person.pose.claims import is_young
from depth_person.pose.skeleton import from_coco17
from depth_person.pose.tracking import Tracker

FRAME_S = 1 / 15


def people(*places, size=10.0):
    """Return people of about 200 pixels about x, y."""
    figures = [np.column_stack([FIGURE * size + place, np.ones(17)]) for place in places]
    return from_coco17(np.reshape(figures, (-1, 17, 3)))


def ns(seconds):
    return round(seconds * 1e9)


def test_ids_begin_at_one_and_follow_the_people_not_the_rows():
    tracker = Tracker()
    assert tracker.update(people((100, 100), (500, 100)), 0).tolist() == [1, 2]
    assert tracker.update(people((505, 100), (105, 100)), ns(FRAME_S)).tolist() == [2, 1]


def test_nobody_has_no_ids():
    ids = Tracker().update(people(), 0)
    assert ids.shape == (0,)
    assert ids.dtype == np.int32


def test_a_newcomer_gets_the_next_id():
    tracker = Tracker()
    tracker.update(people((100, 100)), 0)
    assert tracker.update(people((800, 100), (100, 100)), ns(0.1)).tolist() == [2, 1]


@pytest.mark.parametrize('hidden_s', [0.0, 0.2, 0.4])
def test_crossing_people_keep_their_ids(hidden_s):
    """Two walk past each other; while they overlap the network sees only one of them."""
    tracker, ids = Tracker(), []
    for index in range(61):
        time_s = index * FRAME_S
        left, right = (300 + 150 * time_s, 200), (900 - 150 * time_s, 210)
        if abs(time_s - 2) <= hidden_s / 2 and hidden_s:
            tracker.update(people(left), ns(time_s))
        else:
            ids.append(tracker.update(people(left, right), ns(time_s)).tolist())
    assert ids == [[1, 2]] * len(ids)


@pytest.mark.parametrize(('gap_s', 'expected'), [(0.9, 1), (1.1, 2)])
def test_a_track_lives_as_long_as_its_stamps_say(gap_s, expected):
    tracker = Tracker(max_missed_s=1.0)
    tracker.update(people((100, 100)), 0)
    for _ in range(100):  # frames of one stamp do not age it
        tracker.update(people(), ns(0.01))
    assert tracker.update(people((100, 100)), ns(gap_s)).tolist() == [expected]


def test_a_walker_hidden_for_a_while_is_expected_further_on():
    tracker = Tracker()
    for index in range(15):
        tracker.update(people((100 + 300 * index * FRAME_S, 100)), ns(index * FRAME_S))
    back_s = 14 * FRAME_S + 0.8
    assert tracker.update(people((100 + 300 * back_s, 100)), ns(back_s)).tolist() == [1]


@pytest.mark.parametrize('apart_s', [1e-9, 1e-6, 1e-3])
def test_stamps_that_hardly_differ_tell_no_velocity(apart_s):
    """A camera's images may come in bursts, each stamped when it arrives."""
    tracker, ids = Tracker(), []
    for index in range(8):
        for extra in (0, 1):
            time_s, x = 0.07 * index + extra * apart_s, 100 + 20 * index + 8 * extra
            ids.append(tracker.update(people((x, 100)), ns(time_s)).tolist())
    assert ids == [[1]] * len(ids)


def test_a_clock_set_back_starts_anew_without_using_an_id_twice():
    tracker = Tracker()
    tracker.update(people((100, 100), (500, 100)), ns(50))
    assert tracker.update(people((100, 100), (500, 100)), ns(10)).tolist() == [3, 4]
    assert tracker.update(people((100, 100), (500, 100)), ns(10.1)).tolist() == [3, 4]


def test_a_clock_set_forward_starts_anew_without_using_an_id_twice():
    tracker = Tracker()
    tracker.update(people((100, 100)), 0)
    assert tracker.update(people((100, 100)), ns(1e6)).tolist() == [2]


def test_a_person_who_loses_keypoints_keeps_the_id():
    tracker = Tracker()
    whole = people((100, 100))
    tracker.update(whole, 0)
    head_only = whole.copy()
    head_only[:, 1:14] = np.nan
    assert tracker.update(head_only, ns(0.1)).tolist() == [1]
    legs_only = whole.copy()
    legs_only[:, [*range(8), *range(14, 18)]] = np.nan
    assert tracker.update(legs_only, ns(0.2)).tolist() == [1]


def test_somebody_far_off_is_somebody_else_whatever_the_size():
    for size in (1.0, 10.0, 40.0):
        tracker = Tracker()
        tracker.update(people((0, 0), size=size), 0)
        assert tracker.update(people((0.3 * 20 * size, 0), size=size), 1).tolist() == [1]
        assert tracker.update(people((1.5 * 20 * size, 0), size=size), 2).tolist() == [2]


@settings(max_examples=30)
@given(st.lists(
    st.tuples(st.sampled_from([-700, 0, 40, 900]), st.lists(st.tuples(
        st.integers(0, 1000), st.integers(0, 700)), max_size=5)), max_size=15))
def test_ids_differ_within_a_frame_and_never_come_back(frames):
    """Tracks that live for one stamp only: at each new stamp all ids have to be new."""
    tracker, stamp_ms, highest = Tracker(max_missed_s=0.0), 0, 0
    for step_ms, places in frames:
        stamp_ms += step_ms
        ids = tracker.update(people(*places), stamp_ms * 1_000_000).tolist()
        assert len(set(ids)) == len(ids) == len(places)
        if step_ms:
            assert min(ids, default=highest + 1) > highest
        highest = max([highest, *ids])


def apart(tracker):
    tracker.note_apart()
    return [track.apart for track in tracker.tracks]


def test_who_was_seen_apart_from_all_others_stays_somebody():
    tracker = Tracker()
    tracker.update(people((100, 100), (140, 100), (300, 100)), 0)
    assert apart(tracker) == [False, False, True]
    tracker.update(people((60, 100), (180, 100), (210, 100)), ns(0.5))
    assert apart(tracker) == [True, False, True]
    assert [is_young(track, ns(0.9)) for track in tracker.tracks] == [False, True, False]
    assert not any(is_young(track, ns(1.0)) for track in tracker.tracks)


def test_while_somebody_is_missing_anybody_may_be_that_person():
    tracker = Tracker()
    tracker.update(people((100, 100), (140, 100)), 0)
    assert tracker.update(people((100, 100), (800, 100)), ns(0.1)).tolist() == [1, 3]
    assert apart(tracker) == [False, False, False]
