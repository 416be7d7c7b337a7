"""How late many messages were, in the memory of a few."""
from __future__ import annotations

from math import ceil

import numpy as np

#: What the counted values are told apart by, seconds; summaries show as much.
_STEP_S = 1e-5
#: Whoever is later than this, seconds, is among the latest, however late.
_LONG_S = 1.0


class Lateness:
    """
    Counts by how late messages were, in steps of 0.01 ms.

    :ivar count: of the messages.
    :ivar most_s: of the latest one, seconds.
    """

    def __init__(self) -> None:
        self.count = 0
        self.most_s = 0.0
        self._counts = np.zeros(round(_LONG_S / _STEP_S) + 1, dtype=np.int64)

    def add(self, late_s: float) -> None:
        """Count one more message, so many seconds late."""
        self.count += 1
        self.most_s = max(self.most_s, late_s)
        self._counts[min(round(late_s / _STEP_S), self._counts.size - 1)] += 1

    def within_s(self, share: float) -> float:
        """Return by how many seconds at most a share of the messages, above 0 to 1, was late."""
        step = int(np.searchsorted(np.cumsum(self._counts), ceil(share * self.count)))
        if step == self._counts.size - 1:
            return self.most_s
        return min(step * _STEP_S, self.most_s)
