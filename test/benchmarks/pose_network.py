"""
Measures what a frame costs in the pose stage: the network alone, and all around it.

    python test/benchmarks/pose_network.py [--runs 30]

Runs of the different settings are interleaved, so that other load falls on all alike. CPU is the
processor time of a frame, with a pause after it as a camera leaves one.
"""
from __future__ import annotations

import argparse
from collections.abc import Callable
import time

import numpy as np
from numpy.typing import NDArray
import onnxruntime

from depth_person.camera.frame import Frame
from depth_person.pose.pipeline import PoseEstimator, PoseOptions
from depth_person.pose.store import model_path

PAUSE_S = 0.02
SETTINGS = [
    ('movenet-lightning', 192), ('movenet-thunder', 256), ('movenet-multipose', 256),
    ('movenet-multipose', 384), ('movenet-multipose', 512), ('movenet-multipose', 640),
    ('movenet-multipose', 1280)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--runs', type=int, default=30)
    runs = parser.parse_args().runs
    frame = Frame(
        np.random.default_rng(1).integers(0, 255, (720, 1280, 3), np.uint8), stamp_ns=0,
        frame_id='camera_optical_frame')
    estimators = {
        f'{model} {size}': PoseEstimator(
            PoseOptions(model=model, input_size=max(size, 256), refiner='none'))
        for model, size in SETTINGS}
    network: dict[str, list[float]] = {name: [] for name in estimators}

    def step(name: str) -> Callable[[], None]:
        def estimate() -> None:
            estimators[name].estimate(frame)
            network[name].append(estimators[name].inference_s)
        return estimate

    print(f'{"1280x720 frame":24}   all ms   least   network ms   CPU ms')
    for name, (wall, cpu) in interleaved({name: step(name) for name in estimators}, runs).items():
        print(f'{name:24} {np.median(wall):8.1f} {np.min(wall):7.1f} '
              f'{1e3 * np.median(network[name]):12.1f} {np.median(cpu):8.1f}')

    image = np.zeros((1, 288, 512, 3), np.uint8)
    waits = {
        f'threads that {word}': spinning(spin, image)
        for word, spin in (('sleep', '0'), ('spin', '1'))}
    print(f'\n{"multipose 512x288":24} network ms   least   CPU ms')
    for name, (wall, cpu) in interleaved(waits, runs).items():
        print(f'{name:24} {np.median(wall):10.1f} {np.min(wall):7.1f} {np.median(cpu):8.1f}')


def spinning(spin: str, image: NDArray[np.uint8]) -> Callable[[], None]:
    """Return a run of the network whose threads spin while they wait, or do not."""
    options = onnxruntime.SessionOptions()
    options.add_session_config_entry('session.intra_op.allow_spinning', spin)
    session = onnxruntime.InferenceSession(model_path('movenet-multipose'), options)
    return lambda: session.run(None, {'image': image})


def interleaved(
    steps: dict[str, Callable[[], object]], runs: int,
) -> dict[str, tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Return for each step its wall and CPU milliseconds, run by run."""
    times: dict[str, list[tuple[float, float]]] = {name: [] for name in steps}
    for step in steps.values():  # the first run allocates
        step()
    for _ in range(runs):
        for name, step in steps.items():
            cpu, wall = time.process_time(), time.perf_counter()
            step()
            wall = time.perf_counter() - wall
            time.sleep(PAUSE_S)
            times[name].append((1e3 * wall, 1e3 * (time.process_time() - cpu)))
    return {name: tuple(np.array(values).T) for name, values in times.items()}


if __name__ == '__main__':
    main()
