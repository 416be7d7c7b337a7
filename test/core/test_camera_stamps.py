"""When frames were taken, from what drivers and streams say of them."""
from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st
import pytest

from depth_person.camera.source import SourceLost
from depth_person.camera.stamps import ArrivalStamps, BufferStamps, StreamStamps

SECOND = 10**9
#: The monotonic clock's zero on our clock, nanoseconds.
BOOT = 1_700_000_000 * SECOND


def stamps_of(stamper, frames):
    """Return the stamps of frames (position in ms, monotonic arrival in s), seconds since BOOT."""
    given_ns = [stamper.stamp_ns(position_ms, arrival_ns=BOOT + round(arrival_s * SECOND),
                                 monotonic_s=arrival_s) for position_ms, arrival_s in frames]
    return [None if stamp is None else (stamp - BOOT) / SECOND for stamp in given_ns]


@pytest.mark.parametrize(('position_ms', 'expected_s'), [
    (99_960.0, 99.96),   # a buffer filled 40 ms before it was read
    (100_000.0, 100.0),
    (0.0, 100.0),        # a driver that does not say
    (100_500.0, 100.0),  # one that is ahead of the clock
    (1_700_000_000_000.0, 100.0),  # one that gives the time of day
    (90_000.0, 100.0),   # ten seconds old: another clock
])
def test_a_buffer_is_stamped_by_its_driver_where_that_can_be_true(position_ms, expected_s):
    assert stamps_of(BufferStamps(), [(position_ms, 100.0)]) == pytest.approx([expected_s])


def test_drivers_that_say_nothing_leave_the_arrival():
    assert stamps_of(ArrivalStamps(), [(123.0, 100.0)]) == pytest.approx([100.0])


def test_a_stream_keeps_its_senders_spacing_measured_by_its_quickest_frame():
    frames = [(0, 50.000), (40, 50.040), (80, 50.080), (120, 50.120),  # settles
              (160, 50.190), (200, 50.195), (240, 50.235), (280, 50.300)]

    stamps = stamps_of(StreamStamps(), frames)

    assert stamps[:3] == [None, None, None]
    assert stamps[3:] == pytest.approx([50.120, 50.160, 50.195, 50.235, 50.275])


def test_what_gathered_while_a_stream_was_opened_is_not_shown():
    backlog = [(40 * index, 50 + 0.005 * index) for index in range(25)]
    live = [(1000 + 40 * index, 50.125 + 0.04 * index) for index in range(6)]

    stamps = stamps_of(StreamStamps(), backlog + live)

    assert stamps[:28] == [None] * 28
    assert stamps[28:] == pytest.approx([50.245, 50.285, 50.325])


def test_a_stream_that_never_calms_down_is_shown_all_the_same():
    frames = [(40 * index, 50 + 0.03 * index) for index in range(100)]

    stamps = stamps_of(StreamStamps(), frames)

    shown = next(index for index, stamp in enumerate(stamps) if stamp is not None)
    assert 2.0 < 0.03 * shown < 2.1
    assert None not in stamps[shown:]


def test_a_slow_drift_of_the_senders_clock_is_followed():
    """A sender whose clock is slow by 100 ppm, over ten minutes."""
    frames = [(40 * index * 0.9999, 50 + 0.04 * index) for index in range(15_000)]

    stamps = stamps_of(StreamStamps(), frames)

    assert stamps[-1] == pytest.approx(frames[-1][1], abs=0.001)


def test_times_that_ffmpeg_has_made_up_are_not_believed_for_long():
    """It counts 25 frames a second where there are no times; these come at 10."""
    frames = [(40 * index, 50 + 0.1 * index) for index in range(150)]

    stamps = stamps_of(StreamStamps(), frames)

    assert stamps[-1] == pytest.approx(frames[-1][1])
    assert stamps_of(StreamStamps(), [(0, 50 + index) for index in range(5)])[-1] == 54.0


@pytest.mark.parametrize('jump_ms', [-5000, 20_000])
def test_a_sender_that_starts_anew_is_a_loss(jump_ms):
    stamper = StreamStamps()
    stamps_of(stamper, [(5000 + 40 * index, 50 + 0.04 * index) for index in range(10)])

    with pytest.raises(SourceLost, match='started anew'):
        stamps_of(stamper, [(5400 + jump_ms, 50.4)])


@given(st.lists(st.floats(0, 0.5), min_size=10, max_size=200), st.floats(0.005, 0.2))
def test_stamps_of_a_stream_rise_and_never_lie_after_arrival(delays, period_s):
    arrivals, now_s = [], 0.0
    for index, delay_s in enumerate(delays):
        now_s = max(now_s + 1e-4, 50 + index * period_s + delay_s)
        arrivals.append((1000 * index * period_s, now_s))

    stamps = stamps_of(StreamStamps(), arrivals)

    shown = [(stamp, arrival_s) for stamp, (_, arrival_s) in zip(stamps, arrivals, strict=True)
             if stamp is not None]
    assert all(stamp <= arrival_s + 1e-6 for stamp, arrival_s in shown)
    assert all(later[0] > earlier[0] - 1e-6 for earlier, later in pairwise(shown))
