"""Gives people numbers that stay the same from frame to frame."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

#: A person moves less than this between two frames, over the person's size.
_GATE = 0.6
#: Share of the newest velocity in what is kept of it.
_VELOCITY_GAIN = 0.4
_NS = 1e-9


@dataclass
class _Track:
    """One person: where its keypoints were last marked, and how they all move."""

    track_id: int
    stamp_ns: int
    points: NDArray[np.float32]  # (18, 2), NaN where never marked
    size: float
    velocity: NDArray[np.float32]  # (2,) pixels a second

    def predicted(self, stamp_ns: int) -> NDArray[np.float32]:
        return self.points + self.velocity * np.float32((stamp_ns - self.stamp_ns) * _NS)

    def update(self, points: NDArray[np.float32], size: float, stamp_ns: int) -> None:
        elapsed = (stamp_ns - self.stamp_ns) * _NS
        moved = points - self.points
        if elapsed > 0:
            newest = np.nanmedian(moved, axis=0) / np.float32(elapsed)
            self.velocity = self.velocity + np.float32(_VELOCITY_GAIN) * (newest - self.velocity)
        unseen = np.isnan(points)
        self.points = np.where(unseen, self.predicted(stamp_ns), points)
        self.size, self.stamp_ns = size, stamp_ns


class Tracker:
    """
    Associates the people of each frame with those of the frames before.

    The nearest pairs of people and predicted tracks are joined first, by the mean distance of
    the keypoints that both have, over the person's size.
    """

    def __init__(self, *, max_missed_s: float = 1.0) -> None:
        """Start without tracks; one that is not seen for max_missed_s ends."""
        self._max_missed_ns = round(max_missed_s / _NS)
        self._tracks: list[_Track] = []
        self._next_id = 1
        self._stamp_ns: int | None = None

    def update(self, keypoints: NDArray[np.float32], stamp_ns: int) -> NDArray[np.int32]:
        """
        Return the track id of each person in a frame; new people get ids never given before.

        A stamp before the last one (a looping bag, a clock set back) ends all tracks.

        :param keypoints: (n, 18, 3) u, v, score; NaN where missing.
        """
        if self._stamp_ns is not None and stamp_ns < self._stamp_ns:
            self._tracks.clear()
        self._stamp_ns = stamp_ns
        self._tracks = [
            track for track in self._tracks if stamp_ns - track.stamp_ns <= self._max_missed_ns]
        points = keypoints[..., :2]
        sizes = _sizes(points)
        ids = np.zeros(len(keypoints), np.int32)
        for person, index in self._pairs(points, sizes, stamp_ns):
            track = self._tracks[index]
            track.update(points[person], float(sizes[person]), stamp_ns)
            ids[person] = track.track_id
        for person in range(len(ids)):
            if ids[person]:
                continue
            ids[person] = self._next_id
            self._tracks.append(_Track(
                self._next_id, stamp_ns, points[person].copy(), float(sizes[person]),
                np.zeros(2, np.float32)))
            self._next_id += 1
        return ids

    def _pairs(
        self, points: NDArray[np.float32], sizes: NDArray[np.float32], stamp_ns: int,
    ) -> list[tuple[int, int]]:
        """Return (person, track) pairs, each of either at most once, nearest first."""
        if not self._tracks or not len(points):
            return []
        predicted = np.stack([track.predicted(stamp_ns) for track in self._tracks])
        track_sizes = np.array([track.size for track in self._tracks])
        apart = points[:, None] - predicted[None]  # (people, tracks, 18, 2)
        apart = np.hypot(apart[..., 0], apart[..., 1])
        common = np.isfinite(apart)
        mean = np.where(common, apart, 0).sum(2) / np.maximum(common.sum(2), 1)
        cost = mean / np.maximum(np.maximum(sizes[:, None], track_sizes[None]), 1)
        cost[~common.any(2)] = np.inf
        pairs: list[tuple[int, int]] = []
        people, tracks = set[int](), set[int]()
        for flat in np.argsort(cost, axis=None, kind='stable'):
            person, track = divmod(int(flat), len(self._tracks))
            if cost[person, track] > _GATE:
                break
            if person not in people and track not in tracks:
                pairs.append((person, track))
                people.add(person)
                tracks.add(track)
        return pairs


def _sizes(points: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return (n,) the longer side of the box around each person's keypoints, pixels."""
    marked = np.isfinite(points)
    low = np.where(marked, points, np.inf).min(1, initial=np.inf)
    high = np.where(marked, points, -np.inf).max(1, initial=-np.inf)
    return np.maximum(high - low, 0).max(1)
