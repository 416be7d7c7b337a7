"""
Frames a second of the pose stage with 0 to 20 people, against bare networks and MediaPipe.

    .venv/bin/python test/benchmarks/pose_two_speed.py FOLDER [--rounds 3]
        [--mediapipe-python PYTHON]

FOLDER is a data set that `depth_person evaluate` reads, of 1280x720 images with people who are not
hidden (the scenarios distance, yaw and tilt): their pictures are pasted side by side into frames,
and wander by a pixel a frame, with the stamps of a camera of 60 frames a second. For each number
of people: the stage as a whole, and the bare networks run on as many crops and on the same looks,
one after the other (the stage takes some looks beside crops), by turns, so that other load falls
on both alike. The work of each frame is the same in every round, and its least time counts. PYTHON
is an environment of its own with mediapipe==0.10.14, numpy<2 and opencv-contrib-python<4.12:
BlazePose full then runs on the same frames in a process of its own, by turns, too.
"""
from __future__ import annotations

import argparse
from collections.abc import Iterator
import json
from pathlib import Path
import subprocess
import sys
import tempfile
import time
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from depth_person.camera.frame import Frame
from depth_person.pose import schedule
from depth_person.pose.looks import Look
from depth_person.pose.movenet import INPUT, Letterbox, SIDE_STEP
from depth_person.pose.options import PoseOptions
from depth_person.pose.pipeline import PoseEstimator
from depth_person.pose.runtime import open_session
from depth_person.pose.store import model_path

PEOPLE = (0, 1, 3, 8, 20)
WIDTH, HEIGHT = 1280, 720
FRAMES = 31
FRAME_NS = 1_000_000_000 // 60
SCENARIOS = ('distance', 'yaw', 'tilt')
#: How high their pictures are, pixels: of a few, whom BlazePose sees only when they are near, of
#: more in one row, and in two.
FEW, ONE_ROW, TWO_ROWS = 660, 330, 250

BLAZEPOSE = """
import sys, time
import cv2, mediapipe
frames = [cv2.cvtColor(cv2.imread(name), cv2.COLOR_BGR2RGB) for name in sys.argv[1:]]
pose = mediapipe.solutions.pose.Pose(model_complexity=1)
for frame in frames[:3]:
    pose.process(frame)
for frame in frames:
    start = time.perf_counter()
    found = pose.process(frame).pose_landmarks is not None
    print(time.perf_counter() - start, int(found))
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('folder', type=Path)
    parser.add_argument('--rounds', type=int, default=3)
    parser.add_argument('--mediapipe-python', type=Path)
    args = parser.parse_args()
    cutouts = list(people_of(args.folder))
    print(f'{"people":>6}{"found":>7}{"frame ms":>10}{"frames/s":>10}{"bare ms":>9}'
          f'{"ratio":>7}{"inside":>8}{"BlazePose ms":>14}{"found":>7}{"its rate":>10}')
    for n in PEOPLE:
        frames = list(frames_of(cutouts, n))
        rounds, blazepose_found = [], np.nan
        for _ in range(args.rounds):
            whole, network, found, looks = run_stage(frames)
            rounds.append([whole, network, run_bare(frames, n, looks)])
            if args.mediapipe_python:
                blazepose, blazepose_found = run_blazepose(args.mediapipe_python, frames)
                rounds[-1].append(blazepose[1:])
        kinds = [np.min(kind, axis=0).mean() for kind in zip(*rounds, strict=True)]
        whole_s, network_s, bare_s, blazepose_s = [*kinds, np.nan][:4]
        print(f'{n:6d}{found:7.1f}{1e3 * whole_s:10.1f}{1 / whole_s:10.1f}{1e3 * bare_s:9.1f}'
              f'{whole_s / bare_s:7.2f}{whole_s / network_s:8.2f}{1e3 * blazepose_s:14.1f}'
              f'{blazepose_found:7.0%}{blazepose_s / whole_s:9.2f}x', flush=True)


def people_of(folder: Path) -> Iterator[NDArray[np.uint8]]:
    """Yield pictures of one person each, with a little of what is around."""
    for path in sorted((folder / 'gt').glob('*.json')):
        frame = json.loads(path.read_text())
        if frame['scenario'] not in SCENARIOS or len(frame['persons']) != 1:
            continue
        x0, y0, x1, y1 = frame['persons'][0]['bbox_full']
        margin = 0.15 * (y1 - y0)
        if y1 - y0 < 150 or y0 < margin or y1 + margin > frame['height']:
            continue
        image = cv2.imread(str(folder / frame['image']))
        left, top = max(int(x0 - margin), 0), int(y0 - margin)
        yield image[top:int(y1 + margin), left:int(x1 + margin)]


def frames_of(cutouts: list[NDArray[np.uint8]], n: int) -> Iterator[Frame]:
    """Yield frames with n people side by side, in two rows where they are many."""
    columns = n if n <= 8 else (n + 1) // 2
    height = FEW if n <= 3 else ONE_ROW if n <= 8 else TWO_ROWS
    for index in range(FRAMES):
        image = np.full((HEIGHT, WIDTH, 3), 110, np.uint8)
        for person in range(n):
            cutout = cutouts[person % len(cutouts)]
            scale = min(height / cutout.shape[0], (WIDTH - 60) / columns / cutout.shape[1])
            small = cv2.resize(cutout, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
            row, column = divmod(person, columns)
            x, y = 10 + index + column * (WIDTH - 60) // columns, 30 + row * (height + 40)
            image[y:y + small.shape[0], x:x + small.shape[1]] = small
        yield Frame(image, index * FRAME_NS, 'camera_optical_frame')


def run_stage(
    frames: list[Frame],
) -> tuple[NDArray[np.float64], NDArray[np.float64], float, list[list[Look]]]:
    """
    Return seconds of each frame, of the networks in it, people found, and the looks taken.

    The first frame of a stream, which gets every look, is left out.
    """
    stage = PoseEstimator(PoseOptions())
    looks: list[list[Look]] = []
    due = schedule.Schedule.looks

    def noted(self: schedule.Schedule, *args: Any, **options: Any) -> list[Look]:
        taken = due(self, *args, **options)
        looks.append(taken)
        return taken

    stage.estimate(frames[0])
    schedule.Schedule.looks = noted  # type: ignore[method-assign]
    whole, network, found = [], [], 0
    for frame in frames[1:]:
        start = time.perf_counter()
        found += len(stage.estimate(frame))
        whole.append(time.perf_counter() - start)
        network.append(stage.inference_s)
    schedule.Schedule.looks = due  # type: ignore[method-assign]
    return np.array(whole), np.array(network), found / len(whole), looks


def run_bare(
    frames: list[Frame], n: int, looks: list[list[Look]],
) -> NDArray[np.float64]:
    """Return the seconds of each frame that the networks take for n crops and the same looks."""
    options = PoseOptions()
    detector, refiner = (
        open_session(model_path(name)) for name in (options.model, options.refiner))
    side = refiner.get_inputs()[0].shape[1]
    crops = np.ascontiguousarray(
        np.stack([cv2.resize(frames[0].image, (side, side))] * max(n, 1)))
    inputs = [
        [Letterbox(look.input_side, step=SIDE_STEP).fill(look.part(frames[0].image))
         for look in taken] for taken in looks]
    took = []
    for images in [max(inputs, key=len), *inputs]:  # the first run allocates
        start = time.perf_counter()
        if n:
            refiner.run(None, {INPUT: crops})
        for image in images:
            detector.run(None, {INPUT: image})
        took.append(time.perf_counter() - start)
    return np.array(took[1:])


def run_blazepose(
    python: Path, frames: list[Frame],
) -> tuple[NDArray[np.float64], float]:
    """Return the seconds of each frame in MediaPipe Pose, and in how many it found someone."""
    with tempfile.TemporaryDirectory() as folder:
        names = [f'{folder}/{index:03}.png' for index in range(len(frames))]
        for name, frame in zip(names, frames, strict=True):
            cv2.imwrite(name, frame.image)
        run = subprocess.run(
            [python, '-c', BLAZEPOSE, *names], capture_output=True, text=True, check=False)
    if run.returncode != 0:
        sys.exit(f'MediaPipe failed: {run.stderr[-2000:]}')
    seconds, found = np.array(run.stdout.split(), float).reshape(-1, 2).T
    return seconds, found.mean()


if __name__ == '__main__':
    main()
