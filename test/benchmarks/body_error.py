"""
How much of the skeleton estimator's error stays with a person, and how much changes.

    python test/benchmarks/body_error.py

Needs the extra `train`. 200 adults of the training population in 12 poses each (standing, walking,
moving their arms) are measured with MoveNet's noise, 5 m away, in three views and with several
parts hidden. "Constant" is the spread of the persons' mean errors, "changing" that of a person's
errors about the mean; both of the logarithm of range.
"""
from __future__ import annotations

import argparse

import numpy as np
from numpy.typing import NDArray

from depth_person.camera.intrinsics import Intrinsics
from depth_person.distance.conventions import CONVENTIONS, place
from depth_person.distance.estimators import make_estimator
from depth_person.distance.training.population import BodyModel
from depth_person.distance.training.poses import KINDS
from depth_person.pose.people import People
from depth_person.pose.skeleton import Keypoint

PEOPLE, POSES = 200, 12
CAMERA = Intrinsics(1280, 720, 900.0, 900.0, 639.5, 359.5)
NECK = np.array([0.0, 0.1, 5.0])
CONVENTION = 'movenet'
UPRIGHT = [list(KINDS).index(kind) for kind in ('stand', 'walk', 'arms')]
VIEWS = {'facing': (-30, 30), 'turned': (60, 120), 'from behind': (150, 210)}
_LEGS = [Keypoint.R_KNEE, Keypoint.L_KNEE, Keypoint.R_ANKLE, Keypoint.L_ANKLE]
HIDDEN = {
    'whole': [], 'without legs': _LEGS, 'above the hips': [*_LEGS, Keypoint.R_HIP, Keypoint.L_HIP],
    'one side': [row for row in Keypoint if row.name.startswith('R_')]}
_FACE = [Keypoint.NOSE, Keypoint.R_EYE, Keypoint.L_EYE]


def seen(
    bodies: NDArray[np.float64], view: str, hidden: str, random: np.random.Generator,
) -> People:
    """Return bodies (n, 18, 3) as the network would mark them."""
    convention, n = CONVENTIONS[CONVENTION], len(bodies)
    marked = place(bodies, np.tile(convention.placement.as_array(), (n, 1)))
    x, y, z = np.moveaxis(marked - bodies[:, [Keypoint.NECK]], -1, 0)
    yaw = np.radians(random.uniform(*VIEWS[view], (n, 1)))
    points = np.stack(
        [np.cos(yaw) * x - np.sin(yaw) * y, -z, np.sin(yaw) * x + np.cos(yaw) * y], -1) + NECK
    scores = np.full((n, 18, 1), convention.usual_score)
    noise = convention.noise_px(scores[..., 0], px_per_m=np.full(n, CAMERA.fx / NECK[2]))
    pixels = CAMERA.project(points) + noise[..., None] * random.normal(0, 1, (n, 18, 2))
    keypoints = np.concatenate([pixels, scores], axis=-1).astype(np.float32)
    keypoints[:, HIDDEN[hidden] + _FACE * (view == 'from behind')] = np.nan
    return People(keypoints, np.arange(n, dtype=np.int32), convention=CONVENTION)


def main() -> None:
    argparse.ArgumentParser(description=__doc__.splitlines()[1]).parse_args()
    random = np.random.default_rng(0)
    estimator = make_estimator('skeleton')
    poses = list(BodyModel(seed=7).repeated(PEOPLE, poses=POSES))
    upright = np.stack([np.isin(pose.kind, UPRIGHT) for pose in poses])
    first = None
    print(f'{"":28}{"constant":>10}{"changing":>10}{"stated":>10}{"correlation":>13}')
    for hidden in HIDDEN:
        for view in VIEWS:
            errors, stated = np.full((2, POSES, PEOPLE), np.nan)
            for row, pose in enumerate(poses):
                found = estimator.estimate(
                    seen(pose.keypoints.astype(float), view, hidden, random), CAMERA)
                errors[row] = np.log(found.range / np.linalg.norm(NECK))
                stated[row] = found.range_sigma / found.range
            errors[~upright], stated[~upright] = np.nan, np.nan
            means = np.nanmean(errors, axis=0)
            changing = np.sqrt(np.nanmean(np.nanvar(errors, axis=0, ddof=1)))
            count = np.isfinite(errors).sum(axis=0).mean()
            constant = np.sqrt(max(means.var() - changing ** 2 / count, 0.0))
            first = means if first is None else first
            print(f'{hidden + ", " + view:28}{constant:10.3f}{changing:10.3f}'
                  f'{np.sqrt(np.nanmean(stated ** 2)):10.3f}'
                  f'{np.corrcoef(first, means)[0, 1]:13.2f}')


if __name__ == '__main__':
    main()
