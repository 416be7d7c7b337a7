"""Which found person is which true one."""
from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from depth_person.pose.people import People
from depth_person.pose.skeleton import COCO17_ROWS
from depth_person.replay.dataset import TruePerson

#: Less alike than this, two people are not the same.
LEAST_SIMILARITY = 0.3

#: The spread of annotators' keypoints relative to a person's size, from the COCO data set.
COCO_SPREAD = np.array([
    .026, .025, .025, .035, .035, .079, .079, .072, .072, .062, .062, .107, .107, .087, .087,
    .089, .089])

#: For each COCO-17 row its row in COCO-18, and that of the keypoint on the other side.
_ROWS = np.argsort(COCO17_ROWS)[1:]
_MIRRORED_ROWS = _ROWS[[0, 2, 1, 4, 3, 6, 5, 8, 7, 10, 9, 12, 11, 14, 13, 16, 15]]


def match_people(truth: Sequence[TruePerson], found: People) -> NDArray[np.intp]:
    """
    Return for each true person the row of the found person that it is; -1 for none.

    The most alike are paired first, each once. Alike by keypoints where the truth has them (COCO's
    object keypoint similarity, left and right as they are or exchanged, since networks confuse
    them), otherwise by how many keypoints lie in the true box, times (1 + u) / 2 with the boxes'
    intersection over union u: a skeleton seen from the side, or of half a person, fills little
    of the person's box.
    """
    matches = np.full(len(truth), -1, np.intp)
    if not (truth and len(found)):
        return matches
    table = np.array([_similarities(person, found) for person in truth])
    while (best := table.max()) >= LEAST_SIMILARITY:
        person, row = np.unravel_index(np.argmax(table), table.shape)
        matches[person] = row
        table[person, :] = table[:, row] = -best - 1
    return matches


def _similarities(person: TruePerson, found: People) -> NDArray[np.float64]:
    """Return how alike each found person (n,) is to a true one, 0 to 1."""
    if person.keypoints is not None:
        return np.maximum(
            _keypoint_similarities(person, found.keypoints[:, _ROWS]),
            _keypoint_similarities(person, found.keypoints[:, _MIRRORED_ROWS]))
    boxed = [_box_similarities(box, found) for box in person.boxes]
    return np.max(boxed, axis=0) if boxed else np.zeros(len(found))


def _keypoint_similarities(
    person: TruePerson, keypoints: NDArray[np.float32],
) -> NDArray[np.float64]:
    """Return the object keypoint similarity of found keypoints (n, 17, 3)."""
    assert person.keypoints is not None
    truth = person.keypoints
    box = person.boxes[0] if len(person.boxes) else _box(truth[:, :2])
    area = max((box[2] - box[0]) * (box[3] - box[1]), 1.0)
    square = ((keypoints[..., :2] - truth[:, :2]) ** 2).sum(axis=-1)
    alike = np.exp(-square / (8 * area * COCO_SPREAD ** 2))
    marked = np.isfinite(alike)
    return np.where(marked, alike, 0.0).sum(axis=1) / np.maximum(marked.sum(axis=1), 1)


def _box_similarities(box: NDArray[np.float64], found: People) -> NDArray[np.float64]:
    """Return how well the skeletons of found people (n,) sit in a box."""
    pixels = found.keypoints[..., :2]
    inside = ((pixels >= box[:2]) & (pixels <= box[2:])).all(axis=-1).sum(axis=1)
    marked = np.isfinite(pixels).all(axis=-1).sum(axis=1)
    return inside / np.maximum(marked, 1) * (1 + _overlaps(box, _boxes(found))) / 2


def _box(pixels: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.concatenate([pixels.min(axis=0), pixels.max(axis=0)])


def _boxes(people: People) -> NDArray[np.float64]:
    """Return the boxes (n, 4) round people's keypoints; NaN for a person without any."""
    pixels = people.keypoints[..., :2].astype(np.float64)
    known = np.isfinite(pixels)
    boxes = np.concatenate([
        np.where(known, pixels, np.inf).min(axis=1),
        np.where(known, pixels, -np.inf).max(axis=1)], axis=1)
    return np.where(np.isfinite(boxes), boxes, np.nan)


def _overlaps(box: NDArray[np.float64], boxes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the intersection over union of one box with each of (n, 4); 0 for a box of NaN."""
    low, high = np.maximum(box[:2], boxes[:, :2]), np.minimum(box[2:], boxes[:, 2:])
    shared = np.maximum(high - low, 0).prod(axis=1)
    union = (box[2:] - box[:2]).prod() + (boxes[:, 2:] - boxes[:, :2]).prod(axis=1) - shared
    return np.nan_to_num(shared / np.maximum(union, 1e-9))
