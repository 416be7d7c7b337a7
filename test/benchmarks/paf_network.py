"""
Measures a network of OpenPose's kind: people found, shoulder error, and what joining them costs.

    python test/benchmarks/paf_network.py FOLDER --model FILE [--sizes 512 768 1024]

FOLDER holds gt/*.json and images/ as `depth_person evaluate` reads them, FILE is the ONNX
network. Columns as in pose_accuracy.py; then the median time of a frame in the network, and of
all around it (fitting the image, peaks, joining), over the network's. The last lines give the
distance between the shoulders, and of the neck from their midpoint, over the true distance of
the shoulders: what the network's convention is, on people who face the camera.
"""
from __future__ import annotations

import argparse
import json
from pathlib import Path
import time
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from pose_accuracy import matched, measure, SHOULDERS, truth_of

from depth_person.pose.networks import open_network
from depth_person.pose.options import PoseOptions
from depth_person.pose.skeleton import Keypoint

#: Who is turned by less faces the camera, degrees.
FACING_DEG = 20


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('folder', type=Path)
    parser.add_argument('--model', required=True)
    parser.add_argument('--sizes', type=int, nargs='+', default=[512, 768, 1024])
    parser.add_argument('--min-score', type=float, default=PoseOptions.min_score)
    parser.add_argument('--every', type=int, default=1, help='take each so many frames')
    args = parser.parse_args()
    frames = [json.loads(path.read_text())
              for path in sorted((args.folder / 'gt').glob('*.json'))[::args.every]]
    print(' size  found  false  error px  signed u, v px  leaning   network ms   around')
    for size in args.sizes:
        options = PoseOptions(model=args.model, input_size=size, min_score=args.min_score)
        print(measure(args.folder, frames, options), cost(args.folder, frames, options),
              flush=True)
    widths, drops, across = np.array(convention(args.folder, frames, options)).T
    print(f'at {size}, {len(widths)} people who face the camera, over the true distance of the '
          f'shoulders: shoulders {np.median(widths):.3f} apart, neck {np.median(drops):+.3f} '
          f'below and {np.median(across):+.3f} right of their midpoint, spread '
          f'{np.std(drops):.3f} and {np.std(across):.3f}')


def cost(folder: Path, frames: list[dict[str, Any]], options: PoseOptions) -> str:
    """Return the median milliseconds of the network, and of what is around it over that."""
    network = open_network(options)
    times = []
    for frame in frames[::4]:
        image = cv2.imread(str(folder / frame['image']))
        started = time.perf_counter()
        network(image)
        whole = time.perf_counter() - started
        times.append((network.inference_s, whole - network.inference_s))
    inside, around = np.median(times[1:], axis=0)  # the first run allocates
    return f'{1e3 * inside:12.1f} {around / inside:8.2f}'


def convention(
    folder: Path, frames: list[dict[str, Any]], options: PoseOptions,
) -> list[NDArray[np.float64]]:
    """Return for each person who faces the camera the figures of the last line."""
    network, figures = open_network(options), []
    for frame in frames:
        truths = [truth_of(person) for person in frame['persons']]
        found = network(cv2.imread(str(folder / frame['image'])))
        for index, row in matched(found, truths).items():
            yaw = frame['persons'][index].get('yaw_deg')
            if yaw is None or abs((yaw + 180) % 360 - 180) > FACING_DEG:
                continue
            width = np.hypot(*np.diff(truths[index][SHOULDERS], axis=0)[0])
            shoulders = found[row, SHOULDERS, :2]
            neck = found[row, Keypoint.NECK, :2] - shoulders.mean(0)
            marked = np.hypot(*np.diff(shoulders, axis=0)[0])
            if np.isfinite([*neck, marked, width]).all():
                figures.append(np.array([marked, neck[1], neck[0]]) / width)
    return figures


if __name__ == '__main__':
    main()
