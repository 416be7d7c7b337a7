"""What the overlay draws, and where."""
from dataclasses import replace

import numpy as np
import pytest

from depth_person.camera.intrinsics import Intrinsics
from depth_person.distance.estimator import Distances, Reason
from depth_person.distance.tracked import TrackedPeople
from depth_person.overlay import draw, FAINT, NO_RANGE, person_colour, SURE_SCORE
from depth_person.pose.people import People
from depth_person.pose.skeleton import Keypoint, N_KEYPOINTS

HEIGHT, WIDTH = 360, 640


def person(neck, size=100.0, score=0.9):
    """Return (18, 3) keypoints of an upright person of this height around a neck."""
    keypoints = np.full((N_KEYPOINTS, 3), np.nan, np.float32)
    offsets = {
        Keypoint.NECK: (0, 0), Keypoint.R_SHOULDER: (-0.1, 0), Keypoint.L_SHOULDER: (0.1, 0),
        Keypoint.R_HIP: (-0.07, 0.3), Keypoint.L_HIP: (0.07, 0.3)}
    for row, offset in offsets.items():
        keypoints[row] = (*(np.array(neck) + np.multiply(offset, size)), score)
    return keypoints


def drawn(*skeletons, reason=Reason.NONE, position=(0.0, 0.0, 5.0)):
    """Return a black image with people drawn in, whose track ids count from 0."""
    image = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    count = len(skeletons)
    people = People(
        np.stack(skeletons) if count else People.nobody().keypoints, np.arange(count, dtype='i4'))
    draw(image, TrackedPeople.unfiltered(people, Distances.of(
        position=np.tile(position, (count, 1)), range_sigma=np.full(count, 0.2),
        reason=np.full(count, reason, np.uint8), cues=np.ones(count, np.uint8))))
    return image


def label_pixels(image):
    return (image == (32, 32, 32)).all(axis=-1).sum()


def has_colour(image, colour):
    return (image == colour).all(axis=-1).any()


def test_nobody_leaves_the_image_as_it_is():
    assert not drawn().any()


def test_limbs_are_drawn_where_the_keypoints_are():
    image = drawn(person((300, 100)))
    assert image[95:106, 295:306].any()  # the neck's dot
    assert image[113:117, 296:304].any()  # a limb, half way to a hip
    assert not image[:, :280].any()
    assert not image[200:].any()


def test_limbs_that_the_network_is_unsure_of_are_faint():
    def brightest(score):
        image = drawn(person((300, 100), score=score), reason=Reason.NO_SHOULDERS)
        return float(image[110:].max())  # below the neck's dot

    sure = brightest(SURE_SCORE + 0.05)
    assert 100 < sure <= max(NO_RANGE)
    assert brightest(SURE_SCORE - 0.05) == pytest.approx(FAINT * sure, rel=0.1)


def test_each_track_has_its_colour():
    image = drawn(person((100, 100)), person((400, 100)))
    assert has_colour(image[:, :110], person_colour(0))
    assert has_colour(image[:, 380:], person_colour(1))
    assert person_colour(0) != person_colour(1)


def test_who_has_no_range_is_grey_and_has_no_number():
    image = drawn(person((300, 100)), reason=Reason.NO_SHOULDERS)
    assert has_colour(image, NO_RANGE)
    assert not image[:, 330:].any()  # where the label would be
    assert drawn(person((300, 100)))[:, 330:].any()


def test_the_hidden_are_a_ring_and_a_label_where_they_are_predicted():
    camera = Intrinsics(WIDTH, HEIGHT, 400.0, 400.0, 320.0, 180.0)
    tracked = TrackedPeople.unfiltered(
        People.nobody(), Distances.none(0, Reason.NONE)).with_hidden(np.array([4], np.int32))
    predicted = Distances.of(
        position=np.array([[-1.0, 0.5, 4.0]]), range_sigma=np.array([0.3]),
        reason=np.zeros(1, np.uint8), cues=np.zeros(1, np.uint8))
    tracked = replace(tracked, distances=predicted, predicted=np.array([True]))
    image, unknown = np.zeros((2, HEIGHT, WIDTH, 3), np.uint8)
    draw(image, tracked, camera)
    draw(unknown, tracked)
    assert has_colour(image[222:239, 212:219], person_colour(4))  # left of the middle, below
    assert not image[230, 220].any()  # a ring, not a disc
    assert label_pixels(image) > label_pixels(drawn(person((300, 100)), position=(-1, 0.5, 4)))
    assert not unknown.any()


@pytest.mark.parametrize('neck', [(2, 2), (WIDTH - 2, 2), (WIDTH - 2, HEIGHT - 2), (2, HEIGHT)])
def test_labels_at_the_border_are_whole(neck):
    whole = label_pixels(drawn(person((300, 100), size=1.0)))
    assert label_pixels(drawn(person(neck, size=1.0))) == pytest.approx(whole, rel=0.02)


def test_labels_of_neighbours_do_not_hide_each_other():
    one, *others = (person((300 + 4 * step, 100 + step), size=1.0) for step in range(3))
    alone = label_pixels(drawn(one))
    assert label_pixels(drawn(one, *others)) == pytest.approx(3 * alone, rel=0.06)


@pytest.mark.parametrize('wild', [np.nan, np.inf, -np.inf, 1e9, -1e30])
def test_wild_keypoints_do_no_harm(wild):
    broken = person((300, 100))
    broken[Keypoint.R_HIP, :2] = wild
    neckless = person((300, 100))
    neckless[Keypoint.NECK] = np.nan
    everywhere = np.full((N_KEYPOINTS, 3), wild, np.float32)
    assert drawn(broken, neckless, everywhere).any()
