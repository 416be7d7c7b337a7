"""
Measures threads and precisions of the pose networks: time, and with --accuracy what they find.

    python test/benchmarks/pose_variants.py FOLDER [--runs 20] [--accuracy] [--every 2]
        [--provider openvino]

FOLDER holds gt/*.json and images/ as `depth_person evaluate` reads them; its images calibrate
int8. The network for many people runs at 512x288, the one for a crop on four crops at once. Runs
of all variants are interleaved, so that other load falls on all alike; ratios are to the variant
fp32 with as many threads as cores, on the CPU. A provider adds all precisions on it. What is
found is measured as pose_accuracy.py does, for one pass of the network for many people.
"""
from __future__ import annotations

import argparse
from collections.abc import Callable
import json
from pathlib import Path
import tempfile

import numpy as np
from pose_accuracy import measure
from pose_network import interleaved

from depth_person.pose.image_tensor import Pixels
from depth_person.pose.options import PoseOptions
from depth_person.pose.precision import convert_precision
from depth_person.pose.runtime import open_session, PROVIDERS
from depth_person.pose.store import model_path

INPUTS = {'movenet-multipose': (1, 288, 512, 3), 'movenet-thunder': (4, 256, 256, 3)}
#: Variant -> precision, threads.
VARIANTS = {
    'fp32': ('fp32', 0), 'fp32, 1 thread': ('fp32', 1), 'fp32, 2 threads': ('fp32', 2),
    'fp16': ('fp16', 0), 'int8': ('int8', 0), 'int8, 1 thread': ('int8', 1)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('folder', type=Path)
    parser.add_argument('--runs', type=int, default=20)
    parser.add_argument('--accuracy', action='store_true')
    parser.add_argument('--every', type=int, default=1, help='take each so many frames')
    parser.add_argument('--provider', choices=tuple(PROVIDERS)[1:])
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        files = {model: variants(model, args.folder / 'images', Path(folder))
                 for model in INPUTS}
        for model in INPUTS:
            print_times(model, files[model], args.runs, args.provider)
        if args.accuracy:
            print_accuracy(files['movenet-multipose'], args.folder, args.every)


def variants(model: str, images: Path, folder: Path) -> dict[str, Path]:
    """Return the files of a network, by precision."""
    files = {'fp32': model_path(model)}
    for precision in ('fp16', 'int8'):
        files[precision] = folder / f'{model}-{precision}.onnx'
        convert_precision(
            files['fp32'], files[precision], precision=precision, images=images,
            pixels=Pixels('rgb', 'bytes'))
    return files


def print_times(
    model: str, files: dict[str, Path], runs: int, provider: str | None,
) -> None:
    shape = INPUTS[model]
    image = np.random.default_rng(1).integers(0, 255, shape, np.uint8)

    def run(precision: str, threads: int, on: str = 'cpu') -> Callable[[], object]:
        session = open_session(files[precision], threads=threads, provider=on)
        return lambda: session.run(None, {'image': image})

    runners = {name: run(*variant) for name, variant in VARIANTS.items()}
    if provider is not None:
        runners |= {f'{precision}, {provider}': run(precision, 0, provider) for precision in files}
    times = interleaved(runners, runs)
    fp32 = np.median(times['fp32'][0])
    print(f'{model} {shape}: median ms, least, CPU ms, ratio')
    for name, (wall, cpu) in times.items():
        print(f'  {name:16} {np.median(wall):7.1f} {np.min(wall):7.1f} {np.median(cpu):7.1f} '
              f'{np.median(wall) / fp32:5.2f}', flush=True)


def print_accuracy(files: dict[str, Path], folder: Path, every: int) -> None:
    frames = [json.loads(path.read_text())
              for path in sorted((folder / 'gt').glob('*.json'))[::every]]
    print('           size  found  false  error px  signed u, v px  leaning')
    for precision, path in files.items():
        print(f'  {precision:8}', measure(folder, frames, PoseOptions(model=str(path))),
              flush=True)


if __name__ == '__main__':
    main()
