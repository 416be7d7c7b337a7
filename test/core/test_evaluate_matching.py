from average_body import CAMERA, only, seen, standing_at
import numpy as np
import pytest

from depth_person.pose.people import People
from depth_person.pose.skeleton import COCO17_ROWS
from depth_person.replay.dataset import TruePerson
from depth_person.replay.matching import match_people

COCO17 = np.argsort(COCO17_ROWS)[1:]
PLACES = [(-2, 0, 6), (0, 0, 6), (2, 0, 6)]


def true_person(position, *, with_keypoints=True, yaw_deg=0.0):
    pixels = CAMERA.project(standing_at(position, yaw_deg=yaw_deg))[COCO17]
    box = np.concatenate([pixels.min(axis=0) - 10, pixels.max(axis=0) + 10])
    return TruePerson(
        0, position[2], float(np.linalg.norm(position)), boxes=box[None],
        keypoints=np.insert(pixels, 2, 2.0, axis=1) if with_keypoints else None)


def found_at(*positions, yaw_deg=0.0):
    return seen([standing_at(position, yaw_deg=yaw_deg) for position in positions])


@pytest.mark.parametrize('with_keypoints', [True, False], ids=['keypoints', 'boxes'])
@pytest.mark.parametrize('order', [(0, 1, 2), (2, 0, 1), (1, 2, 0)])
def test_everyone_is_paired_whatever_the_order(order, with_keypoints):
    truth = [true_person(PLACES[i], with_keypoints=with_keypoints) for i in order]
    assert match_people(truth, found_at(*PLACES)).tolist() == list(order)


@pytest.mark.parametrize('with_keypoints', [True, False], ids=['keypoints', 'boxes'])
def test_a_person_is_paired_once_and_a_stranger_never(with_keypoints):
    truth = [true_person(PLACES[1], with_keypoints=with_keypoints)]
    found = found_at((0.3, 0, 6), (0, 0, 6), (-3, 0, 6))
    assert match_people(truth, found).tolist() == [1]
    assert match_people(truth * 2, found_at(PLACES[1])).tolist() == [0, -1]


@pytest.mark.parametrize('with_keypoints', [True, False], ids=['keypoints', 'boxes'])
def test_half_a_person_is_that_person(with_keypoints):
    truth = [true_person(place, with_keypoints=with_keypoints) for place in PLACES]
    head = only(found_at(PLACES[2]), 'NOSE', 'L_EYE', 'R_EYE', 'L_SHOULDER', 'R_SHOULDER')
    assert match_people(truth, head).tolist() == [-1, -1, 0]


def test_a_person_whose_left_and_right_are_exchanged_is_that_person():
    truth = [true_person((0, 0, 3))]
    swapped = found_at((0, 0, 3)).keypoints[:, [
        0, 1, 5, 6, 7, 2, 3, 4, 11, 12, 13, 8, 9, 10, 15, 14, 17, 16]]
    people = People(swapped, np.zeros(1, np.int32))
    assert match_people(truth, people).tolist() == [0]


def test_a_skeleton_from_the_side_fills_little_of_its_box_and_is_in_it():
    wide = true_person((0, 0, 6), with_keypoints=False)
    from_the_side = found_at((0, 0, 6), yaw_deg=90)
    assert match_people([wide], from_the_side).tolist() == [0]


def test_the_one_behind_is_not_the_one_in_front():
    truth = [true_person((0, 0, 4)), true_person((0.5, 0, 9))]
    assert match_people(truth, found_at((0.5, 0, 9), (0, 0, 4))).tolist() == [1, 0]


def test_nobody_matches_nobody():
    truth = [true_person(PLACES[0])]
    assert match_people(truth, People.nobody()).tolist() == [-1]
    assert match_people([], found_at(*PLACES)).tolist() == []
    missing = People(np.full((1, 18, 3), np.nan, np.float32), np.zeros(1, np.int32))
    assert match_people(truth, missing).tolist() == [-1]
    unmarked = TruePerson(0, 5.0, 5.0)
    assert match_people([unmarked], found_at(*PLACES)).tolist() == [-1]
