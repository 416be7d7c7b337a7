"""Whether a height is still being measured."""
from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

#: Who has turned by more than this, radians, moves.
_MOVES = 0.005
_LEAST = 10


class FrozenHeight:
    """
    Notices a sensor that repeats itself.

    Every sensor has noise, and a vehicle that turns about its level axes also moves up and down.
    One that stands still may repeat the same rounded figure for ever, rightly.
    """

    def __init__(self) -> None:
        self._value = float('nan')
        self._since_ns = 0
        self._count = 0
        self._down: NDArray[np.float64] | None = None
        self._moved = False

    def frozen(
        self, value: float, *, stamp_ns: int, after_s: float, down: NDArray[np.float64] | None,
    ) -> bool:
        """
        Return whether the height has repeated itself for too long.

        :param after_s: how long is too long; 0 for never.
        :param down: (3,) unit vector of gravity in the vehicle's frame, as its attitude sensor
            says; None where there is none, when the height alone decides.
        """
        if value != self._value or stamp_ns < self._since_ns:
            self._value, self._since_ns, self._count = value, stamp_ns, 0
            self._down, self._moved = down, False
        self._count += 1
        if down is None or self._down is None or np.linalg.norm(down - self._down) > _MOVES:
            self._moved = True
        return bool(
            after_s and self._moved and self._count >= _LEAST
            and stamp_ns - self._since_ns > after_s * 1e9)
