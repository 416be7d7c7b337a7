"""Bounds the age of what is published: a result that comes too late does more harm than none."""
from __future__ import annotations

from collections.abc import Callable
from enum import Enum
import time

from depth_person.nodes.monitor import ABSURD_AGE_S, Level, Monitor

_FAULT = 'age'
_JUMP = 'clock of the camera'
#: Stamps that go back by more than the one, or ahead of the time that has passed by more than
#: the other, seconds, are of a clock that has been set.
_JUMP_BACK_S = 0.5
_JUMP_AHEAD_S = 1.0


class Age(Enum):
    """What the time from an image's stamp to now says of a result."""

    FRESH = 'fresh'
    STALE = 'stale'
    UNKNOWN = 'unknown'


class Watchdog:
    """
    Judges the age of each result just before it is published.

    An age beyond a minute, or stamps ahead of the clock, are not a slow pipeline's: the camera's
    clock is another, as with a bag that is played by the wall clock. Then the age is not known.
    """

    def __init__(
        self, monitor: Monitor, *, clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._monitor = monitor
        self._clock = clock
        self._last: tuple[int, float] | None = None

    def judge(self, *, stamp_ns: int, now_ns: int, max_age_s: float) -> Age:
        """
        Return what the age says; report and count what is not fresh.

        :param max_age_s: who is older is stale; 0 for no limit, when everything is fresh.
        """
        self._note_jump(stamp_ns)
        age_s = (now_ns - stamp_ns) * 1e-9
        if not max_age_s or -max_age_s <= age_s <= max_age_s:
            self._monitor.clear(_FAULT)
            return Age.FRESH
        if max_age_s < age_s < ABSURD_AGE_S:
            self._monitor.count('results dropped for their age')
            self._monitor.fault(
                _FAULT, Level.ERROR,
                f'results are dropped: {age_s:.2f} s have passed since the image was taken, more '
                f'than max_age ({max_age_s:g} s). Use a smaller input_size, check that the '
                "camera's clock is this machine's, or set max_age (0 for a recording)")
            return Age.STALE
        self._monitor.count('results of unknown age')
        self._monitor.fault(
            _FAULT, Level.WARN,
            f'the age of images is not known: the clock is {age_s:.0f} s past their stamps. '
            'Nothing goes to autopilots; play a recording with publish_clock and use_sim_time, '
            "set the camera's clock, or set max_age to 0 to do without a limit")
        return Age.UNKNOWN

    def _note_jump(self, stamp_ns: int) -> None:
        last, self._last = self._last, (stamp_ns, self._clock())
        if last is None:
            return
        ahead_s = (stamp_ns - last[0]) * 1e-9
        passed_s = self._last[1] - last[1]
        if -_JUMP_BACK_S <= ahead_s <= passed_s + _JUMP_AHEAD_S:
            self._monitor.clear(_JUMP)
            return
        self._monitor.count('clock jumps')
        self._monitor.fault(
            _JUMP, Level.WARN, f'the stamps of the images have jumped by {ahead_s:.1f} s, while '
            f'{passed_s:.1f} s have passed; the clock was set, or a recording has a gap or began '
            'anew')
