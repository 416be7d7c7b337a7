"""Hand-over between threads."""
import threading
import time

import pytest

from depth_person.nodes.worker import Mailbox, Worker


def test_the_newest_item_is_kept_and_the_older_dropped():
    mailbox = Mailbox()
    assert [mailbox.put(item) for item in (1, 2, 3)] == [False, True, True]
    assert mailbox.take() == 3
    assert not mailbox.put(4)


def test_who_waits_gets_the_item_that_comes():
    mailbox = Mailbox()
    threading.Timer(0.1, mailbox.put, ['late']).start()
    assert mailbox.take() == 'late'


def test_closing_wakes_who_waits():
    mailbox = Mailbox()
    threading.Timer(0.1, mailbox.close).start()
    assert mailbox.take() is None


def test_a_closed_mailbox_drops_what_it_holds_and_what_comes_until_it_is_opened():
    mailbox = Mailbox()
    mailbox.put('old')
    mailbox.close()
    assert not mailbox.put('refused')
    assert mailbox.take() is None
    mailbox.open()
    mailbox.put('new')
    assert mailbox.take() == 'new'


def test_a_mailbox_is_idle_when_its_taker_is_back_for_more():
    mailbox = Mailbox()
    working, done = threading.Event(), threading.Event()

    def take_all(_):
        while mailbox.take() is not None:
            working.set()
            done.wait()

    worker = Worker('taker', take_all)
    worker.start()
    mailbox.put('work')
    assert working.wait(60)
    assert not mailbox.idle
    done.set()
    deadline = time.monotonic() + 60
    while not mailbox.idle:
        assert time.monotonic() < deadline
    mailbox.close()
    assert worker.stop()


def test_a_failure_in_a_thread_is_kept():
    def fail(_):
        raise ValueError('no')

    worker = Worker('failing', fail)
    worker.start()
    assert worker.stop()
    with pytest.raises(ValueError, match='no'):
        raise worker.failure


def test_a_thread_that_does_not_stop_is_said_not_to():
    release = threading.Event()
    worker = Worker('stubborn', lambda _: release.wait())
    worker.start()
    assert not worker.stop(timeout_s=0.1)
    assert worker.stopping.is_set()
    release.set()
    assert worker.stop()
