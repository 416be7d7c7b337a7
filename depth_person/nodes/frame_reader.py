"""Frames of a source in their time: paced, and opened again when a live one is lost."""
from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
import threading

from depth_person.camera.frame import Frame
from depth_person.camera.source import Source, SourceUnusable
from depth_person.errors import DepthPersonError
from depth_person.nodes.monitor import Level, Monitor
from depth_person.nodes.pacer import Pacer

#: A file that is read more slowly than it was filmed goes on from now when it is later than this,
#: seconds, with stamps to match: old stamps would be taken for old frames.
LATEST_S = 0.2
_FIRST_DELAY_S = 0.5
_LONGEST_DELAY_S = 8.0


class FrameReader:
    """
    Reads a source until it ends or is told to stop.

    :param open_source: opens the source; called again after a live one was lost.
    :param live: whether the source may come later, or come back.
    :param stopping: ends every wait.
    :param on_clock: told the stamp that a recording has come to, between frames too.
    """

    def __init__(
        self, open_source: Callable[[], Source], *, live: bool, monitor: Monitor,
        stopping: threading.Event, on_clock: Callable[[int], None] | None = None,
    ) -> None:
        self._open = open_source
        self._live = live
        self._monitor = monitor
        self._stopping = stopping
        self._own_clock = on_clock is not None
        self._pacer = (
            Pacer(stopping, on_clock) if self._own_clock
            else Pacer(stopping, None, latest_s=LATEST_S))
        self._source: Source | None = None

    def frames(self) -> Iterator[Frame]:
        """
        Yield every frame when its time has come.

        :raises DepthPersonError: when a recording gives no frame at all, or no waiting brings a
            live source; a torn recording just ends.
        """
        delay_s = _FIRST_DELAY_S
        started = False
        while not self._stopping.is_set():
            try:
                with self._open() as source:
                    self._source = source
                    self._live = self._live or source.live
                    self._monitor.value('source', source.description)
                    for frame in iter(source.read, None):
                        delay_s, started = _FIRST_DELAY_S, True
                        self._monitor.clear('source')
                        if source.live:
                            self._monitor.value('dropped frames', str(source.dropped))
                        else:
                            frame = self._in_time(frame, source)
                        if self._stopping.is_set():
                            return
                        yield frame
                return
            except DepthPersonError as error:
                hopeless = not self._live or isinstance(error, SourceUnusable)
                if hopeless and not started:
                    raise
                if not self._live:
                    self._monitor.fault('source', Level.ERROR, str(error))
                    return
                self._monitor.count('reconnects')
                self._monitor.fault(
                    'source', Level.ERROR, f'{error}; trying again in {delay_s:g} s')
            self._stopping.wait(delay_s)
            delay_s = min(2 * delay_s, _LONGEST_DELAY_S)

    def _in_time(self, frame: Frame, source: Source) -> Frame:
        """Return a frame when it is due, with the stamp of that time unless it is recorded."""
        self._pacer.wait(frame.stamp_ns)
        if source.recorded or self._own_clock or not self._pacer.lost_s:
            return frame
        return replace(frame, stamp_ns=frame.stamp_ns + round(self._pacer.lost_s * 1e9))

    def interrupt(self) -> None:
        """End the wait for the next frame, from another thread."""
        self._stopping.set()
        if self._source is not None and self._source.live:
            self._source.close()
