"""Measures errors on a folder of frames with known distances."""
from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from dataclasses import replace
import json
import math
from pathlib import Path
import sys
from typing import Any

from tqdm import tqdm

from depth_person.distance.attitude import level_gravity
from depth_person.distance.estimator import Body, Mounting
from depth_person.distance.estimators import ESTIMATORS, make_estimator
from depth_person.distance.following import FilterOptions
from depth_person.distance.scale import body_spread
from depth_person.errors import DepthPersonError
from depth_person.files import write_text
from depth_person.replay.dataset import Fault
from depth_person.replay.evaluate import Evaluation, Sample
from depth_person.replay.keypoints import (
    HIDDEN,
    KeypointSource,
    NetworkKeypoints,
    RecordedKeypoints,
    TrueKeypoints,
)
from depth_person.replay.metrics import summarise
from depth_person.replay.reading import read_dataset
from depth_person.settings.inputs import InputSettings
from depth_person.verbs.numbers import at_least, positive

#: Column heading -> the figure under it and how it is printed.
_COLUMNS = {
    'n': ('n', '{:d}'), 'found': ('found', '{:.0%}'), 'range': ('with_range', '{:.0%}'),
    'median m': ('median_abs', '{:.2f}'), 'mean m': ('mean_abs', '{:.2f}'),
    'median %': ('median_rel', '{:.1%}'), 'rmse m': ('rmse', '{:.2f}'),
    'bias m': ('bias', '{:+.2f}'), '1 sigma': ('coverage_1', '{:.0%}'),
    '2 sigma': ('coverage_2', '{:.0%}'), 'r': ('pearson_r', '{:.3f}'),
    'shoulders': ('median_shoulder_error_px', '{:.1f} px'),
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's arguments."""
    parser.add_argument(
        'folder', type=Path, metavar='FOLDER',
        help='gt/ beside images/, seq/NAME/ of the same, or a JSON file of recorded keypoints')
    parser.add_argument(
        '--estimator', choices=ESTIMATORS, default=ESTIMATORS[0], help='default %(default)s')
    parser.add_argument(
        '--keypoints', choices=('network', 'truth', 'recorded'), default='network',
        help='where keypoints come from (default %(default)s)')
    parser.add_argument(
        '--noise', type=at_least(0.0), default=0.0, metavar='PX',
        help='standard deviation added to true keypoints (default 0)')
    parser.add_argument('--seed', type=int, default=0, help='of that noise (default 0)')
    parser.add_argument(
        '--hidden', choices=tuple(HIDDEN), default='own-body',
        help='which hidden keypoints --keypoints truth gives: none, those behind the own body as '
             'networks do, or all (default %(default)s)')
    parser.add_argument(
        '--measured-neck', action='store_true',
        help='let --keypoints truth mark the neck itself, where it is known')
    parser.add_argument(
        '--mounting', choices=('none', 'truth', 'fixed'), default='none',
        help="whether the estimator is told the camera's attitude and height: not at all, those "
             'of each frame, or the fixed ones given by --camera-height and --camera-pitch')
    parser.add_argument(
        '--camera-height', type=positive, metavar='M',
        help='above the ground that people stand on, for --mounting fixed')
    parser.add_argument(
        '--camera-pitch', type=float, metavar='DEG',
        help='how far the camera looks down, for --mounting fixed (default 0)')
    parser.add_argument(
        '--attitude-sigma', type=positive, metavar='DEG',
        help=f'how surely, for --mounting fixed (default {InputSettings().attitude_sigma:g})')
    parser.add_argument(
        '--filter', action='store_true',
        help='follow people through sequences: errors are of the ranges over time, also of who is '
             'hidden and predicted')
    parser.add_argument(
        '--shoulder-width', type=float, metavar='M', help='of everyone, metres')
    parser.add_argument('--stature', type=float, metavar='M', help='of everyone, metres')
    parser.add_argument('--children', action='store_true', help='there may be children')
    parser.add_argument(
        '--pose-model', metavar='NAME', help='its network: a name or an ONNX file')
    parser.add_argument(
        '--pose-input-size', type=int, metavar='PX', help='longer side of the image it sees')
    parser.add_argument(
        '--limit', type=at_least(1), metavar='N', help='stop after N stills and sequences')
    parser.add_argument(
        '--json', type=Path, metavar='OUT', help='write every sample and the summary')
    parser.add_argument(
        '--plots', type=Path, metavar='DIR', help='draw the errors as PNG files')


def main(args: argparse.Namespace) -> int:
    """Print the tables; return 1 when a frame could not be used."""
    body = Body(
        shoulder_width=args.shoulder_width, stature=args.stature, children=args.children)
    draw_plots = _plotter() if args.plots else None
    dataset = read_dataset(args.folder)
    evaluation = Evaluation(
        _source(args), make_estimator(args.estimator, body=body),
        mounting=_mounting(args),
        follow=FilterOptions(body_spread=body_spread(args.estimator, body))
        if args.filter else None)
    clips = dataset.clips[:args.limit]
    frames = tqdm(
        evaluation.run(clips), total=sum(map(len, clips)), unit='frame', disable=None)
    samples = [sample for frame in frames for sample in frame]
    faults = [*dataset.faults, *evaluation.faults]
    summary = summarise(samples)
    print('\n'.join(_tables(summary)))
    if args.json:
        _write_json(args.json, args, samples, summary, faults)
    if draw_plots:
        draw_plots(samples, args.plots)
    for line in _complaints(faults):
        print(f'depth_person evaluate: {line}', file=sys.stderr)
    return 1 if faults else 0


def _mounting(args: argparse.Namespace) -> Mounting | None:
    """Return what is told of the camera; None for what each frame says."""
    told = args.camera_height, args.camera_pitch, args.attitude_sigma
    if args.mounting != 'fixed':
        if told != (None, None, None):
            raise DepthPersonError(
                '--camera-height, --camera-pitch and --attitude-sigma go with --mounting fixed')
        return None if args.mounting == 'truth' else Mounting()
    return fixed_mounting(
        args.camera_height, pitch_deg=args.camera_pitch or 0.0,
        attitude_sigma_deg=args.attitude_sigma or InputSettings().attitude_sigma)


def fixed_mounting(
    height: float | None, *, pitch_deg: float, attitude_sigma_deg: float,
) -> Mounting:
    """
    Return what `--mounting fixed` tells of a camera.

    :param height: above the ground that people stand on, metres; None where it is not known.
    :param pitch_deg: how far it looks down, degrees.
    :param attitude_sigma_deg: how surely, degrees.
    """
    return Mounting(
        level_gravity(pitch_down=math.radians(pitch_deg), roll_cw=0.0),
        math.radians(attitude_sigma_deg), height, InputSettings().camera_height_sigma)


def _plotter() -> Callable[[list[Sample], Path], list[Path]]:
    """Return draw_plots; asked for before the work begins, since matplotlib may be missing."""
    from depth_person.replay.plots import draw_plots
    return draw_plots


def _source(args: argparse.Namespace) -> KeypointSource:
    if args.keypoints == 'recorded':
        return RecordedKeypoints()
    if args.keypoints == 'truth':
        return TrueKeypoints(
            noise_px=args.noise, hidden=args.hidden, measure_neck=args.measured_neck,
            seed=args.seed)
    # The network's libraries are loaded only for this source.
    from depth_person.pose.pipeline import PoseEstimator, PoseOptions
    options = PoseOptions()
    if args.pose_model:
        options = replace(options, model=args.pose_model)
    if args.pose_input_size:
        options = replace(options, input_size=args.pose_input_size)
    return NetworkKeypoints(PoseEstimator(options))


def _tables(summary: dict[str, Any]) -> Iterator[str]:
    """Yield the lines of the printed tables."""
    groups = {key.removeprefix('by_'): group
              for key, group in summary.items() if key.startswith('by_')}
    width = max(len(name) for group in [['overall'], *groups.values()] for name in group)
    yield ' ' * width + ''.join(f'{heading:>11}' for heading in _COLUMNS)
    yield _row('overall', summary['overall'], width)
    for title, group in groups.items():
        if group:
            yield f'by {title}'
        for name, figures in group.items():
            yield _row(name, figures, width)
    yield f'people found who are nobody: {summary["false_people"]}'


def _complaints(faults: list[Fault]) -> Iterator[str]:
    """Yield a line for each different fault."""
    files: dict[str, list[str]] = {}
    for fault in faults:
        files.setdefault(fault.message, []).append(fault.file)
    for message, names in files.items():
        more = f' (and {len(names) - 1} more)' if len(names) > 1 else ''
        yield f'left out {names[0]}{more}: {message}'


def _row(name: str, figures: dict[str, Any], width: int) -> str:
    cells = (
        '-' if figures[key] is None else form.format(figures[key])
        for key, form in _COLUMNS.values())
    return f'{name:<{width}}' + ''.join(f'{cell:>11}' for cell in cells)


def _write_json(
    path: Path, args: argparse.Namespace, samples: list[Sample], summary: dict[str, Any],
    faults: list[Fault],
) -> None:
    options = {
        name: str(value) if isinstance(value, Path) else value
        for name, value in vars(args).items() if name not in ('verb', 'json', 'plots')}
    result = {
        'options': options, 'summary': summary,
        'faults': [vars(fault) for fault in faults],
        'samples': [sample.as_json() for sample in samples],
    }
    write_text(path, json.dumps(result, indent=1, allow_nan=False))
