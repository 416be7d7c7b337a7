"""Draws skeletons and distances into images."""
from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from depth_person.camera.intrinsics import Intrinsics
from depth_person.distance.tracked import TrackedPeople
from depth_person.pose.people import People
from depth_person.pose.skeleton import Keypoint, LIMBS

#: BGR; the light ones of Okabe and Ito's colours, which the colour-blind can tell apart.
PALETTE = (
    (0, 159, 230), (233, 180, 86), (115, 200, 60), (66, 228, 240), (190, 150, 225), (90, 120, 250))
NO_RANGE = (160, 160, 160)
#: A limb with an end that scores less is drawn faint.
SURE_SCORE = 0.4
FAINT = 0.5

_LIMBS = np.array(LIMBS)
_FONT = cv2.FONT_HERSHEY_DUPLEX
_LABEL_BACKGROUND = (32, 32, 32)
_WHITE = (255, 255, 255)
# OpenCV takes fixed-point coordinates, so that nothing jumps by whole pixels.
_SHIFT = 4
_FURTHEST = 30_000 >> _SHIFT  # pixels; OpenCV's fixed-point lines overflow not far beyond


class Box(NamedTuple):
    """Where a label is, pixels; all are of one height."""

    left: int
    top: int
    width: int


def draw(
    image: NDArray[np.uint8], tracked: TrackedPeople, intrinsics: Intrinsics | None = None,
) -> None:
    """
    Draw each person's skeleton, and at the neck the range in centimetres with one sigma.

    Limbs that the network is unsure of are darker. Who has no range is grey, without a number;
    who is hidden is a ring, and a range that is only predicted says so.

    :param image: (height, width, 3) BGR of the caller's own; drawn into.
    :param intrinsics: of the image; without, the hidden are left out.
    """
    people, distances = tracked.people, tracked.distances
    anchors = _anchors(tracked, intrinsics)
    scale = max(image.shape[0] / 720, 0.4)
    order = np.argsort(-np.where(distances.known, distances.range, np.inf), kind='stable')
    for row in order:  # the nearest last, on top
        colour = person_colour(int(people.track_ids[row])) if distances.known[row] else NO_RANGE
        _draw_skeleton(image, people.keypoints[row], colour, scale)
        if _is_hidden(people, row) and distances.known[row]:
            _draw_ring(image, anchors[row], colour, scale)
    boxes: list[Box] = []
    for row in order[::-1]:
        if distances.known[row] and np.isfinite(anchors[row]).all():
            track_id = int(people.track_ids[row])
            text = (f'#{track_id}  {100 * distances.range[row]:.0f} '
                    f'+/- {100 * distances.range_sigma[row]:.0f} cm'
                    f'{" predicted" * bool(tracked.predicted[row])}')
            boxes.append(_draw_label(
                image, text, anchors[row], person_colour(track_id), scale,
                avoid=boxes))


def person_colour(track_id: int) -> tuple[int, int, int]:
    """Return the BGR colour of a track id."""
    return PALETTE[track_id % len(PALETTE)]


def _draw_skeleton(
    image: NDArray[np.uint8], keypoints: NDArray[np.float32], colour: tuple[int, int, int],
    scale: float,
) -> None:
    points = keypoints[:, :2]
    drawable: NDArray[np.bool_] = np.all(np.abs(points) < _FURTHEST, axis=1)  # NaN is not
    fixed = np.rint(np.where(drawable[:, None], points, 0) * (1 << _SHIFT)).astype(np.int32)
    limbs = _LIMBS[drawable[_LIMBS].all(axis=1)]
    sure = (keypoints[limbs, 2] >= SURE_SCORE).all(axis=1)
    for chosen, brightness in ((~sure, FAINT), (sure, 1.0)):
        cv2.polylines(
            image, list(fixed[limbs[chosen]]), isClosed=False,
            color=tuple(brightness * channel for channel in colour),
            thickness=max(round(2 * scale), 1), lineType=cv2.LINE_AA, shift=_SHIFT)
    if drawable[Keypoint.NECK]:
        radius = round(5 * scale * (1 << _SHIFT))
        centre = fixed[Keypoint.NECK].tolist()
        cv2.circle(image, centre, radius, colour, cv2.FILLED, cv2.LINE_AA, _SHIFT)
        cv2.circle(image, centre, radius, _WHITE, 1, cv2.LINE_AA, _SHIFT)


def _draw_ring(
    image: NDArray[np.uint8], place: NDArray[np.floating], colour: tuple[int, int, int],
    scale: float,
) -> None:
    if (np.abs(place) < _FURTHEST).all():  # NaN is not
        centre = np.rint(place * (1 << _SHIFT)).astype(int).tolist()
        cv2.circle(image, centre, round(8 * scale * (1 << _SHIFT)), colour,
                   max(round(3 * scale), 2), cv2.LINE_AA, _SHIFT)


def _anchors(tracked: TrackedPeople, intrinsics: Intrinsics | None) -> list[NDArray[np.floating]]:
    """Return where each label goes, pixels: the neck, the middle of what was found, or NaN."""
    necks = np.full((len(tracked), 2), np.nan)
    if intrinsics is not None:
        necks = intrinsics.project(tracked.distances.position)
    return [
        necks[row] if _is_hidden(tracked.people, row) else _anchor(tracked.people.keypoints[row])
        for row in range(len(tracked))]


def _is_hidden(people: People, row: int) -> bool:
    return not np.isfinite(people.keypoints[row]).any()


def _anchor(keypoints: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the pixel of the neck, or the middle of what was found."""
    neck = keypoints[Keypoint.NECK, :2]
    if np.isfinite(neck).all():
        return neck
    found = keypoints[np.isfinite(keypoints).all(axis=1), :2]
    return found.mean(axis=0) if len(found) else np.zeros(2, np.float32)


def _draw_label(
    image: NDArray[np.uint8], text: str, anchor: NDArray[np.float32],
    colour: tuple[int, int, int], scale: float, *, avoid: Sequence[Box],
) -> Box:
    """Write a text beside its anchor, inside the image and above other labels; return where."""
    size, pad, thickness = 0.6 * scale, round(6 * scale), max(round(scale), 1)
    (width, height), baseline = cv2.getTextSize(text, _FONT, size, thickness)
    width, height = width + 2 * pad, height + baseline + 2 * pad
    limits = np.maximum((image.shape[1] - width - 1, image.shape[0] - height - 1), 0)
    beside = np.array((10 * scale, -height / 2))
    wanted = np.clip(anchor, -_FURTHEST, _FURTHEST) + beside
    left, top = np.clip(np.rint(wanted).astype(int), 0, limits).tolist()
    for other in sorted(avoid, key=lambda box: box.top, reverse=True):
        if (abs(other.top - top) <= height
                and left <= other.left + other.width and other.left <= left + width):
            top = max(other.top - height - 1, 0)
    cv2.rectangle(
        image, (left, top), (left + width, top + height), _LABEL_BACKGROUND, cv2.FILLED)
    cv2.rectangle(image, (left, top), (left + pad // 2, top + height), colour, cv2.FILLED)
    cv2.putText(
        image, text, (left + pad, top + height - baseline - pad), _FONT, size, _WHITE, thickness,
        cv2.LINE_AA)
    return Box(left, top, width)
