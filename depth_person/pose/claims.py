"""Which keypoints belong to whom, where crops and detections disagree or several claim them."""
from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from depth_person.pose.bodies import (
    Array,
    body_sizes,
    Bools,
    likeness,
    mean_apart,
    mean_known,
    same_people,
)
from depth_person.pose.detector import sureness
from depth_person.pose.movenet import MIN_KEYPOINTS
from depth_person.pose.tracking import Track

#: Whoever is less sure than this on a crop is not confirmed by it.
_LEAST_SURE = 0.3
#: Nor is who lies further than this from where the crop was meant for, over the body's size; and
#: so much further for each second beyond the first tenth that a person was not seen, in all
#: not more than _MOST_STRAYED.
_MOST_OFF = 0.25
_STRAYED_A_SECOND, _MOST_STRAYED, _SEEN_JUST_NOW_S = 0.6, 0.4, 0.1
#: Somebody new has to be this sure to both networks: the product of the two.
_LEAST_SURE_OF_NEW = 0.13
#: A detection this sure needs no crop to confirm it.
_SURE_DETECTION = 0.5
#: A crop less like the detection of its person than this has slipped onto somebody else.
_SLIPPED = 0.15
#: So does one that jumps by more than this, over the body's size, and lies nearer by this factor
#: to where somebody else is expected, who is marked as well.
_JUMP, _NEARER_OTHER = 0.12, 0.5
#: Two people's marks of one keypoint nearer than this, over the body's size, are one mark.
_SAME_MARK = 0.02
#: Whoever loses more than this share of the marks to others is no person of its own.
_MOST_LOST = 0.3
#: A track that turns out to be somebody else's so soon, before it was apart from them, was never
#: a person's.
_YOUNG_NS = 1_000_000_000


@dataclass(frozen=True, eq=False)
class Seen:
    """
    Whom a frame may show: those who are tracked, then those who are new.

    :ivar tracks: None for somebody new.
    :ivar expected: (n, 18, 2) where the keypoints should be, NaN where nobody knows.
    :ivar sizes: (n,) of the bodies, raw pixels.
    :ivar detected: (n, 18, 3) as the detector marked them in this frame; NaN where it did not.
    :ivar stamp_ns: of the frame.
    """

    tracks: list[Track | None]
    expected: Array
    sizes: Array
    detected: Array
    stamp_ns: int

    @cached_property
    def new(self) -> Bools:
        """Who is not tracked yet (n,)."""
        return np.array([track is None for track in self.tracks], bool)

    @cached_property
    def strayed(self) -> Array:
        """How far, over their size, people may have strayed from what is expected (n,)."""
        missed = [
            0.0 if track is None else track.missed_s(self.stamp_ns) for track in self.tracks]
        return np.array([
            min(max(_STRAYED_A_SECOND * (each - _SEEN_JUST_NOW_S), 0.0), _MOST_STRAYED)
            for each in missed], np.float32)


def chosen(seen: Seen, marked: Array) -> Array:
    """Return for each person the crop's keypoints, else the detector's, else NaN."""
    points = marked[..., :2]
    enough = np.isfinite(marked[..., 2]).sum(1) >= MIN_KEYPOINTS
    detected = seen.detected
    off = _off(seen, points)
    good = enough & (off < _MOST_OFF + seen.strayed) & (sureness(marked) >= _LEAST_SURE)
    if len(good) > 1:
        good &= ~_slipped(seen, points, off, good)
    has_detection = np.isfinite(detected[..., 2]).any(1)
    if not has_detection.any():
        alone: Array = np.where(good[:, None, None], marked, np.float32(np.nan))
        return alone
    good &= ~(has_detection & has_slipped(points, detected[..., :2], seen.sizes))
    sure_both = sureness(detected) * sureness(marked) >= _LEAST_SURE_OF_NEW
    good &= ~seen.new | sure_both
    sure = has_detection & ~good & (~seen.new | (sureness(detected) >= _SURE_DETECTION))
    marked = np.where(good[:, None, None], marked, np.nan)
    result: Array = np.where(sure[:, None, None], detected, marked).astype(np.float32)
    return result


def has_slipped(points: Array, detected: Array, sizes: Array) -> Bools:
    """Return which marks (n, 18, 2) are another's than those that the detector made there."""
    slipped: Bools = np.diagonal(likeness(points, detected, sizes, sizes)) < _SLIPPED
    return slipped


def is_young(track: Track | None, stamp_ns: int) -> bool:
    """Return whether it has been followed for so short a time that it may be nobody."""
    return track is None or not (track.apart or stamp_ns - track.started_ns >= _YOUNG_NS)


def refuse_doubles(seen: Seen, keypoints: Array) -> Bools:
    """
    Blank whoever is the same as another, and return who that is (n,).

    Tracks come before those who are new, and then whoever lies nearer to where it was expected.
    """
    points = keypoints[..., :2]
    doubles = np.zeros(len(points), bool)
    same = same_people(points, _sizes(seen, points), strict=~seen.new)
    if not same.any():
        return doubles
    young = np.array([is_young(track, seen.stamp_ns) for track in seen.tracks])
    kept: list[int] = []
    order = np.where(seen.new, -sureness(keypoints), _off(seen, points))
    for index in np.lexsort((order, young, seen.new)):
        doubles[index] = same[index, kept].any()
        if not doubles[index]:
            kept.append(int(index))
    keypoints[doubles] = np.nan
    return doubles


def part_marks(seen: Seen, keypoints: Array) -> Bools:
    """
    Blank a keypoint where another person has it too, and expected it nearer.

    Whoever loses many that way is blanked altogether; return who that is (n,).
    """
    points = keypoints[..., :2]
    apart = points[:, None] - points[None]
    apart = np.hypot(apart[..., 0], apart[..., 1])
    sizes = _sizes(seen, points)
    size = np.minimum(sizes[:, None], sizes[None])
    np.einsum('iik->ik', apart)[...] = np.inf
    first, second, keypoint = np.nonzero(apart < (_SAME_MARK * size)[..., None])
    strayed = points - seen.expected
    off = np.hypot(strayed[..., 0], strayed[..., 1])
    off[np.isnan(off) | seen.new[:, None]] = np.inf
    loses = (off[first, keypoint] > off[second, keypoint]) | (
        (off[first, keypoint] == off[second, keypoint]) & (first > second))
    had = np.isfinite(points[..., 0]).sum(1)
    keypoints[first[loses], keypoint[loses]] = np.nan
    lost = had - np.isfinite(keypoints[..., 0]).sum(1)
    doubles: Bools = lost > _MOST_LOST * had
    keypoints[doubles] = np.nan
    return doubles


def _sizes(seen: Seen, points: Array) -> Array:
    """Return the sizes of bodies (n,), of who is new as it is marked now: it may be a limb."""
    if not seen.new.any():
        return seen.sizes
    return np.where(seen.new, body_sizes(points), seen.sizes)


def _slipped(seen: Seen, points: Array, off: Array, good: Bools) -> Bools:
    """
    Return whose crops show somebody else (n,).

    They jump from where their own person was expected to where another is, who is marked, too.
    """
    slipped = good & ~seen.new & (off > _JUMP)
    if slipped.any():
        nearer = mean_apart(points, seen.expected) < (_NEARER_OTHER * off * seen.sizes)[:, None]
        slipped &= (nearer & (good & ~seen.new) & (off < off[:, None])).any(1)
    return slipped


def _off(seen: Seen, points: Array) -> Array:
    """Return (n,) how far, over their size, people lie from where expected; else infinite."""
    apart = points - seen.expected
    off: Array = mean_known(np.hypot(apart[..., 0], apart[..., 1])) / seen.sizes
    return off
