"""Gives people numbers that stay the same from frame to frame."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depth_person.pose.bodies import body_sizes, mean_apart
from depth_person.pose.skeleton import N_KEYPOINTS

Array = NDArray[np.float32]

#: A track that no network confirms for so long ends.
MAX_MISSED_S = 2.0
#: A person is found within this of where the track is expected, over the person's size; and so
#: much further for each second that it was not seen.
_GATE = 0.55
_GATE_A_SECOND = 0.5
#: Not seen for longer than this, a person may as well have stopped.
MAY_HAVE_STOPPED_S = 0.25
#: A person does not seem larger or smaller by more than this factor from one look to the next.
_SIZE_FACTOR = 2.0
#: People who are further apart than this, over the larger one's size, are not the same.
_TWO_PEOPLE = 0.3
#: Shares of the newest in what is kept of velocity and size.
_VELOCITY_GAIN = 0.4
_SIZE_GAIN = 0.3
#: Frames that follow sooner than this tell less of a velocity: the noise of marks and stamps is
#: then large against the way between.
_SHORT_S = 1 / 60
_NS = 1e-9


@dataclass
class Track:
    """
    One person: where its keypoints were last marked, and how they all move.

    :ivar stamp_ns: when a network confirmed it last.
    :ivar points: (18, 2), NaN where never marked; one that is not seen moves with the others.
    :ivar size: of the body in the image, as body_sizes tells it.
    :ivar velocity: (2,) pixels a second.
    :ivar started_ns: when it was found.
    :ivar apart: whether it has been seen apart from everybody else, so that it is somebody.
    """

    track_id: int
    stamp_ns: int
    points: Array
    size: float
    velocity: Array
    started_ns: int
    apart: bool = False

    def missed_s(self, stamp_ns: int) -> float:
        """Return for how long nobody has seen it."""
        return (stamp_ns - self.stamp_ns) * _NS

    def predicted(self, stamp_ns: int) -> Array:
        """Return where its keypoints are expected (18, 2)."""
        return self.points + self.velocity * np.float32(self.missed_s(stamp_ns))

    def confirm(self, points: Array, size: float, stamp_ns: int) -> None:
        """Take the keypoints (18, 2) that a network has marked now, and the body's size."""
        elapsed = self.missed_s(stamp_ns)
        expected = self.predicted(stamp_ns)
        off = _median_known(points - expected)
        gain = _VELOCITY_GAIN * elapsed / max(elapsed, _SHORT_S) ** 2
        self.velocity = self.velocity + np.float32(gain) * off
        self.points = np.where(np.isnan(points), expected + off, points)
        self.size += _SIZE_GAIN * (size - self.size)
        self.stamp_ns = stamp_ns


class Tracker:
    """
    Associates the people of each frame with those of the frames before.

    The nearest pairs of people and expected tracks are joined first, by the mean distance of
    the keypoints that both have, over the person's size. Ids are never given twice.

    :ivar tracks: those that have not ended, the oldest first.
    """

    def __init__(self, *, max_missed_s: float = MAX_MISSED_S) -> None:
        """Start without tracks; one that is not seen for max_missed_s ends."""
        self.tracks: list[Track] = []
        self._max_missed_ns = round(max_missed_s / _NS)
        self._next_id = 1
        self._stamp_ns: int | None = None

    def update(self, keypoints: Array, stamp_ns: int) -> NDArray[np.int32]:
        """
        Return the track id of each person in a frame; new people get ids never given before.

        A stamp before the last one (a looping bag, a clock set back) ends all tracks.

        :param keypoints: (n, 18, 3) u, v, score; NaN where missing.
        """
        self.advance(stamp_ns)
        points = keypoints[..., :2]
        tracks = dict(self.pairs(points, stamp_ns))
        return np.array([
            self.follow(tracks.get(person), points[person], float(size), stamp_ns).track_id
            for person, size in enumerate(body_sizes(points))], np.int32)

    def advance(self, stamp_ns: int) -> bool:
        """
        End tracks that are missed for too long; return whether this is another stream.

        That is one whose time went back, or that stood still for longer than a track lives.
        """
        elapsed = 0 if self._stamp_ns is None else stamp_ns - self._stamp_ns
        self._stamp_ns = stamp_ns
        self.tracks = [] if elapsed < 0 else [
            track for track in self.tracks if stamp_ns - track.stamp_ns <= self._max_missed_ns]
        return not 0 <= elapsed <= self._max_missed_ns

    def expected(self, stamp_ns: int) -> Array:
        """Return where the keypoints of all tracks are expected (n, 18, 2)."""
        expected = [track.predicted(stamp_ns) for track in self.tracks]
        return np.array(expected, np.float32).reshape(-1, N_KEYPOINTS, 2)

    def follow(self, track: Track | None, points: Array, size: float, stamp_ns: int) -> Track:
        """Return the track of a person who is marked now, a new one where it had none."""
        if track is not None:
            track.confirm(points, size, stamp_ns)
            return track
        track = Track(
            self._next_id, stamp_ns, points.copy(), size, np.zeros(2, np.float32), stamp_ns)
        self._next_id += 1
        self.tracks.append(track)
        return track

    def note_apart(self) -> None:
        """Note who was apart from all others in the last frame, if nobody was missing there."""
        if all(track.apart for track in self.tracks) or any(
                track.stamp_ns != self._stamp_ns for track in self.tracks):
            return
        points = np.stack([track.points for track in self.tracks])
        sizes = np.array([track.size for track in self.tracks])
        near = mean_apart(points, points) < _TWO_PEOPLE * np.maximum(sizes[:, None], sizes)
        for track, others in zip(self.tracks, near.sum(1) - 1, strict=True):
            track.apart |= not others

    def pairs(self, points: Array, stamp_ns: int) -> list[tuple[int, Track]]:
        """
        Return (person, track) pairs, each of either at most once, nearest first.

        :param points: (n, 18, 2), NaN where missing.
        """
        if not self.tracks or not len(points):
            return []
        cost = self._costs(points, stamp_ns)
        pairs: list[tuple[int, Track]] = []
        people, tracks = set[int](), set[int]()
        for flat in np.argsort(cost, axis=None, kind='stable'):
            person, index = divmod(int(flat), len(self.tracks))
            if cost[person, index] > 1.0:
                break
            if person not in people and index not in tracks:
                pairs.append((person, self.tracks[index]))
                people.add(person)
                tracks.add(index)
        return pairs

    def _costs(self, points: Array, stamp_ns: int) -> NDArray[np.floating]:
        """Return (people, tracks) distances over what is allowed; infinite where impossible."""
        missed = np.array([track.missed_s(stamp_ns) for track in self.tracks])
        sizes, track_sizes = body_sizes(points), np.array([each.size for each in self.tracks])
        apart = mean_apart(points, self.expected(stamp_ns))
        stopped = mean_apart(points, np.stack([each.points for each in self.tracks]))
        apart = np.where(missed > MAY_HAVE_STOPPED_S, np.minimum(apart, stopped), apart)
        larger = np.maximum(sizes[:, None], track_sizes)
        cost = apart / (np.maximum(larger, 1) * (_GATE + _GATE_A_SECOND * missed))
        factor = larger / np.maximum(np.minimum(sizes[:, None], track_sizes), 1)
        return np.where(factor <= _SIZE_FACTOR, cost, np.inf)


def _median_known(points: Array) -> Array:
    """Return the median x, y (2,) of points (n, 2), leaving out NaN; 0 where there are none."""
    known = np.sort(points[np.isfinite(points[:, 0])], axis=0)
    if not len(known):
        return np.zeros(2, np.float32)
    middle: Array = (known[(len(known) - 1) // 2] + known[len(known) // 2]) / 2
    return middle
