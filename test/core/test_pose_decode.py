"""People drawn into the heads are found where they were drawn."""
from __future__ import annotations

from drawn_heads import DrawnHeads
from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np

from depth_person.pose.decode import decode_multi

NINE = [(x, y) for y in (12.25, 35.5, 58.75) for x in (10.5, 40.125, 70.875)]


def decode(heads, **options):
    return decode_multi(*heads.multi, **{'min_score': 0.1, 'max_people': 20, **options})[0]


def by_place(people):
    """Return people in the order of their rows and columns, nine cells apart or more."""
    middle = people[..., :2].mean(1)
    return people[np.lexsort((middle[:, 0], np.round(middle[:, 1] / 9)))]


def score_at(distance2, *, score, shorter_side):
    """Return the original's score of a mark so many squared cells from the regressed place."""
    return score * np.exp(-distance2 / (0.30004883 * shorter_side))


def test_nine_people_are_found_where_they_are():
    heads = DrawnHeads(72, 82)
    drawn = np.array([heads.draw(x, y) for x, y in NINE])
    people = by_place(decode(heads))
    assert people.shape == (9, 17, 3)
    np.testing.assert_allclose(people[..., :2], drawn, atol=1e-4)
    off_cell = ((drawn - np.floor(drawn)) ** 2).sum(-1)
    np.testing.assert_allclose(
        people[..., 2], score_at(off_cell, score=0.9, shorter_side=72), atol=1e-5)


@settings(max_examples=50)
@given(x=st.floats(6, 42), y=st.floats(11, 29), rows=st.integers(40, 70))
def test_a_person_is_found_anywhere_to_the_fraction_of_a_cell(x, y, rows):
    heads = DrawnHeads(rows, 48)
    drawn = heads.draw(x, y)
    person, = decode(heads)
    np.testing.assert_allclose(person[:, :2], drawn, atol=1e-3)


def test_two_overlapping_people_keep_their_own_keypoints():
    heads = DrawnHeads(40, 60)
    drawn = [heads.draw(25.5, 20.5), heads.draw(29.5, 20.5, score=0.8)]
    people = decode(heads)
    np.testing.assert_allclose(people[..., :2], drawn, atol=1e-4)


def test_the_surest_come_first_and_only_so_many():
    heads = DrawnHeads(40, 120)
    drawn = {score: heads.draw(x, 20.5, score=score)
             for x, score in ((20.5, 0.5), (60.5, 0.9), (100.5, 0.7))}
    people = decode(heads, max_people=2)
    np.testing.assert_allclose(people[..., :2], [drawn[0.9], drawn[0.7]], atol=1e-4)


def test_nobody_is_found_in_empty_heads():
    assert decode(DrawnHeads(40, 60)).shape == (0, 17, 3)


def test_a_centre_below_the_least_score_is_nobody():
    heads = DrawnHeads(40, 60)
    heads.draw(30.5, 20.5, score=0.3)
    assert len(decode(heads, min_score=0.31)) == 0
    assert len(decode(heads, min_score=0.29)) == 1


def test_the_score_falls_with_the_distance_from_the_regressed_place():
    heads = DrawnHeads(40, 60)
    heads.draw(30.0, 20.0, score=0.8, regressed_off=3.0)
    # The nose is drawn at (30.3, 10.8): its cell is (30, 10), the regressed place (33.3, 10.8).
    expected = score_at(3.3 ** 2 + 0.8 ** 2, score=0.8, shorter_side=40)
    np.testing.assert_allclose(decode(heads)[0, 0], [30.3, 10.8, expected], atol=1e-4)


def test_a_mark_outside_the_persons_box_is_not_theirs():
    heads = DrawnHeads(40, 60)
    drawn = heads.draw(30.5, 20.5, score=0.4)
    nose_x, nose_y = drawn[0]
    heads.mark(0, nose_x, nose_y - 3, 1.0)  # higher, and out of the box, which ends at y 9.5
    np.testing.assert_allclose(decode(heads)[0, 0, :2], [nose_x, nose_y], atol=1e-4)


def test_a_keypoint_beyond_the_rim_scores_nothing():
    heads = DrawnHeads(40, 60)
    drawn = heads.draw(30.5, 32.5)
    inside = drawn[:, 1] < 40
    person, = decode(heads)
    np.testing.assert_allclose(person[inside, :2], drawn[inside], atol=1e-4)
    assert (person[~inside, 2] < 0.1).all()


def test_a_search_that_need_not_reach_far_finds_the_same():
    """What scores enough is the same however far the search goes."""
    heads = DrawnHeads(72, 82)
    for x, y in NINE:
        heads.draw(x, y, regressed_off=1.5)
    far, near = decode(heads, min_score=1e-6), decode(heads, min_score=0.5)
    near_counts = near[..., 2] >= 0.5
    assert near_counts.any()
    np.testing.assert_array_equal(far[near_counts], near[near_counts])
