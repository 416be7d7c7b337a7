"""What a node knows of its own health, and how it says so: diagnostics and throttled logs."""
from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable
from enum import Enum
import re
import threading
import time

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
import numpy as np

#: How many of the newest samples percentiles and rates are taken over.
_WINDOW = 300
_LOG_PERIOD_S = 10.0
_LOG_MIN_PERIOD_S = 1.0
#: A stamp this far from the node's clock, seconds, belongs to another time.
ABSURD_AGE_S = 60.0


class Level(Enum):
    """
    Levels of diagnostic_msgs/DiagnosticStatus, in order of how bad they are.

    STALE is for who collects diagnostics and no longer hears of a node (REP 107); a node that
    lacks its input says ERROR.
    """

    OK = DiagnosticStatus.OK
    WARN = DiagnosticStatus.WARN
    ERROR = DiagnosticStatus.ERROR

    @property
    def rank(self) -> int:
        """0 for OK, rising."""
        return list(Level).index(self)


class Monitor:
    """
    Collects a node's counts, times and faults; every method may be called from any thread.

    :param log: takes a level and a message; called at most once a second for each fault, and
        once in ten seconds for one that stays as it is.
    :param clock: monotonic seconds.
    :ivar on_change: called when a fault comes, goes or changes in more than its numbers.
    """

    def __init__(
        self, log: Callable[[Level, str], None], *, clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.on_change: Callable[[], None] = lambda: None
        self._log = log
        self._clock = clock
        self._lock = threading.Lock()
        self._counts: Counter[str] = Counter()
        self._values: dict[str, str] = {}
        self._samples: dict[str, deque[float]] = {}
        self._ticks: deque[float] = deque(maxlen=_WINDOW)
        self._faults: dict[str, tuple[Level, str]] = {}
        self._lasting: set[str] = set()
        self._state = (Level.OK, '')
        self._logged: dict[str, tuple[float, str]] = {}

    def count(self, name: str, number: int = 1) -> None:
        """Add to a count."""
        with self._lock:
            self._counts[name] += number

    def value(self, name: str, text: str) -> None:
        """Set a text that the diagnostics show."""
        with self._lock:
            self._values[name] = text

    def frame(self) -> None:
        """Note that one more frame has been dealt with."""
        with self._lock:
            self._counts['frames'] += 1
            self._ticks.append(self._clock())

    def sample(self, name: str, seconds: float) -> None:
        """Note one measured time."""
        with self._lock:
            self._samples.setdefault(name, deque(maxlen=_WINDOW)).append(seconds)

    def latency(self, *, stamp_ns: int, now_ns: int) -> None:
        """
        Note how long after its stamp a frame was published.

        A stamp of another time, such as a bag's without sim time, is said to be one instead.
        """
        seconds = (now_ns - stamp_ns) * 1e-9
        if abs(seconds) < ABSURD_AGE_S:
            self.sample('latency', seconds)
            with self._lock:
                self._values.pop('latency', None)
            return
        with self._lock:
            self._samples.pop('latency', None)
            self._values['latency'] = (
                f'not known: the clock is {seconds:.0f} s past the stamps; play a recording with '
                "publish_clock and use_sim_time, or set the camera's clock")

    def set_state(self, level: Level, message: str) -> None:
        """Say what the node as a whole is up to, where it is not simply running."""
        with self._lock:
            changed = self._state != (level, message)
            self._state = (level, message)
        if changed:
            self.on_change()

    def fault(self, key: str, level: Level, message: str, *, lasting: bool = False) -> None:
        """
        Report a fault that stays until it is cleared; log it unless that has just been done.

        :param lasting: whether `forget` leaves it.
        """
        now = self._clock()
        kind = re.sub(r'\d+', '#', message)  # one that only counts on is not new
        with self._lock:
            before_level, before = self._faults.get(key, (None, ''))
            changed = (level, kind) != (before_level, re.sub(r'\d+', '#', before))
            self._faults[key] = (level, message)
            if lasting:
                self._lasting.add(key)
            logged_at, logged = self._logged.get(key, (float('-inf'), ''))
            due = now - logged_at >= (_LOG_PERIOD_S if kind == logged else _LOG_MIN_PERIOD_S)
            if due:
                self._logged[key] = (now, kind)
        if due:
            self._log(level, message)
        if changed:
            self.on_change()

    def clear(self, key: str) -> None:
        """Take a fault back."""
        with self._lock:
            changed = self._faults.pop(key, None) is not None
        if changed:
            self.on_change()

    def keep(self) -> None:
        """Let `forget` leave the faults of now."""
        with self._lock:
            self._lasting |= self._faults.keys()

    def forget(self) -> None:
        """Take all faults back but the lasting ones: what they were of has been stopped."""
        with self._lock:
            self._faults = {
                key: fault for key, fault in self._faults.items() if key in self._lasting}
            self._ticks.clear()
            self._samples.clear()
        self.on_change()

    def status(self, name: str) -> DiagnosticStatus:
        """Return the state as a message: the worst fault first, then all the figures."""
        with self._lock:
            told = [fault for fault in (self._state, *self._faults.values()) if fault[1]]
            faults = sorted(told, key=lambda fault: -fault[0].rank)
            level, _ = faults[0] if faults else (Level.OK, '')
            figures = {**self._rate(), **self._times(), **self._values, **self._counts}
        return DiagnosticStatus(
            level=level.value, name=name, hardware_id=figures.get('source', 'none'),
            message='; '.join(message for _, message in faults) or 'running',
            values=[KeyValue(key=key, value=str(value)) for key, value in figures.items()])

    def _rate(self) -> dict[str, str]:
        if not self._ticks:
            return {'rate': '0.0 Hz', 'age of last frame': 'none yet'}
        # The time since the last frame counts too, or a dead source would keep its rate.
        recent = [tick for tick in self._ticks if self._clock() - tick < _LOG_PERIOD_S]
        span = self._clock() - recent[0] if recent else 0.0
        rate = (len(recent) - 1) / span if len(recent) > 1 else 0.0
        return {
            'rate': f'{rate:.1f} Hz',
            'age of last frame': f'{self._clock() - self._ticks[-1]:.2f} s'}

    def _times(self) -> dict[str, str]:
        result = {}
        for name, seconds in self._samples.items():
            for label, percentile in (('median', 50), ('p95', 95), ('p99', 99)):
                value = 1000 * float(np.percentile(seconds, percentile))
                result[f'{name} {label}'] = f'{value:.1f} ms'
        return result
