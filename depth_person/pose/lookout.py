"""Which looks for people a frame takes at once, and which go on beside the frames that follow."""
from __future__ import annotations

import time

import numpy as np

from depth_person.camera.frame import Frame
from depth_person.pose.bodies import Array, mean_known
from depth_person.pose.claims import has_slipped
from depth_person.pose.detector import limbs
from depth_person.pose.looks import Look
from depth_person.pose.schedule import Schedule
from depth_person.pose.scout import Scout
from depth_person.pose.tracking import Tracker

#: A look may go on beside frames that follow sooner than this, and while no more people than
#: this are tracked: more crops keep the whole processor busy by themselves.
_SOON_S, _FEW = 0.08, 3


class Lookout:
    """
    Takes the looks of a schedule so that fast frames are not held up.

    While few people are tracked and none is lost, a scout takes those that frames have to save
    for. Its report is late, so nobody is taken from it: where it shows somebody who is not
    tracked, the same look is taken again at once.

    :ivar waited_s: how long the last frame waited for the scout.
    """

    def __init__(self, schedule: Schedule, scout: Scout, tracker: Tracker) -> None:
        self._schedule, self._scout, self._tracker = schedule, scout, tracker
        self._before_ns = 0
        self.waited_s = 0.0

    @property
    def is_busy(self) -> bool:
        """Whether a look goes on beside the frame."""
        return self._scout.is_running

    def restart(self) -> None:
        """Let the next frame be the first of a stream."""
        self._schedule.restart()
        self._scout.forget()

    def looks(self, frame: Frame, expected: Array, *, recalled: bool = False) -> list[Look]:
        """
        Return the looks to take at a frame now, and see to that which may take longer.

        :param expected: (n, 18, 2) where those who are tracked are expected.
        :param recalled: whether looks are taken as done, since what they showed is known.
        """
        self.waited_s = 0.0
        tracks = self._tracker.tracks
        lost = any(track.stamp_ns < self._before_ns for track in tracks)
        elapsed_s = (frame.stamp_ns - self._before_ns) * 1e-9
        self._before_ns = frame.stamp_ns
        outstanding = self._scout.look
        height, width = frame.image.shape[:2]
        looks = self._schedule.looks(
            width, height, mean_known(expected.swapaxes(1, 2)), lost=lost, elapsed_s=elapsed_s,
            wait=outstanding is not None)
        if outstanding is not None:
            again = self._is_doubted(outstanding, frame.stamp_ns, lost=lost, recalled=recalled)
            looks = [outstanding] if again else []
        elif (0 < len(tracks) <= _FEW and not lost and elapsed_s < _SOON_S
              and len(looks) == 1 and self._schedule.is_saved_for(looks[0])):
            self._scout.send(frame, looks[0])
            looks = []
        if not recalled:
            self._scout.go()
        return looks

    def _is_doubted(self, look: Look, stamp_ns: int, *, lost: bool, recalled: bool) -> bool:
        """Return whether the look that is outstanding has to be taken again now."""
        due = self._scout.is_due(stamp_ns)
        if lost or (due and recalled):
            self._scout.forget()
            return lost
        if not due:
            return False
        start = time.perf_counter()
        found, then_ns = self._scout.report()
        self.waited_s = time.perf_counter() - start
        return self._is_news(found, then_ns, largest=look.largest)

    def _is_news(self, found: Array, stamp_ns: int, *, largest: float) -> bool:
        """Return whether an earlier frame shows others than those who are tracked."""
        points, tracks = found[..., :2], self._tracker.tracks
        expected = self._tracker.expected(stamp_ns)
        sizes = np.array([track.size for track in tracks])
        news = np.asarray(
            ~limbs(points, np.full(len(points), largest), expected, sizes).any(1))
        row = {track.track_id: [index] for index, track in enumerate(tracks)}
        for person, track in self._tracker.pairs(points, stamp_ns):
            own = row[track.track_id]
            news[person] &= has_slipped(expected[own], points[[person]], sizes[own]).item()
        return bool(news.any())
