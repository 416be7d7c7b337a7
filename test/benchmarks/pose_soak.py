"""
Latency with a camera that is faster than the pose stage, then memory and ids over minutes.

    .venv/bin/python test/benchmarks/pose_soak.py [--minutes 10] [--fps 60]
        [--data FOLDER --people 1]

The camera plays the demo's scene forwards and backwards, so that nobody ever jumps, and leaves
each frame in the mailbox that pose_node has. With FOLDER, a data set as pose_two_speed.py takes
it, it shows so many people side by side who sway. Latency is from the frame's stamp to its
keypoints; a frame waits at most for the one before it. The demo's three people should keep three
ids: whoever is out of sight for more than two seconds, or is found anew, gets another.
"""
from __future__ import annotations

import argparse
from pathlib import Path
import threading
import time

import numpy as np
from pose_two_speed import frames_of, people_of

from depth_person.camera.frame import Frame
from depth_person.camera.sources import open_source
from depth_person.nodes.worker import Mailbox, Worker
from depth_person.pose.options import PoseOptions
from depth_person.pose.pipeline import PoseEstimator

SCENE = Path(__file__).parents[2] / 'demo' / 'walk'
SCENE_NS = 1_000_000_000 // 12
LATENCY_S = 20.0
REPORT_S = 30.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--minutes', type=float, default=10.0)
    parser.add_argument('--fps', type=float, default=60.0)
    parser.add_argument('--data', type=Path)
    parser.add_argument('--people', type=int, default=1)
    args = parser.parse_args()
    if args.data:
        frames = list(frames_of(list(people_of(args.data)), args.people))
    else:
        with open_source(str(SCENE)) as source:
            frames = list(iter(source.read, None))
    frames += frames[-2:0:-1]
    report_latency(frames, args.fps)
    report_soak(frames, args.minutes)


def report_latency(frames: list[Frame], fps: float) -> None:
    """Print how old frames are when their keypoints are there, and how many were dropped."""
    stage = PoseEstimator(PoseOptions())
    stage.estimate(frames[0])
    mailbox: Mailbox[tuple[float, Frame]] = Mailbox()
    latencies: list[float] = []
    took: list[float] = []

    def estimate(_: threading.Event) -> None:
        while (item := mailbox.take()) is not None:
            start = time.perf_counter()
            stage.estimate(item[1])
            end = time.perf_counter()
            latencies.append(end - item[0])
            took.append(end - start)

    worker = Worker('pose', estimate)
    worker.start()
    dropped, sent, begin = 0, 0, time.perf_counter()
    while (now := time.perf_counter()) < begin + LATENCY_S:
        image = frames[sent % len(frames)].image
        stamp_ns = frames[0].stamp_ns + 1 + round((now - begin) * 1e9)
        dropped += mailbox.put((now, Frame(image, stamp_ns, 'camera_optical_frame')))
        sent += 1
        time.sleep(max(begin + sent / fps - time.perf_counter(), 0.0))
    mailbox.close()
    worker.stop()
    if worker.failure is not None:
        raise worker.failure
    waits = np.array(latencies[1:]) - np.array(took[1:]) - np.array(took[:-1])
    median, late = 1e3 * np.percentile(latencies, [50, 99])
    print(f'{sent} frames at {fps:g} a second: {len(latencies)} taken, {dropped} dropped')
    print(f'latency: median {median:.1f} ms, 99th percentile {late:.1f} ms; '
          f'a frame took {1e3 * np.median(took):.1f} ms, 99th {1e3 * np.percentile(took, 99):.1f}')
    print(f'waited longer than the frame before took: {(waits > 1e-3).mean():.1%} of frames')


def report_soak(frames: list[Frame], minutes: float) -> None:
    """Print memory and ids as time goes on."""
    stage = PoseEstimator(PoseOptions())
    ids: set[int] = set()
    count, begin = 0, time.perf_counter()
    report = begin
    print(f'{"s":>6}{"frames":>9}{"memory MB":>11}{"ids so far":>12}{"in view":>9}')
    while (now := time.perf_counter()) < begin + 60 * minutes:
        image = frames[count % len(frames)].image
        people = stage.estimate(Frame(image, count * SCENE_NS, 'camera_optical_frame'))
        ids.update(people.track_ids.tolist())
        count += 1
        if now >= report:
            print(f'{now - begin:6.0f}{count:9d}{memory_mb():11.1f}{len(ids):12d}'
                  f'{len(people):9d}', flush=True)
            report += REPORT_S
    print(f'{count} frames, {count / len(frames):.1f} times through the scene: {len(ids)} ids')


def memory_mb() -> float:
    """Return the resident memory of this process."""
    pages = int(Path('/proc/self/statm').read_text().split()[1])
    return pages * 4096 / 1e6


if __name__ == '__main__':
    main()
