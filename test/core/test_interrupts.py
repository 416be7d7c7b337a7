"""Ctrl-C and SIGTERM are held back while they would do harm, and are not lost."""
import signal

import pytest

from depth_person.interrupts import deferred_interrupts, SIGNALS


@pytest.fixture
def heard():
    """Return the signals that this process heard."""
    numbers = []
    before = {number: signal.signal(number, lambda number, _: numbers.append(number))
              for number in SIGNALS}
    yield numbers
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.parametrize(('first', 'second'), [SIGNALS, SIGNALS[::-1]])
def test_the_first_of_those_that_came_is_heard_at_the_end(heard, first, second):
    with deferred_interrupts():
        signal.raise_signal(first)
        signal.raise_signal(second)
        assert not heard
    assert heard == [first]
    signal.raise_signal(second)
    assert heard == [first, second]


def test_ctrl_c_interrupts_once_the_block_has_ended(heard):
    signal.signal(signal.SIGINT, signal.default_int_handler)
    done = []

    def interrupted():
        with deferred_interrupts():
            signal.raise_signal(signal.SIGINT)
            done.append(True)

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert done


def test_a_process_that_ignores_ctrl_c_goes_on_ignoring_it(heard):
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with deferred_interrupts():
        signal.raise_signal(signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
