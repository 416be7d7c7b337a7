"""The pose stage at two speeds: a detector now and then, a crop of every person at every frame."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depth_person.camera.frame import Frame
from depth_person.pose.bodies import body_sizes, boxes, likeness, same_people
from depth_person.pose.detector import Detector, sureness
from depth_person.pose.looks import Look
from depth_person.pose.movenet import MIN_KEYPOINTS, MoveNet
from depth_person.pose.refine import Refiner
from depth_person.pose.schedule import Schedule
from depth_person.pose.skeleton import Keypoint, N_KEYPOINTS
from depth_person.pose.tracking import Track, Tracker

Array = NDArray[np.float32]

#: So many people are followed; more, if more are to be published.
MOST_TRACKED = 20
#: Whoever is less sure than this on a crop is not confirmed by it.
_LEAST_SURE = 0.3
#: Nor is who lies further than this from where the crop was meant for, over the body's size.
_MOST_OFF = 0.25
#: Somebody new has to be this sure to both networks: the product of the two.
_LEAST_SURE_OF_NEW = 0.13
#: A detection this sure needs no crop to confirm it.
_SURE_DETECTION = 0.5
#: Hidden joints of the body are guessed on crops, and score up to this times min_score; up to
#: _SURE times where neither hip is that sure, as when just a head shows. A face is not guessed
#: at, and scores less even where it is seen.
_GUESSED, _SURE = 1.5, 2.0
#: A crop less like the detection of its person than this has slipped onto somebody else.
_SLIPPED = 0.15
#: Two people's marks of one keypoint nearer than this, over the body's size, are one mark.
_SAME_MARK = 0.02
#: Sides of crops: around the keypoints, and at least and at most, over the body's size.
_CROP_AROUND, _LEAST_CROP, _MOST_CROP = 1.15, 0.75, 1.05
#: Least side of a crop that holds all of a person that is inside the frame.
_LEAST_IN_FRAME = 0.3

_IS_FACE = np.isin(np.arange(N_KEYPOINTS), [
    Keypoint.NOSE, Keypoint.R_EYE, Keypoint.L_EYE, Keypoint.R_EAR, Keypoint.L_EAR])
_HIPS = [Keypoint.R_HIP, Keypoint.L_HIP]


@dataclass(frozen=True, eq=False)
class _Seen:
    """
    Whom a frame may show: those who are tracked, then those who are new.

    :ivar tracks: None for somebody new.
    :ivar expected: (n, 18, 2) where the keypoints should be, NaN where nobody knows.
    :ivar sizes: (n,) of the bodies, raw pixels.
    :ivar detected: (n, 18, 3) as the detector marked them in this frame; NaN where it did not.
    """

    tracks: list[Track | None]
    expected: Array
    sizes: Array
    detected: Array

    @property
    def new(self) -> NDArray[np.bool_]:
        """Who is not tracked yet (n,)."""
        return np.array([track is None for track in self.tracks], bool)


class TwoSpeed:
    """
    Follows people on crops and looks for new ones as the schedule says.

    Whom neither a crop nor the detector confirms in a frame is not given for that frame.

    :param min_score: keypoints that score less are missing.
    :param max_people: the largest so many in the image are given: the nearest, more or less.
    """

    def __init__(
        self, network: MoveNet, refiner: Refiner, schedule: Schedule, tracker: Tracker, *,
        min_score: float, max_people: int,
    ) -> None:
        self._detector, self._refiner, self._schedule = Detector(network), refiner, schedule
        self._tracker = tracker
        self._min_score, self._max_people = min_score, max_people
        self._shape: tuple[int, ...] = ()
        self.inference_s = 0.0

    def estimate(self, frame: Frame) -> tuple[Array, NDArray[np.int32]]:
        """Return keypoints (n, 18, 3) and track ids of the people in a frame, nearest first."""
        self._begin(frame)
        seen = self._look(frame)
        height, width = frame.image.shape[:2]
        crops = crops_around(seen.expected, seen.sizes, width=width, height=height)
        marked = self._refiner(frame.image, *crops)
        self.inference_s = self._detector.inference_s + self._refiner.inference_s
        self._blank_guesses(marked)
        keypoints = _chosen(seen, marked)
        _refuse_doubles(seen, keypoints)
        _part_marks(seen, keypoints)
        return self._confirm(seen, keypoints, frame.stamp_ns)

    def recall(
        self, frame: Frame, keypoints: Array, track_ids: NDArray[np.int32],
    ) -> tuple[Array, NDArray[np.int32]]:
        """
        Return what `estimate` found in a frame before, and go on as if it had been found now.

        Whoever was beyond max_people then is not known, and so found anew later.
        """
        self._begin(frame)
        self._due_looks(frame)
        tracks = {track.track_id: track for track in self._tracker.tracks}
        for row in np.argsort(track_ids, kind='stable'):  # ids are given in rising order
            track = tracks.get(int(track_ids[row]))
            if track is None:
                self._tracker.start(keypoints[row, :, :2], frame.stamp_ns)
            else:
                track.confirm(keypoints[row, :, :2], frame.stamp_ns)
        return keypoints, track_ids

    def _begin(self, frame: Frame) -> None:
        """Forget everybody where a frame belongs to another stream than the one before."""
        if self._tracker.advance(frame.stamp_ns) or frame.image.shape != self._shape:
            self._tracker.tracks.clear()
            self._schedule.restart()
        self._shape = frame.image.shape

    def _due_looks(self, frame: Frame) -> tuple[Array, list[Look]]:
        """Return where those who are tracked are expected (n, 18, 2), and the looks to take."""
        height, width = frame.image.shape[:2]
        expected = np.array(
            [track.predicted(frame.stamp_ns) for track in self._tracker.tracks], np.float32,
        ).reshape(-1, N_KEYPOINTS, 2)
        return expected, self._schedule.looks(width, height, np.nanmean(expected, axis=1))

    def _look(self, frame: Frame) -> _Seen:
        """Return who is tracked, and who is new by the looks that are due."""
        tracks = self._tracker.tracks
        expected, looks = self._due_looks(frame)
        found = self._detector.find(frame.image, looks)
        detected = np.full((len(tracks), N_KEYPOINTS, 3), np.nan, np.float32)
        sizes = np.array([track.size for track in tracks], np.float32)
        place = {track.track_id: index for index, track in enumerate(tracks)}
        new = np.ones(len(found), bool)
        for person, track in self._tracker.pairs(found[..., :2], frame.stamp_ns):
            detected[place[track.track_id]] = found[person]
            new[person] = False
            if track.missed_s(frame.stamp_ns) > 0.25:
                expected[place[track.track_id]] = found[person, :, :2]
        room = max(MOST_TRACKED, self._max_people) - len(tracks)
        new_people = found[new][:max(room, 0)]
        return _Seen(
            [*tracks, *[None] * len(new_people)],
            np.concatenate([expected, new_people[..., :2]]),
            np.concatenate([sizes, body_sizes(new_people[..., :2])]),
            np.concatenate([detected, new_people]))

    def _blank_guesses(self, marked: Array) -> None:
        """Blank keypoints on crops that score no more than those that are hidden."""
        scores = marked[..., 2]
        hips = scores[:, _HIPS].max(1) >= _SURE * self._min_score
        body = np.where(hips, _GUESSED, _SURE)[:, None]
        marked[scores < self._min_score * np.where(_IS_FACE, 1.0, body)] = np.nan

    def _confirm(
        self, seen: _Seen, keypoints: Array, stamp_ns: int,
    ) -> tuple[Array, NDArray[np.int32]]:
        """Bring the tracks up to date; return those seen, the largest first."""
        rows = np.flatnonzero(np.isfinite(keypoints[..., 2]).sum(1) >= MIN_KEYPOINTS)
        ids = np.zeros(len(rows), np.int32)
        sizes = np.zeros(len(rows))
        for index, row in enumerate(rows):
            track = seen.tracks[row]
            if track is None:
                track = self._tracker.start(keypoints[row, :, :2], stamp_ns)
            else:
                track.confirm(keypoints[row, :, :2], stamp_ns)
            ids[index], sizes[index] = track.track_id, track.size
        order = np.argsort(-sizes, kind='stable')[:self._max_people]
        return keypoints[rows[order]], ids[order]


def crops_around(
    points: Array, sizes: Array, *, width: int, height: int,
) -> tuple[Array, Array]:
    """
    Return the centres (n, 2) and sides (n,) of the crops on which people are marked.

    A body that fills the crop is marked best; one of which part is hidden may show more next,
    unless what is missing is outside the frame.

    :param points: (n, 18, 2) where keypoints are expected, NaN where nobody knows.
    :param sizes: (n,) of the bodies.
    :param width: of the frame, pixels.
    """
    around = boxes(points)
    low, high = around[:, :2], around[:, 2:]
    around_sides = _CROP_AROUND * (high - low).max(1)
    sides = np.clip(around_sides, _LEAST_CROP * sizes, _MOST_CROP * sizes)
    middles, frame = (low + high) / 2, np.array([width, height]) - 0.5
    low = np.clip(middles - sides[:, None] / 2, -0.5, frame)
    high = np.clip(middles + sides[:, None] / 2, -0.5, frame)
    sides = np.clip((high - low).max(1), _LEAST_IN_FRAME * sizes, sides)
    return ((low + high) / 2).astype(np.float32), sides.astype(np.float32)


def _chosen(seen: _Seen, marked: Array) -> Array:
    """Return for each person the crop's keypoints, else the detector's, else NaN."""
    points = marked[..., :2]
    enough = np.isfinite(marked[..., 2]).sum(1) >= MIN_KEYPOINTS
    expected, detected = seen.expected, seen.detected
    apart = np.hypot(*np.moveaxis(points - expected, 2, 0))
    known = np.isfinite(apart)
    off = np.where(known, apart, 0).sum(1) / np.maximum(known.sum(1), 1) / seen.sizes
    good = enough & known.any(1) & (off < _MOST_OFF) & (sureness(marked) >= _LEAST_SURE)
    has_detection = np.isfinite(detected[..., 2]).any(1)
    alike = np.diagonal(likeness(points, detected[..., :2], seen.sizes, seen.sizes))
    good &= ~has_detection | (alike >= _SLIPPED)
    sure_both = sureness(detected) * sureness(marked) >= _LEAST_SURE_OF_NEW
    good &= ~seen.new | sure_both
    sure = has_detection & ~good & (~seen.new | (sureness(detected) >= _SURE_DETECTION))
    chosen = np.where(good[:, None, None], marked, np.nan)
    result: Array = np.where(sure[:, None, None], detected, chosen).astype(np.float32)
    return result


def _refuse_doubles(seen: _Seen, keypoints: Array) -> None:
    """Blank whoever is the same as another that fits what was expected better."""
    points = keypoints[..., :2]
    same = same_people(points, seen.sizes, strict=~seen.new)
    if not same.any():
        return
    apart = np.hypot(*np.moveaxis(points - seen.expected, 2, 0)) / seen.sizes[:, None]
    known = np.isfinite(apart)
    off = np.where(known, apart, 0).sum(1) / np.maximum(known.sum(1), 1)
    order = np.lexsort((np.where(seen.new, -sureness(keypoints), off), seen.new))
    kept: list[int] = []
    for index in order:
        if same[index, kept].any():
            keypoints[index] = np.nan
        else:
            kept.append(int(index))


def _part_marks(seen: _Seen, keypoints: Array) -> None:
    """Blank a keypoint where another person has it too, and expected it nearer."""
    points = keypoints[..., :2]
    apart = points[:, None] - points[None]
    apart = np.hypot(apart[..., 0], apart[..., 1])
    size = np.minimum(seen.sizes[:, None], seen.sizes[None])
    np.einsum('iik->ik', apart)[...] = np.inf
    same = apart < (_SAME_MARK * size)[..., None]
    if not same.any():
        return
    off = np.nan_to_num(np.hypot(*np.moveaxis(points - seen.expected, 2, 0)), nan=np.inf)
    first, second, keypoint = np.nonzero(same)
    loses = off[first, keypoint] > off[second, keypoint]
    keypoints[first[loses], keypoint[loses]] = np.nan
