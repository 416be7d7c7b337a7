"""Who is who: sizes and likeness of skeletons, and what happens to keypoints claimed twice."""
from __future__ import annotations

from drawn_heads import FIGURE
import numpy as np
import pytest

from depth_person.pose.bodies import body_sizes, likeness, same_people
from depth_person.pose.claims import chosen, part_marks, refuse_doubles, Seen
from depth_person.pose.crops import crops_around
from depth_person.pose.skeleton import from_coco17, Keypoint
from depth_person.pose.tracking import Track

HEAD = [0, 14, 15, 16, 17]
SIZE = 21.7  # of FIGURE: 19.4 from eyes to ankles, times 1.12


def people(*places, scale=10.0, score=0.8):
    """Return people of about 217 pixels about x, y."""
    figures = [np.column_stack([FIGURE * scale + place, np.full(17, score)]) for place in places]
    return from_coco17(np.reshape(figures, (-1, 17, 3)))


def only(keypoints, rows):
    result = np.full_like(keypoints, np.nan)
    result[:, rows] = keypoints[:, rows]
    return result


def track(points, *, started_ns=-5_000_000_000):
    return Track(
        1, 0, points, float(body_sizes(points[None])[0]), np.zeros(2, np.float32), started_ns)


def seen(expected, *, tracked=True, detected=None, started_ns=-5_000_000_000, stamp_ns=0):
    points = expected[..., :2]
    detected = np.full_like(expected, np.nan) if detected is None else detected
    tracks = [track(each, started_ns=started_ns) if tracked else None for each in points]
    return Seen(tracks, points, body_sizes(points), detected, stamp_ns)


@pytest.mark.parametrize(('rows', 'least', 'most'), [
    (range(18), 1.0, 1.3),
    ([1, 2, 5, 8, 11], 0.85, 1.3),  # the torso
    (HEAD, 0.85, 1.3),
    ([8, 9, 10, 11, 12, 13], 0.7, 1.1),  # the legs
])
def test_the_size_of_a_body_is_told_by_what_is_seen_of_it(rows, least, most):
    size, = body_sizes(only(people((0, 0)), list(rows))[..., :2])
    assert least * 10 * SIZE <= size * 1.001
    assert size <= most * 10 * SIZE * 1.01


def test_the_size_grows_with_the_image():
    small, large = (body_sizes(people((50, 90), scale=scale)[..., :2]) for scale in (2, 10))
    assert large / small == pytest.approx(5)


def test_likeness_is_one_for_the_same_and_nothing_for_strangers():
    points = people((0, 0), (2, 1), (60, 0), (400, 0))[..., :2]
    alike = likeness(points, points, body_sizes(points), body_sizes(points))
    np.testing.assert_allclose(np.diagonal(alike), 1.0)
    assert alike[0, 1] > 0.9
    assert alike[0, 2] < 0.05
    assert alike[0, 3] < 1e-6


@pytest.mark.parametrize(('x', 'known', 'same'), [
    (5, False, True), (30, False, True), (60, False, False), (5, True, True), (30, True, False)])
def test_two_are_one_when_near_unless_both_are_known_people(x, known, same):
    points = people((0, 0), (x, 0))[..., :2]
    found = same_people(points, body_sizes(points), strict=np.array([known, known]))
    np.testing.assert_array_equal(found, [[False, same], [same, False]])


def test_a_crop_that_marks_the_expected_person_is_believed():
    expected, marked = people((300, 300)), people((304, 301))
    np.testing.assert_array_equal(chosen(seen(expected), marked), marked)


@pytest.mark.parametrize('marked', [
    people((300, 300), score=0.2),  # unsure
    people((380, 300)),  # somebody else, further away than anybody moves
    np.full((1, 18, 3), np.nan, np.float32),  # nobody
])
def test_whom_the_crop_does_not_confirm_is_not_given(marked):
    assert np.isnan(chosen(seen(people((300, 300))), marked)).all()


def test_a_crop_that_slipped_onto_a_neighbour_gives_way_to_the_detection():
    expected = detected = people((300, 300))
    slipped = people((340, 300))
    result = chosen(seen(expected, detected=detected), slipped)
    np.testing.assert_array_equal(result, detected)


@pytest.mark.parametrize(('detection', 'crop', 'given'), [
    (0.8, 0.8, True), (0.3, 0.6, True), (0.2, 0.4, False), (0.3, 0.3, False)])
def test_somebody_new_has_to_be_sure_to_both_networks(detection, crop, given):
    new = people((300, 300), score=detection)
    result = chosen(
        seen(new, tracked=False, detected=new), people((301, 300), score=crop))
    assert np.isfinite(result).any() == given


def test_of_two_crops_on_one_person_the_nearer_to_what_was_expected_stays():
    expected = people((300, 300), (360, 300))
    both = people((302, 300), (303, 300))
    doubles = refuse_doubles(seen(expected), both)
    assert doubles.tolist() == [False, True]
    assert np.isnan(both[1]).all()
    assert np.isfinite(both[0]).all()


def test_a_person_who_is_tracked_is_not_new():
    expected = people((300, 300), (310, 300))
    given = people((300, 300), (310, 300))
    first = seen(expected)
    newcomer = Seen([first.tracks[0], None], first.expected, first.sizes, first.detected, 0)
    assert refuse_doubles(newcomer, given).tolist() == [False, True]


@pytest.mark.parametrize('off', [3, 6, 9])
def test_an_arm_that_seemed_a_small_person_is_not_new(off):
    """Its crop shows whose it is; how large it seemed does not count then."""
    whole = people((0, 0))
    arm = only(whole + np.array([off, off / 2, 0], np.float32), [5, 6, 7, 8, 11])
    known, new = seen(whole), seen(only(arm, [5, 6, 7]), tracked=False)
    both = Seen(
        [*known.tracks, None], np.concatenate([known.expected, new.expected]),
        np.concatenate([known.sizes, 0.3 * known.sizes]),
        np.concatenate([known.detected, new.detected]), 0)
    assert refuse_doubles(both, np.concatenate([whole, arm])).tolist() == [False, True]


def test_overlapping_people_keep_their_own_keypoints():
    """The crop of the second has taken the first one's shoulder for its own."""
    expected = people((300, 300), (350, 300))
    given = people((300, 300), (350, 300))
    given[1, Keypoint.R_SHOULDER] = given[0, Keypoint.R_SHOULDER]
    assert not part_marks(seen(expected), given).any()
    assert np.isfinite(given[0]).all()
    missing = np.isnan(given[1, :, 0])
    assert np.flatnonzero(missing).tolist() == [Keypoint.R_SHOULDER]


def test_who_has_hardly_a_mark_of_its_own_is_nobody():
    expected = people((300, 300), (350, 300))
    given = people((300, 300), (350, 300))
    given[1, 4:] = given[0, 4:]
    assert part_marks(seen(expected), given).tolist() == [False, True]
    assert np.isnan(given[1]).all()


def test_a_crop_holds_the_body_and_stays_inside_the_frame():
    points = people((300, 300))[..., :2]
    (centre,), (side,) = crops_around(points, body_sizes(points), width=1280, height=720)
    low, high = np.nanmin(points[0], 0), np.nanmax(points[0], 0)
    assert (low > centre - side / 2).all()
    assert (high < centre + side / 2).all()
    assert side < 1.1 * 10 * SIZE
    # Somebody close by, half outside: what is outside the frame gets no room in the crop.
    near = people((60, 260), scale=40)[..., :2]
    (centre,), (side,) = crops_around(near, body_sizes(near), width=400, height=300)
    assert side == pytest.approx(300, abs=100)
    assert centre - side / 2 == pytest.approx([0, 0], abs=60)


@pytest.mark.parametrize(('missed_s', 'believed'), [(0.05, False), (0.5, True)])
def test_who_was_not_seen_for_a_while_may_have_gone_further(missed_s, believed):
    expected, marked = people((300, 300)), people((375, 300))
    result = chosen(seen(expected, stamp_ns=round(missed_s * 1e9)), marked)
    assert np.isfinite(result).any() == believed


@pytest.mark.parametrize(('where', 'stands'), [
    (0.0, True),  # where it was expected
    (8.0, True),  # moved a little
    (42.0, False),  # onto the other, who is marked as well
    (-42.0, True)])  # as far, where nobody is
def test_a_crop_that_jumps_onto_somebody_else_is_not_believed(where, stands):
    expected = seen(people((200, 100), (250, 100)))
    result = chosen(expected, people((200 + where, 100), (250, 100)))
    assert np.isfinite(result[..., 2]).any(1).tolist() == [stands, True]


def test_a_crop_that_jumps_to_where_somebody_hidden_was_expected_stands():
    marked = people((242, 100), (250, 100))
    marked[1] = np.nan
    result = chosen(seen(people((200, 100), (250, 100))), marked)
    assert np.isfinite(result[..., 2]).any(1).tolist() == [True, False]
