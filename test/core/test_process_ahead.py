"""A stage that works ahead of who takes its items."""
from contextlib import closing
import itertools
import sys
import threading
import time

import pytest

from depth_person.replay.ahead import ahead, short_turns


def test_items_come_in_order_and_then_the_end():
    assert list(ahead(range(100), depth=3)) == list(range(100))


def test_no_more_than_the_depth_is_got_in_advance():
    got = []

    def items():
        for number in range(20):
            got.append(number)
            yield number

    with closing(ahead(items(), depth=3)) as numbers:
        assert next(numbers) == 0
        time.sleep(0.3)
        assert len(got) <= 5  # taken, waiting, and one in hand


def test_an_error_comes_behind_the_items_before_it():
    def items():
        yield 1
        raise RuntimeError('torn')

    numbers = ahead(items(), depth=3)

    assert next(numbers) == 1
    with pytest.raises(RuntimeError, match='torn'):
        next(numbers)


def test_leaving_early_ends_the_thread_and_closes_the_items():
    ended = threading.Event()

    def items():
        try:
            yield from itertools.count()
        finally:
            ended.set()

    before = set(threading.enumerate())
    with closing(ahead(items(), depth=3)) as numbers:
        assert next(numbers) == 0

    assert ended.is_set()
    assert set(threading.enumerate()) <= before


def test_stages_overlap():
    together = threading.Barrier(3)

    def meeting(items, *, at):
        for item in items:
            if item == at:
                together.wait(20)  # for the two other stages, each at its own item
            yield item

    with closing(ahead(meeting(range(20), at=2), depth=3)) as first, \
            closing(ahead(meeting(first, at=1), depth=3)) as second:
        assert list(meeting(second, at=0)) == list(range(20))


def test_short_turns_end_with_the_block_whatever_ends_it():
    usual = sys.getswitchinterval()

    def stumble():
        assert sys.getswitchinterval() < usual / 10
        raise RuntimeError('torn')

    with pytest.raises(RuntimeError, match='torn'), short_turns():
        stumble()
    assert sys.getswitchinterval() == usual
