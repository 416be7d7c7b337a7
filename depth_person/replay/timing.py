"""How fast and how late results came."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depth_person.replay.results import Results

#: Stamps further than this from the times of recording are of another clock, seconds.
SAME_CLOCK_S = 60.0
#: A gap of more than this, in median intervals, is one.
GAP = 1.5

_Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Timing:
    """
    When the results of a recording came.

    :ivar time_s: (f,) the stamps after the first one, seconds.
    :ivar interval_s: (f - 1,) between stamps.
    :ivar latency_s: (f,) from stamp to recording; None where that means nothing.
    :ivar remark: why there is no latency; empty where there is one.
    """

    time_s: _Array
    interval_s: _Array
    latency_s: _Array | None
    remark: str

    @property
    def gaps(self) -> int:
        """How often frames are missing, by the distances of the stamps."""
        if not len(self.interval_s):
            return 0
        return int((self.interval_s > GAP * np.median(self.interval_s)).sum())


def timing(results: Results, *, offline: bool = False) -> Timing:
    """
    Return when results came; the latency where stamps and recording are of one clock.

    :param offline: whether the results are known to have been made after the recording.
    """
    time_s = (results.stamps_ns - results.stamps_ns[0]).astype(np.float64) * 1e-9
    latency = (results.recorded_ns - results.stamps_ns).astype(np.float64) * 1e-9
    remark = ''
    if offline or not latency.any():
        remark = ('The results bear the times of their images as times of recording: they were '
                  'made offline, where a latency means nothing.')
    elif np.median(latency) < 0 or np.median(latency) > SAME_CLOCK_S:
        remark = (f'Stamps lie {np.median(latency):.3g} s before the times of recording (median): '
                  'another clock, so no latency can be told.')
    return Timing(time_s, np.diff(time_s), None if remark else latency, remark)
