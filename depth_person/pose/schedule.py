"""Which looks the detector takes at each frame, within a budget."""
from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from depth_person.pose.looks import far_look, far_parts, Look, whole_looks

#: How soon a look comes round again, against the others: by what newcomers it is likely to show.
_GAIN_NEAR, _GAIN_MIDDLE, _GAIN_FAR = 1.0, 6.0, 1.0
#: A part of the frame in which people are.
_GAIN_PEOPLED = 2.0
#: Budgets of a frame in which nobody is tracked, or somebody is lost.
_IDLE_BUDGETS = 3.0
#: Frames that come more slowly pay for those that would have come at this rate, but not for more.
_LEAST_FPS = 15.0
_MOST_FRAMES = 8.0


class Schedule:
    """
    Spreads looks over frames.

    Every frame pays its budget in; the look that has waited longest, over its gain, is taken as
    soon as it is paid for. The first frame of a stream gets every look at once, since nothing
    is known yet. Costs are a model's, not measured times, so the looks follow from the frames.

    :param budget_ms: of a frame.
    :param input_side: of the look at the whole frame, pixels of the network's input.
    """

    def __init__(self, *, budget_ms: float, input_side: int) -> None:
        self._budget_ms, self._input_side = budget_ms, input_side
        self._size = (0, 0)
        self._looks: list[Look] = []
        self._gains = np.empty(0)
        self._low = self._high = np.empty((0, 2), int)
        self._is_part = np.empty(0, bool)
        self._waited = np.empty(0)
        self._paid_ms = 0.0

    def restart(self) -> None:
        """Let the next frame be the first of a stream."""
        self._size = (0, 0)

    def looks(
        self, width: int, height: int, people: NDArray[np.float32], *, elapsed_s: float = 0.0,
        lost: bool = False, wait: bool = False,
    ) -> list[Look]:
        """
        Return the looks to take at the next frame.

        :param width: of the frame; frames of another size are another stream.
        :param people: (n, 2) where people are tracked, raw pixels.
        :param elapsed_s: since the frame before.
        :param lost: whether one of them was not seen in the frame before.
        :param wait: whether none can be taken yet; one may be saved for meanwhile, no more.
        """
        if (width, height) != self._size:
            return self._first(width, height)
        self._waited += self._gains * self._peopled(people)
        frames = min(max(elapsed_s * _LEAST_FPS, 1.0), _MOST_FRAMES)
        budgets = 1.0 if len(people) and not lost else _IDLE_BUDGETS
        self._paid_ms += self._budget_ms * budgets * frames
        if wait:
            self._paid_ms = min(self._paid_ms, max(look.cost_ms for look in self._looks))
            return []
        chosen: list[Look] = []
        while len(chosen) < len(self._looks):
            next_ = int(self._waited.argmax())
            if self._looks[next_].cost_ms > self._paid_ms:
                return chosen
            chosen.append(self._looks[next_])
            self._paid_ms -= self._looks[next_].cost_ms
            self._waited[next_] = 0.0
        self._paid_ms = 0.0  # more than all looks cost is not saved up
        return chosen

    def is_saved_for(self, look: Look) -> bool:
        """Return whether a look costs more than a frame pays."""
        return look.cost_ms > self._budget_ms

    def _first(self, width: int, height: int) -> list[Look]:
        self._size = (width, height)
        whole = whole_looks(width, height, input_side=self._input_side)
        parts = far_parts(width, height, input_side=self._input_side)
        self._looks = [*whole, *parts]
        gains = [*[_GAIN_NEAR] * (len(whole) - 1), _GAIN_MIDDLE, *[_GAIN_FAR] * len(parts)]
        self._gains = np.array(gains)
        self._low = np.array([(look.x, look.y) for look in self._looks])
        self._high = self._low + [(look.width, look.height) for look in self._looks]
        self._is_part = ((self._high - self._low) != self._size).any(1)
        self._waited = np.zeros(len(self._looks))
        self._paid_ms = 0.0
        return [*whole, far_look(width, height)] if parts else whole

    def _peopled(self, people: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return by how much each look gains from where people are."""
        inside = (people[:, None] >= self._low) & (people[:, None] < self._high)
        return np.where(inside.all(2).any(0) & self._is_part, _GAIN_PEOPLED, 1.0)
