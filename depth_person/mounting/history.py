"""What was true at one time, from samples of other times."""
from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from depth_person.distance.attitude import turned

#: Samples further apart than this do not tell what was between them, seconds.
_LONGEST_GAP_S = 0.5
#: Over at least this time, seconds, is the rate taken that goes on after the newest sample.
_BASE_S = 0.05
#: Stamps that go back by more than this, seconds, are of a clock that has been set.
_JUMP_S = 0.5
_KEPT = 1000

Value = TypeVar('Value')


class NotKnown(Exception):  # noqa: N818, since it is an answer
    """Nothing is known of the time asked for; the text says why."""


class Taken(Enum):
    """What has become of a sample."""

    ADDED = 'added'
    LATE = 'late'
    JUMPED = 'jumped'


@dataclass(frozen=True, eq=False)
class Pose:
    """
    A frame as seen from another.

    :ivar rotation: (3, 3) to the other frame.
    :ivar position: (3,) of its origin in the other frame, metres.
    """

    rotation: NDArray[np.float64]
    position: NDArray[np.float64]

    def then(self, outer: Pose) -> Pose:
        """Return this frame as seen from the frame from which `outer` is seen."""
        return Pose(
            outer.rotation @ self.rotation, outer.rotation @ self.position + outer.position)

    def inverted(self) -> Pose:
        """Return the other frame as seen from this one."""
        return Pose(self.rotation.T, -self.rotation.T @ self.position)


@dataclass(frozen=True, eq=False)
class Found(Generic[Value]):
    """
    A value at the time asked for.

    :ivar beyond_s: how far that time is from the nearest sample where it does not lie between
        two; 0 where it does. The value is worth the less the larger this is.
    """

    value: Value
    beyond_s: float


class History(Generic[Value]):
    """
    Samples with stamps, oldest first.

    Between two samples it interpolates. Before the first or after the newest it goes on, for no
    longer than `reach_s`: with the rate of the last samples where there are several, else with
    the nearest.

    :param blend: returns what is at a share of the way from one value to another; a share above
        1 goes on beyond.
    """

    def __init__(self, blend: Callable[[Value, Value, float], Value], *, reach_s: float) -> None:
        self._blend = blend
        self._reach_s = reach_s
        self._stamps: list[int] = []
        self._values: list[Value] = []

    def add(self, stamp_ns: int, value: Value) -> Taken:
        """Add a sample; forget all earlier ones if its stamp has jumped back."""
        taken = Taken.ADDED
        if self._stamps and stamp_ns <= self._stamps[-1]:
            if self._stamps[-1] - stamp_ns <= _JUMP_S * 1e9:
                return Taken.LATE
            self.clear()
            taken = Taken.JUMPED
        self._stamps.append(stamp_ns)
        self._values.append(value)
        if len(self._stamps) > 2 * _KEPT:
            del self._stamps[:_KEPT], self._values[:_KEPT]
        return taken

    def clear(self) -> None:
        """Forget everything."""
        self._stamps.clear()
        self._values.clear()

    def at(self, stamp_ns: int) -> Found[Value]:
        """Return the value at this time; raise NotKnown when no sample is near enough."""
        stamps, values = self._stamps, self._values
        if not stamps:
            raise NotKnown('nothing has come')
        after = bisect_left(stamps, stamp_ns)
        if after < len(stamps) and stamps[after] == stamp_ns:
            return Found(values[after], 0.0)
        if 0 < after < len(stamps) and stamps[after] - stamps[after - 1] <= _LONGEST_GAP_S * 1e9:
            share = (stamp_ns - stamps[after - 1]) / (stamps[after] - stamps[after - 1])
            return Found(self._blend(values[after - 1], values[after], share), 0.0)
        nearest = min(
            (index for index in (after - 1, after) if 0 <= index < len(stamps)),
            key=lambda index: abs(stamps[index] - stamp_ns))
        beyond_s = abs(stamps[nearest] - stamp_ns) * 1e-9
        if beyond_s > self._reach_s:
            side = 'before' if stamps[nearest] < stamp_ns else 'after'
            raise NotKnown(f'the nearest is {beyond_s:.2f} s {side} the image')
        if after == len(stamps):
            return Found(self._beyond(stamp_ns), beyond_s)
        return Found(values[nearest], beyond_s)

    def _beyond(self, stamp_ns: int) -> Value:
        """Return what comes after the newest sample if all goes on as before."""
        stamps, values = self._stamps, self._values
        base = bisect_left(stamps, stamps[-1] - int(_BASE_S * 1e9) + 1) - 1
        if base < 0 or stamps[-1] - stamps[base] > _LONGEST_GAP_S * 1e9:
            return values[-1]
        share = (stamp_ns - stamps[base]) / (stamps[-1] - stamps[base])
        return self._blend(values[base], values[-1], share)


def blend_poses(one: Pose, other: Pose, share: float) -> Pose:
    """Return the pose at a share of the way: turned about one axis, moved along a line."""
    return Pose(
        turned(one.rotation, other.rotation, share),
        one.position + share * (other.position - one.position))


def blend_numbers(one: float, other: float, share: float) -> float:
    """Return the number at a share of the way."""
    return one + share * (other - one)
