"""Looks cover the frame and keep to their budget, whatever the machine does."""
from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from depth_person.pose.looks import far_look, far_parts, Look, whole_looks
from depth_person.pose.schedule import Schedule

NOBODY = np.empty((0, 2), np.float32)
ONE = np.array([[640, 360]], np.float32)


def cost(looks):
    return sum(look.cost_ms for look in looks)


def test_a_look_costs_what_its_pixels_cost():
    # 512x288 is 147.456 thousand pixels, a quarter of a millisecond each thousand.
    assert Look(0, 0, 1280, 720, 512).cost_ms == pytest.approx(36.864)


@pytest.mark.parametrize('size', [(1280, 720), (720, 1280), (1920, 1080), (1242, 375), (640, 480)])
def test_parts_cover_the_whole_frame_and_are_small_in_the_networks_input(size):
    width, height = size
    seen = np.zeros((height, width), bool)
    for part in far_parts(width, height, input_side=512):
        view = part.part(seen)
        assert view.shape == (part.height, part.width)
        view[:] = True
        assert part.cost_ms <= Look(0, 0, 512, 320, 512).cost_ms
        # As large in the network's input as in the look that sees the whole frame as far.
        assert part.input_side / max(part.width, part.height) == pytest.approx(
            960 / max(size), rel=0.01)
    assert seen.all()


@pytest.mark.parametrize('size', [(1, 1), (3, 2), (2, 400), (4000, 3)])
@pytest.mark.parametrize('input_side', [128, 256, 640])
def test_parts_of_tiny_and_narrow_frames_lie_inside_them(size, input_side):
    parts = far_parts(*size, input_side=input_side)
    assert parts
    for part in parts:
        assert part.part(np.empty((size[1], size[0], 3), np.uint8)).shape == (
            part.height, part.width, 3)
        assert min(part.width, part.height, part.input_side) >= 1


def test_an_input_that_sees_far_needs_no_parts():
    assert far_parts(1280, 720, input_side=960) == []
    assert [look.input_side for look in whole_looks(1280, 720, input_side=960)] == [256, 960]


def test_the_first_frame_of_a_stream_gets_every_look_at_once():
    schedule = Schedule(budget_ms=8.0, input_side=512)
    first = [*whole_looks(1280, 720, input_side=512), far_look(1280, 720)]
    assert schedule.looks(1280, 720, NOBODY) == first
    assert schedule.looks(1280, 720, ONE) == []
    schedule.restart()
    assert schedule.looks(1280, 720, ONE) == first
    assert len(schedule.looks(640, 480, ONE)) == 3  # another size is another stream


@settings(max_examples=30)
@given(budget_ms=st.floats(0.5, 100), count=st.integers(1, 300))
def test_looks_keep_to_the_budget(budget_ms, count):
    schedule = Schedule(budget_ms=budget_ms, input_side=512)
    schedule.looks(1280, 720, ONE)
    spent = [cost(schedule.looks(1280, 720, ONE)) for _ in range(count)]
    assert sum(spent) <= budget_ms * count + 1e-6
    assert sum(spent) > budget_ms * count - 60  # what is not spent would not pay the next look


def test_while_a_look_is_outstanding_no_more_than_one_is_saved_for():
    schedule = Schedule(budget_ms=8.0, input_side=512)
    first = schedule.looks(1280, 720, ONE)
    assert [schedule.looks(1280, 720, ONE, wait=True) for _ in range(100)] == [[]] * 100
    assert cost(schedule.looks(1280, 720, ONE)) <= 41 + 8
    assert [schedule.is_saved_for(look) for look in first[:2]] == [True, True]
    assert not Schedule(budget_ms=12.0, input_side=512).is_saved_for(first[0])


def test_without_a_budget_nothing_is_looked_at_again():
    schedule = Schedule(budget_ms=0.0, input_side=512)
    schedule.looks(1280, 720, ONE)
    assert [schedule.looks(1280, 720, NOBODY) for _ in range(50)] == [[]] * 50


def test_every_look_comes_round():
    schedule = Schedule(budget_ms=8.0, input_side=512)
    schedule.looks(1280, 720, ONE)
    taken = [look for _ in range(200) for look in schedule.looks(1280, 720, ONE)]
    whole, parts = whole_looks(1280, 720, input_side=512), far_parts(1280, 720, input_side=512)
    assert set(taken) == {*whole, *parts}
    # The whole frame at middle size comes most often; then the part in which people are.
    counts = {look: taken.count(look) for look in set(taken)}
    assert max(counts, key=counts.__getitem__) == whole[-1]


@pytest.mark.parametrize(('people', 'options', 'times'), [
    (NOBODY, {}, 3.0), (ONE, {'lost': True}, 3.0), (ONE, {'elapsed_s': 0.05}, 1.0),
    (ONE, {'elapsed_s': 0.2}, 3.0), (ONE, {'elapsed_s': 1.9}, 8.0)])
def test_empty_scenes_lost_people_and_slow_frames_are_looked_at_more(people, options, times):
    spent = []
    for args, more in ((ONE, {}), (people, options)):
        schedule = Schedule(budget_ms=8.0, input_side=512)
        schedule.looks(1280, 720, args)
        spent.append(cost(
            look for _ in range(300) for look in schedule.looks(1280, 720, args, **more)))
    assert spent[1] / spent[0] == pytest.approx(times, rel=0.05)
