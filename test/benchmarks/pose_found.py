"""
Who is found, and how far off the shoulders are, over their width: by distance and scenario.

    .venv/bin/python test/benchmarks/pose_found.py FOLDER [--refiner NAME]

FOLDER holds stills with `keypoints_cam_m` as `depth_person evaluate` reads them; each is a stream
of its own to the pose stage. The error is the mean of both shoulders, left and right exchanged
if that is nearer, over the distance between the true shoulders in space, seen at the neck's depth.
"""
from __future__ import annotations

import argparse
from dataclasses import dataclass
import json
from pathlib import Path

import numpy as np

from depth_person.pose.options import PoseOptions
from depth_person.pose.pipeline import PoseEstimator
from depth_person.pose.skeleton import Keypoint
from depth_person.replay.dataset import TrueFrame
from depth_person.replay.keypoints import NetworkKeypoints
from depth_person.replay.reading import read_dataset

SHOULDERS = [Keypoint.L_SHOULDER, Keypoint.R_SHOULDER]
FACING_DEG = 30
#: What is kept back of a true range, so that someone at 10 m is counted as "to 10 m".
SLACK_M = 0.1


@dataclass(frozen=True)
class Looked:
    """One true person: what the data say of it, and the error over the shoulders' width."""

    scenario: str
    range_m: float
    whole: bool
    facing: bool
    found: bool
    error: float


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('folder', type=Path)
    parser.add_argument('--refiner', default=PoseOptions.refiner)
    args = parser.parse_args()
    source = NetworkKeypoints(PoseEstimator(PoseOptions(refiner=args.refiner)))
    looked, false = [], 0
    for clip in read_dataset(args.folder).clips:
        if len(clip) > 1:
            continue
        source.start_clip()
        for frame in clip:
            people, strangers = look(source, frame)
            looked += people
            false += strangers
    hidden = [each for each in looked if each.scenario in ('occl_lower', 'occl_side')]
    whole = [each for each in looked if each.whole]
    near = [each for each in whole if each.range_m <= 10]
    print(f'{"":28}{"n":>5}{"found":>8}{"shoulders":>11}')
    show('unoccluded to 10 m', near)
    show('unoccluded, 10 to 15 m', [each for each in whole if 10 < each.range_m <= 15])
    show('unoccluded, beyond 15 m', [each for each in whole if each.range_m > 15])
    show('half hidden to 10 m', [each for each in hidden if each.range_m <= 10])
    show('head only to 5 m', [
        each for each in looked if each.scenario == 'head_only' and each.range_m <= 5])
    show('facing to 10 m', [each for each in near if each.facing])
    for scenario in dict.fromkeys(each.scenario for each in looked):
        show(scenario, [each for each in looked if each.scenario == scenario])
    print(f'found who are nobody: {false}')


def look(source: NetworkKeypoints, frame: TrueFrame) -> tuple[list[Looked], int]:
    """Return the true people of a still, and how many others were found."""
    people = source.people(frame)
    rows = source.match(frame, people)
    assert frame.image is not None
    truth_file = frame.image.parents[1] / 'gt' / f'{frame.image.stem}.json'
    by_id = {each['id']: each for each in json.loads(truth_file.read_text())['persons']}
    looked = []
    for person, row in zip(frame.people, rows, strict=True):
        error = np.nan
        if row >= 0 and person.keypoints is not None:
            left, right = np.array(by_id[person.id]['keypoints_cam_m'])[5:7]
            width = np.linalg.norm(left - right) * frame.intrinsics.fx / person.depth
            found, true = people.keypoints[row, SHOULDERS, :2], person.keypoints[5:7, :2]
            error = min(np.linalg.norm(found - each, axis=1).mean()
                        for each in (true, true[::-1])) / width
        visible = person.visible_fraction
        turned = 180.0 if person.yaw_deg is None else abs((person.yaw_deg + 180) % 360 - 180)
        looked.append(Looked(
            frame.scenario, person.range - SLACK_M, visible is None or visible >= 0.95,
            turned <= FACING_DEG, bool(row >= 0), float(error)))
    return looked, len(people) - int((rows >= 0).sum())


def show(name: str, looked: list[Looked]) -> None:
    """Print one line of the table."""
    errors = np.array([each.error for each in looked])
    errors = errors[np.isfinite(errors)]
    error = f'{np.median(errors):10.1%}' if len(errors) else '-'
    found = f'{np.mean([each.found for each in looked]):8.1%}' if looked else '-'
    print(f'{name:28}{len(looked):5}{found:>8}{error:>11}')


if __name__ == '__main__':
    main()
