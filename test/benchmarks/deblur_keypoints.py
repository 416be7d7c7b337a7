"""
Whether Wiener deblurring helps the pose network on motion blur.

    .venv/bin/python test/benchmarks/deblur_keypoints.py FOLDER [--frames 16]

FOLDER is a data set that `depth_person evaluate` reads. Every image is blurred by a known motion
with noise added, then given to the network as it is, deblurred with the very kernel that
blurred it, and deblurred with a kernel that is 20 % too long and 10 degrees off.
"""
from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np

from depth_person.camera.deblur import motion_kernel, wiener_deblur
from depth_person.camera.frame import Frame
from depth_person.distance.estimators import make_estimator
from depth_person.pose.people import People
from depth_person.pose.pipeline import PoseEstimator, PoseOptions
from depth_person.replay.evaluate import Evaluation
from depth_person.replay.keypoints import NetworkKeypoints
from depth_person.replay.metrics import figures
from depth_person.replay.reading import read_dataset

NOISE = 2.0
ANGLE_DEG = 20.0
NOISE_TO_SIGNAL = 0.01


class Prepared:
    """A pose stage that is given images otherwise than they are."""

    def __init__(self, prepare: Callable[[np.ndarray], np.ndarray]) -> None:
        self._prepare = prepare
        self._stage = PoseEstimator(PoseOptions(threads=1))

    def estimate(self, frame: Frame) -> People:
        image = self._prepare(frame.image)
        return self._stage.estimate(
            Frame(image, frame.stamp_ns, frame.frame_id, frame.intrinsics))


def blurred(image: np.ndarray, length: float) -> np.ndarray:
    """Return an image with motion blur and sensor noise, the same for the same image."""
    if length < 1:
        return image
    soft = cv2.filter2D(image, cv2.CV_64F, motion_kernel(length, ANGLE_DEG))
    noise = np.random.default_rng(int(image[::97, ::97].sum())).normal(0, NOISE, image.shape)
    return np.clip(np.rint(soft + noise), 0, 255).astype(np.uint8)


def sharpened(image: np.ndarray, length: float, angle_deg: float) -> np.ndarray:
    """Return an image deblurred for this motion."""
    return wiener_deblur(
        image, motion_kernel(length, angle_deg), noise_to_signal=NOISE_TO_SIGNAL)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('folder', type=Path)
    parser.add_argument('--frames', type=int, default=16)
    args = parser.parse_args()
    stills = [clip for clip in read_dataset(args.folder).clips if len(clip) == 1]
    clips = stills[::max(1, len(stills) // args.frames)][:args.frames]
    print(f'{"blur px":>8} {"image":24}{"found":>8}{"shoulder px":>13}{"range %":>9}')
    for length in (0.0, 8.0, 24.0):
        ways: dict[str, Callable[[np.ndarray], np.ndarray]] = {
            'blurred': lambda image, length=length: blurred(image, length)}
        if length:
            ways['deblurred'] = lambda image, length=length: sharpened(
                blurred(image, length), length, ANGLE_DEG)
            ways['deblurred, kernel off'] = lambda image, length=length: sharpened(
                blurred(image, length), 1.2 * length, ANGLE_DEG + 10)
        for name, prepare in ways.items():
            evaluation = Evaluation(
                NetworkKeypoints(Prepared(prepare)), make_estimator('skeleton'))
            samples = [sample for frame in evaluation.run(clips) for sample in frame]
            told = figures([sample for sample in samples if sample.person is not None])
            print(f'{length:8.0f} {name:24}{told["found"]:8.0%}'
                  f'{told["median_shoulder_error_px"]:13.2f}{100 * told["median_rel"]:9.1f}',
                  flush=True)


if __name__ == '__main__':
    main()
