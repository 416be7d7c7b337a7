"""
Measures what the pose stage finds in frames with known people, for several input sizes.

    python test/benchmarks/pose_accuracy.py FOLDER [--model FILE] [--sizes 256 512 ...]

FOLDER holds gt/*.json and images/ as `depth_person evaluate` reads them. For each size: share of
the people found, false people a frame, median error of a shoulder (its name aside), signed error
of the point between the shoulders, and how far all keypoints lean to the left: half of what is
between a frame's keypoints and those of its mirror image, in pixels of the network's input.
A mistake in the half pixels of a resize or a stride shows in the last column at once.
"""
from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from depth_person.pose.networks import open_network
from depth_person.pose.options import PoseOptions
from depth_person.pose.skeleton import COCO17_ROWS, Keypoint
from depth_person.pose.store import DEFAULT_MODEL

#: COCO-18 rows that COCO-17 has too, and the row that each becomes in a mirror.
MARKED = np.flatnonzero(COCO17_ROWS >= 0)
MIRRORED = [0, 1, 5, 6, 7, 2, 3, 4, 11, 12, 13, 8, 9, 10, 15, 14, 17, 16]
SHOULDERS = [Keypoint.R_SHOULDER, Keypoint.L_SHOULDER]
#: A person is found where the median keypoint is nearer than this, over the person's height.
NEAR = 0.25


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('folder', type=Path)
    parser.add_argument('--sizes', type=int, nargs='+', default=[256, 384, 512, 640, 1280])
    parser.add_argument('--every', type=int, default=1, help='take each so many frames')
    parser.add_argument('--model', default=DEFAULT_MODEL, help='default %(default)s')
    parser.add_argument('--min-score', type=float, default=PoseOptions.min_score)
    args = parser.parse_args()
    frames = [json.loads(path.read_text())
              for path in sorted((args.folder / 'gt').glob('*.json'))[::args.every]]
    print(f'{len(frames)} frames, {sum(len(frame["persons"]) for frame in frames)} people')
    print(' size  found  false  error px  signed u, v px  leaning')
    for size in args.sizes:
        print(measure(args.folder, frames, PoseOptions(
            model=args.model, input_size=size, min_score=args.min_score)), flush=True)


def measure(folder: Path, frames: list[dict[str, Any]], options: PoseOptions) -> str:
    """Return the line of the table for one network and input size."""
    network, size = open_network(options), options.input_size
    people = false = 0
    errors, signed, leaning = [], [], []
    for frame in frames:
        image = cv2.imread(str(folder / frame['image']))
        mirror = network(np.ascontiguousarray(image[:, ::-1]))[:, MIRRORED]
        mirror[..., 0] = image.shape[1] - 1 - mirror[..., 0]
        found = network(image)
        truths = [truth_of(person) for person in frame['persons']]
        rows, mirror_rows = matched(found, truths), matched(mirror, truths)
        people += len(truths)
        false += len(found) - len(rows)
        for index, row in rows.items():
            apart = found[row, SHOULDERS, :2] - truths[index][SHOULDERS]
            swapped = found[row, SHOULDERS, :2] - truths[index][SHOULDERS[::-1]]
            errors.append(min(np.hypot(*offsets.T).mean() for offsets in (apart, swapped)))
            signed.append(apart.mean(0))
            if index in mirror_rows:
                difference = found[row, :, 0] - mirror[mirror_rows[index], :, 0]
                leaning.append(difference / 2 * size / max(image.shape))
    u, v = np.nanmedian(signed, 0)
    return (f'{size:5d} {len(errors) / people:6.1%} {false / len(frames):6.2f} '
            f'{np.nanmedian(errors):9.2f} {u:+8.2f} {v:+6.2f} {np.nanmedian(leaning):+8.2f}')


def truth_of(person: dict[str, Any]) -> NDArray[np.float64]:
    """Return (18, 2) true keypoints; NaN outside the image, and for the neck."""
    truth = np.full((18, 2), np.nan)
    keypoints = np.array(person['keypoints_px'], float)
    keypoints[keypoints[:, 2] == 0] = np.nan
    truth[MARKED] = keypoints[COCO17_ROWS[MARKED], :2]
    return truth


def matched(
    found: NDArray[np.float32], truths: list[NDArray[np.float64]],
) -> dict[int, int]:
    """Return true person -> found person, each of either at most once, nearest first."""
    near = []
    for index, truth in enumerate(truths):
        height = np.nanmax(truth[:, 1]) - np.nanmin(truth[:, 1])
        for row, keypoints in enumerate(found):
            apart = np.hypot(*(keypoints[:, :2] - truth).T) / height
            if np.isfinite(apart).sum() > 1:
                near.append((np.nanmedian(apart), index, row))
    pairs: dict[int, int] = {}
    for distance, index, row in sorted(near):
        if distance < NEAR and index not in pairs and row not in pairs.values():
            pairs[index] = row
    return pairs


if __name__ == '__main__':
    main()
