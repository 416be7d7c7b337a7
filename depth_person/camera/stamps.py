"""When the frames of a live source were taken, from what its driver tells of them."""
from __future__ import annotations

from collections import deque
from typing import Protocol

from depth_person.camera.source import SourceLost

#: A driver's time of a frame this far off, seconds, is of another clock.
_OLDEST_S = 5.0
#: How long the quickest frame on its way sets what later ones are measured by, seconds. Two
#: clocks of quartz drift apart by less than a millisecond in it.
_WINDOW_S = 2.0
#: Clocks that part by more than this from one window to the next, seconds, differ in rate.
_DRIFT_S = 0.1
#: A sender whose clock does so as many times in a row has no clock: FFmpeg has made its times up.
_DISTRUST = 3
#: A stream may take so long, seconds, to hand over what gathered while it was being opened.
_LONGEST_BACKLOG_S = 2.0
#: Frames that come so much sooner after each other than they were sent, seconds, are a backlog;
#: it has come to its end with so many frames in a row that do not.
_HURRY_S = 0.003
_CALM_FRAMES = 3
#: Times of a stream that jump back or on by more than this, seconds, are of another stream.
_STEP_BACK_S = 0.5
_STEP_ON_S = 10.0


class Stamper(Protocol):
    """Gives frames their stamps."""

    def stamp_ns(self, position_ms: float, *, arrival_ns: int, monotonic_s: float) -> int | None:
        """
        Return when a frame was taken, nanoseconds of the clock that arrival_ns is of.

        :param position_ms: what the driver says of the frame's time.
        :param arrival_ns: when the frame came.
        :param monotonic_s: the same moment by the monotonic clock.
        :returns: None for a frame too old to be shown.
        """
        ...


class ArrivalStamps:
    """A frame was taken when it came: for drivers that do not say."""

    def stamp_ns(self, position_ms: float, *, arrival_ns: int, monotonic_s: float) -> int | None:
        """Return the time of arrival."""
        return arrival_ns


class BufferStamps:
    """V4L2 drivers note on the monotonic clock when a frame began to be taken or came in."""

    def stamp_ns(self, position_ms: float, *, arrival_ns: int, monotonic_s: float) -> int | None:
        """Return the driver's time; that of arrival where the driver has none or another clock."""
        age_s = monotonic_s - position_ms * 1e-3
        if position_ms > 0 and 0 <= age_s < _OLDEST_S:
            return arrival_ns - round(age_s * 1e9)
        return arrival_ns


class StreamStamps:
    """
    Streams carry times by the sender's clock, which has another zero than ours.

    The frame that was quickest on its way shows the difference of the two clocks, but for the
    least delay, which no receiver can know. Measured by it, stamps have the even spacing of the
    sender's, without the jitter of encoding, network and decoding, and never lie after arrival.

    Times that jump mean that the sender has started anew, with images of another size maybe:
    recent versions of OpenCV would go on and stretch them to the size of before.

    The frames that gathered while the stream was being opened come all at once; they are told
    by that, and are not shown.
    """

    def __init__(self) -> None:
        self._opened_s: float | None = None
        self._last_ms = 0.0
        self._calm = 0
        self._settled = False
        self._drifts = 0
        self._window: tuple[float, int] | None = None  # when it began, smallest offset then
        self._quickest: deque[tuple[float, int]] = deque()  # (when, offset ns), offsets rising

    def stamp_ns(self, position_ms: float, *, arrival_ns: int, monotonic_s: float) -> int | None:
        """
        Return the sender's time by our clock; None for a frame of the backlog.

        :raises SourceLost: when the sender has started anew.
        """
        if self._drifts >= _DISTRUST:
            return arrival_ns
        step_s = (position_ms - self._last_ms) * 1e-3
        self._last_ms = position_ms
        if self._settled and not -_STEP_BACK_S < step_s < _STEP_ON_S:
            raise SourceLost('its sender has started anew')
        if step_s <= 0:
            self._quickest.clear()  # no times at all, or not yet
        offset_ns = arrival_ns - round(position_ms * 1e6)
        before_ns = self._quickest[0][1] if self._quickest else None
        self._remember(offset_ns, monotonic_s)
        if not self._settle(before_ns, offset_ns, monotonic_s):
            return None
        return round(position_ms * 1e6) + self._quickest[0][1]

    def _settle(self, before_ns: int | None, offset_ns: int, monotonic_s: float) -> bool:
        """Return whether the backlog has come to its end."""
        if self._opened_s is None:
            self._opened_s = monotonic_s
        if not self._settled:
            calm = before_ns is not None and before_ns - offset_ns < _HURRY_S * 1e9
            self._calm = self._calm + 1 if calm else 0
            self._settled = (self._calm == _CALM_FRAMES
                             or monotonic_s - self._opened_s > _LONGEST_BACKLOG_S)
        return self._settled

    def _remember(self, offset_ns: int, monotonic_s: float) -> None:
        """Keep the smallest offset of the window in front (a monotone queue)."""
        queue = self._quickest
        while queue and queue[-1][1] >= offset_ns:
            queue.pop()
        queue.append((monotonic_s, offset_ns))
        while monotonic_s - queue[0][0] > _WINDOW_S:
            queue.popleft()
        since_s, before_ns = self._window or (monotonic_s, offset_ns)
        if monotonic_s - since_s >= _WINDOW_S:
            parted = abs(queue[0][1] - before_ns) > _DRIFT_S * 1e9
            self._drifts = self._drifts + 1 if parted else 0
        if self._window is None or monotonic_s - since_s >= _WINDOW_S:
            self._window = (monotonic_s, queue[0][1])
