"""A look at a frame that goes on beside the work on the frames that follow."""
from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depth_person.camera.frame import Frame
from depth_person.pose.detector import Detector
from depth_person.pose.looks import Look

#: How long a look takes on half of the processor, over what it costs by its model. A figure of
#: its own, too, so that a recording gives the same people on every machine.
_TIMES_THE_COST = 2.5


@dataclass
class _Errand:
    frame: Frame
    look: Look
    found: Future[NDArray[np.float32]] | None = None


class Scout:
    """
    Takes one look at a time in a thread of its own.

    :param detector: that nobody else uses.
    :param beside: whether it has a thread of its own; without, it looks when asked for its report.
    """

    def __init__(self, detector: Detector, *, beside: bool = True) -> None:
        self._detector = detector
        self._worker = ThreadPoolExecutor(1, thread_name_prefix='scout') if beside else None
        self._errand: _Errand | None = None

    @property
    def look(self) -> Look | None:
        """The look whose report is outstanding; None where there is none."""
        return self._errand.look if self._errand else None

    @property
    def is_running(self) -> bool:
        """Whether its network works now."""
        errand = self._errand
        return errand is not None and errand.found is not None and not errand.found.done()

    def send(self, frame: Frame, look: Look) -> None:
        """Note a look to take at a frame, which begins with `go`."""
        self._errand = _Errand(frame, look)

    def go(self) -> None:
        """Begin what was noted last, if it has not begun."""
        errand = self._errand
        if self._worker is not None and errand is not None and errand.found is None:
            errand.found = self._worker.submit(
                self._detector.find, errand.frame.image, [errand.look])

    def is_due(self, stamp_ns: int) -> bool:
        """Return whether the report should be there by a frame's stamp."""
        errand = self._errand
        return errand is not None and (
            stamp_ns - errand.frame.stamp_ns >= _TIMES_THE_COST * errand.look.cost_ms * 1e6)

    def report(self) -> tuple[NDArray[np.float32], int]:
        """
        Return whom the look showed (n, 18, 3), and its frame's stamp; wait where it goes on.

        :raises DepthPersonError: as the detector does.
        """
        self.go()
        errand, self._errand = self._errand, None
        assert errand is not None
        found = (
            errand.found.result() if errand.found is not None
            else self._detector.find(errand.frame.image, [errand.look]))
        return found, errand.frame.stamp_ns

    def forget(self) -> None:
        """Leave the report of the last look to nobody."""
        self._errand = None
