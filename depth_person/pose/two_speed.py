"""The pose stage at two speeds: a detector now and then, a crop of every person at every frame."""
from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from depth_person.camera.frame import Frame
from depth_person.pose.bodies import Array, body_sizes, Bools
from depth_person.pose.claims import chosen, is_young, part_marks, refuse_doubles, Seen
from depth_person.pose.crops import crops_around
from depth_person.pose.detector import Detector
from depth_person.pose.lookout import Lookout
from depth_person.pose.movenet import MIN_KEYPOINTS
from depth_person.pose.refine import Refiner
from depth_person.pose.skeleton import Keypoint, N_KEYPOINTS
from depth_person.pose.tracking import MAY_HAVE_STOPPED_S, Tracker

#: So many people are followed; more, if more are to be published.
MOST_TRACKED = 20
#: Hidden joints of the body are guessed on crops, and score up to this times min_score; up to
#: _SURE times where neither hip is that sure, as when just a head shows. A face is not guessed
#: at, and scores less even where it is seen.
_GUESSED, _SURE = 1.5, 2.0

_IS_FACE = np.isin(np.arange(N_KEYPOINTS), [
    Keypoint.NOSE, Keypoint.R_EYE, Keypoint.L_EYE, Keypoint.R_EAR, Keypoint.L_EAR])


class TwoSpeed:
    """
    Follows people on crops and looks for new ones as a lookout says.

    Whom neither a crop nor the detector confirms in a frame is not given for that frame.

    :param min_score: keypoints that score less are missing.
    :param max_people: the largest so many in the image are given: the nearest, more or less.
    """

    def __init__(
        self, detector: Detector, refiner: Refiner, lookout: Lookout, tracker: Tracker, *,
        min_score: float, max_people: int,
    ) -> None:
        self._detector, self._refiner = detector, refiner
        self._lookout, self._tracker = lookout, tracker
        self._max_people = max_people
        self._least, self._least_with_hips = (
            min_score * np.where(_IS_FACE, 1.0, body) for body in (_SURE, _GUESSED))
        self._least_hip = _SURE * min_score
        self._shape: tuple[int, ...] = ()
        self.inference_s = 0.0

    def estimate(self, frame: Frame) -> tuple[Array, NDArray[np.int32]]:
        """Return keypoints (n, 18, 3) and track ids of the people in a frame, nearest first."""
        self._begin(frame)
        seen = self._look(frame)
        height, width = frame.image.shape[:2]
        crops = crops_around(
            seen.expected, seen.sizes * (1 + seen.strayed), width=width, height=height)
        marked = self._refiner(frame.image, *crops, beside=self._lookout.is_busy)
        self.inference_s = (
            self._detector.inference_s + self._lookout.waited_s + self._refiner.inference_s)
        self._blank_guesses(marked)
        keypoints = chosen(seen, marked)
        if len(keypoints) > 1:
            doubles = refuse_doubles(seen, keypoints) | part_marks(seen, keypoints)
            self._end_young(seen, doubles)
        return self._confirm(seen, keypoints)

    def recall(
        self, frame: Frame, keypoints: Array, track_ids: NDArray[np.int32],
    ) -> tuple[Array, NDArray[np.int32]]:
        """
        Return what `estimate` found in a frame before, and go on as if it had been found now.

        Whoever was beyond max_people then is not known, and so found anew later.
        """
        self._begin(frame)
        self._lookout.looks(frame, self._tracker.expected(frame.stamp_ns), recalled=True)
        tracks = {track.track_id: track for track in self._tracker.tracks}
        points = keypoints[..., :2]
        sizes = body_sizes(points)
        for row in np.argsort(track_ids, kind='stable'):  # ids are given in rising order
            track = tracks.get(int(track_ids[row]))
            self._tracker.follow(track, points[row], float(sizes[row]), frame.stamp_ns)
        return keypoints, track_ids

    def _begin(self, frame: Frame) -> None:
        """Forget everybody where a frame belongs to another stream than the one before."""
        self._tracker.note_apart()
        if self._tracker.advance(frame.stamp_ns) or frame.image.shape != self._shape:
            self._tracker.tracks.clear()
            self._lookout.restart()
        self._shape = frame.image.shape

    def _look(self, frame: Frame) -> Seen:
        """Return who is tracked, and who is new by the looks that are due."""
        tracks = self._tracker.tracks
        expected = self._tracker.expected(frame.stamp_ns)
        found = self._detector.find(frame.image, self._lookout.looks(frame, expected))
        detected = np.full((len(tracks), N_KEYPOINTS, 3), np.nan, np.float32)
        sizes = np.array([track.size for track in tracks], np.float32)
        if not len(found):
            return Seen([*tracks], expected, sizes, detected, frame.stamp_ns)
        place = {track.track_id: index for index, track in enumerate(tracks)}
        new = np.ones(len(found), bool)
        for person, track in self._tracker.pairs(found[..., :2], frame.stamp_ns):
            detected[place[track.track_id]] = found[person]
            new[person] = False
            if track.missed_s(frame.stamp_ns) > MAY_HAVE_STOPPED_S:
                expected[place[track.track_id]] = found[person, :, :2]
        room = max(MOST_TRACKED, self._max_people) - len(tracks)
        new_people = found[new][:max(room, 0)]
        return Seen(
            [*tracks, *[None] * len(new_people)],
            np.concatenate([expected, new_people[..., :2]]),
            np.concatenate([sizes, body_sizes(new_people[..., :2])]),
            np.concatenate([detected, new_people]), frame.stamp_ns)

    def _blank_guesses(self, marked: Array) -> None:
        """Blank keypoints on crops that score no more than those that are hidden."""
        scores = marked[..., 2]
        hips = np.maximum(scores[:, Keypoint.R_HIP], scores[:, Keypoint.L_HIP]) >= self._least_hip
        least = np.where(hips[:, None], self._least_with_hips, self._least)
        marked[scores < least] = np.nan

    def _end_young(self, seen: Seen, doubles: Bools) -> None:
        """End the tracks of people who have turned out to be tracked already."""
        if not doubles.any():
            return
        ended = {
            track.track_id for track, double in zip(seen.tracks, doubles, strict=True)
            if double and track is not None and is_young(track, seen.stamp_ns)}
        self._tracker.tracks = [
            track for track in self._tracker.tracks if track.track_id not in ended]

    def _confirm(self, seen: Seen, keypoints: Array) -> tuple[Array, NDArray[np.int32]]:
        """Bring the tracks up to date; return those seen, the largest first."""
        rows = np.flatnonzero(np.isfinite(keypoints[..., 2]).sum(1) >= MIN_KEYPOINTS)
        points = keypoints[rows, :, :2]
        tracks = [
            self._tracker.follow(seen.tracks[row], place, float(size), seen.stamp_ns)
            for row, place, size in zip(rows, points, body_sizes(points), strict=True)]
        order = sorted(range(len(tracks)), key=lambda index: -tracks[index].size)
        order = order[:self._max_people]
        ids = [tracks[index].track_id for index in order]
        return keypoints[rows[order]], np.array(ids, np.int32)
