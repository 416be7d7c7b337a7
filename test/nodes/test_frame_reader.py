"""Sources are paced, opened again, and let go."""
import threading
from time import monotonic

import numpy as np
import pytest

from depth_person.camera.frame import Frame
from depth_person.camera.source import Source, SourceLost, SourceUnusable
from depth_person.errors import DepthPersonError
from depth_person.nodes import frame_reader, pacer
from depth_person.nodes.frame_reader import FrameReader
from depth_person.nodes.monitor import Monitor

IMAGE = np.zeros((2, 2, 3), np.uint8)
MILLISECOND = 1_000_000


class ListSource(Source):
    """Frames of these stamps, then an end or a fault."""

    description = 'a list'

    def __init__(self, stamps_ms, fault=None, live=False):
        self.live = live
        self.closed = False
        self._frames = [Frame(IMAGE, stamp * MILLISECOND, 'eye') for stamp in stamps_ms]
        self._fault = fault

    def read(self):
        if self._frames:
            return self._frames.pop(0)
        if self._fault:
            raise self._fault
        return None

    def close(self):
        self.closed = True


class Time:
    """Passes in waits only."""

    def __init__(self):
        self.now_s = 100.0

    def monotonic(self):
        return self.now_s

    def wait(self, seconds):
        self.now_s += seconds


@pytest.fixture
def time(monkeypatch):
    """Return the time by which the reader goes whose harness is given it."""
    result = Time()
    monkeypatch.setattr(pacer, 'time', result)
    return result


class Harness:
    """A reader of a list of sources; a fault in their place is raised on opening."""

    def __init__(self, *sources, live, time=None, clock=True):
        self.sources = list(sources)
        self.logged = []
        self.clocks_ms = []
        self.stopping = threading.Event()
        if time is not None:
            self.stopping.wait = time.wait
        self.monitor = Monitor(lambda level, text: self.logged.append(text))
        self.reader = FrameReader(
            self._open, live=live, monitor=self.monitor, stopping=self.stopping,
            on_clock=self._on_clock if clock else None)

    def _on_clock(self, stamp_ns):
        self.clocks_ms.append(stamp_ns / MILLISECOND)

    def _open(self):
        source = self.sources.pop(0)
        if isinstance(source, Exception):
            raise source
        return source

    def stamps_ms(self):
        return [frame.stamp_ns / MILLISECOND for frame in self.reader.frames()]


class SlowSource(ListSource):
    """Frames that take longer to be read than lies between their stamps."""

    def __init__(self, stamps_ms, time):
        super().__init__(stamps_ms)
        self._time = time

    def read(self):
        self._time.wait(0.15)
        return super().read()


@pytest.mark.parametrize(('recorded', 'clock'), [(False, False), (True, False), (False, True)])
def test_a_file_that_is_read_too_slowly_gets_stamps_of_now_unless_it_brings_its_own(
        time, recorded, clock):
    source = SlowSource(range(0, 500, 50), time)
    source.recorded = recorded
    harness = Harness(source, live=False, time=time, clock=clock)
    late_s, first_s = [], None
    for frame in harness.reader.frames():
        first_s = first_s or time.now_s - frame.stamp_ns * 1e-9
        late_s.append(time.now_s - first_s - frame.stamp_ns * 1e-9)
    assert len(late_s) == 10
    if recorded or clock:
        assert late_s[-1] > 0.8
    else:
        assert max(late_s) < 0.4


@pytest.fixture
def quick(monkeypatch):
    """Make the reader try again a hundred times sooner; return the waits it takes."""
    monkeypatch.setattr(frame_reader, '_FIRST_DELAY_S', 0.01)
    monkeypatch.setattr(frame_reader, '_LONGEST_DELAY_S', 0.1)


def test_a_recording_takes_as_long_as_its_stamps_say_and_drives_the_clock(time):
    harness = Harness(ListSource([500, 600, 800]), live=False, time=time)
    started_s = time.now_s
    assert harness.stamps_ms() == [500, 600, 800]
    assert time.now_s - started_s == pytest.approx(0.3)
    assert harness.clocks_ms == sorted(harness.clocks_ms)
    assert (harness.clocks_ms[0], harness.clocks_ms[-1]) == (500, 800)
    assert max(np.diff(harness.clocks_ms)) < 60


def test_stamps_that_jump_back_start_anew(time):
    harness = Harness(ListSource([10_000, 10_100, 0, 100]), live=False, time=time)
    started_s = time.now_s
    assert harness.stamps_ms() == [10_000, 10_100, 0, 100]
    assert time.now_s - started_s == pytest.approx(0.2)


def test_live_frames_are_not_held_back(time):
    harness = Harness(
        ListSource([0, 60_000], live=True, fault=DepthPersonError('x')), live=True, time=time)
    frames = harness.reader.frames()
    started_s = time.now_s
    assert [next(frames).stamp_ns, next(frames).stamp_ns] == [0, 60_000 * MILLISECOND]
    assert time.now_s == started_s


def test_a_live_source_is_opened_again_with_growing_patience(quick):
    gone = DepthPersonError('unplugged')
    first = ListSource([0], fault=SourceLost('lost'), live=True)
    harness = Harness(
        gone, gone, first, gone, gone, gone, gone, gone, ListSource([7], live=True), live=True)
    waits = []
    harness.stopping.wait = waits.append
    assert harness.stamps_ms() == [0, 7]
    assert waits == pytest.approx([0.01, 0.02, 0.01, 0.02, 0.04, 0.08, 0.1, 0.1])
    assert first.closed
    assert 'unplugged; trying again in' in harness.logged[0]
    status = harness.monitor.status('n')
    assert {pair.key: pair.value for pair in status.values}['reconnects'] == '8'
    assert status.message == 'running'  # since there are frames again


def test_a_recording_that_cannot_be_opened_is_an_error():
    with pytest.raises(DepthPersonError, match='no such file'):
        Harness(DepthPersonError('no such file'), live=False).stamps_ms()


def test_a_torn_recording_ends_with_a_report():
    source = ListSource([0, 1], fault=SourceLost('torn after 2 frames'))
    harness = Harness(source, live=False)
    assert harness.stamps_ms() == [0, 1]
    assert harness.logged == ['torn after 2 frames']
    assert source.closed


def test_an_interrupted_wait_for_the_next_frame_ends_at_once():
    harness = Harness(ListSource([0, 60_000]), live=False)
    frames = harness.reader.frames()
    next(frames)
    threading.Timer(0.1, harness.reader.interrupt).start()
    started_s = monotonic()
    assert list(frames) == []
    assert monotonic() - started_s < 30.0


def test_a_camera_that_no_waiting_brings_is_an_error_unless_it_has_worked(quick):
    with pytest.raises(DepthPersonError, match='no permission'):
        Harness(SourceUnusable('no permission'), live=True).stamps_ms()

    worked = ListSource([0], fault=SourceLost('lost'), live=True)
    harness = Harness(
        worked, SourceUnusable('no permission'), ListSource([7], live=True), live=True)
    assert harness.stamps_ms() == [0, 7]
