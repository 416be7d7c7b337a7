"""The verb train: repeat the training of the networks that the package ships."""
from __future__ import annotations

import argparse
from pathlib import Path

from tqdm import tqdm

from depth_person.errors import DepthPersonError
from depth_person.verbs.numbers import at_least


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare `train skeleton` and `train body-dimensions`."""
    networks = parser.add_subparsers(dest='network', required=True, metavar='NETWORK')
    skeleton = networks.add_parser(
        'skeleton', help='the lifter of the estimator skeleton, on bodies of our own making')
    skeleton.add_argument(
        '--out', type=Path, required=True, metavar='DIR',
        help='folder for skeleton.onnx and skeleton.json')
    skeleton.add_argument(
        '--bodies', type=at_least(1), metavar='N', help='people to sample (default 30000)')
    skeleton.add_argument(
        '--epochs', type=at_least(1), metavar='N',
        help='how often each is seen, each time in another view (default 800)')
    skeleton.add_argument('--seed', type=int, metavar='S', help='default 1')
    skeleton.set_defaults(train=_train_skeleton)
    boxes = networks.add_parser(
        'body-dimensions', help='the trees of the estimator body_dimensions, on bodies of our own '
                                'making or on a table of yours')
    boxes.add_argument(
        'data', metavar='DATA',
        help='a CSV file, whose columns msg_docs/body_dimensions.md lists; or the word population')
    boxes.add_argument(
        '--out', type=Path, required=True, metavar='DIR',
        help='folder for body_dimensions_KIND.onnx and .json')
    boxes.add_argument(
        '--model', choices=('paper', 'normalised', 'both'), default='both',
        help='pixels before one camera, angles for any camera, or both (default %(default)s)')
    boxes.add_argument(
        '--bodies', type=at_least(1), default=24000, metavar='N',
        help='people to sample for population (default %(default)s)')
    boxes.add_argument(
        '--trees', type=at_least(1), default=120, metavar='N',
        help='in each ensemble (default %(default)s)')
    boxes.set_defaults(train=_train_body_dimensions)


def main(args: argparse.Namespace) -> int:
    """Train, and print the figures on what was held out."""
    return args.train(args)


def _train_skeleton(args: argparse.Namespace) -> int:
    try:
        from depth_person.distance.training.fit import fit, FitOptions
    except ImportError as error:
        raise DepthPersonError(
            f'training needs torch, anny and onnx, and {error.name} is missing; '
            "install them with: pip install 'depth_person[train]'") from error
    given = {name: getattr(args, name) for name in ('bodies', 'epochs', 'seed')
             if getattr(args, name) is not None}
    summary = fit(FitOptions(**given), args.out, progress=tqdm)
    print(f'{"":28}{"n":>7}{"median %":>10}{"bias %":>8}{"1 sigma":>9}{"2 sigma":>9}')
    for name, row in summary['held_out'].items():
        print(f'{name:28}{row["n"]:7d}{100 * row["median_relative_error"]:10.1f}'
              f'{100 * row["bias"]:8.1f}{row["within_1_sigma"]:9.1%}{row["within_2_sigma"]:9.1%}')
    print(f'wrote {args.out / "skeleton.onnx"} and {args.out / "skeleton.json"}')
    return 0


def _train_body_dimensions(args: argparse.Namespace) -> int:
    try:
        from depth_person.distance.training.body_dimensions import (
            fit_population,
            fit_table,
            PopulationOptions,
            sample_people,
        )
        from depth_person.distance.training.body_fit import FitOptions
    except ImportError as error:
        raise DepthPersonError(
            f'training needs scikit-learn, skl2onnx and onnx, and {error.name} is missing; '
            "install them with: pip install 'depth_person[train]'") from error
    kinds = ('paper', 'normalised') if args.model == 'both' else (args.model,)
    trees = FitOptions(trees=args.trees)
    if args.data == 'population':
        options = PopulationOptions()
        people = sample_people(options.seed, args.bodies, progress=tqdm)
        others = sample_people(options.seed + 1000, max(args.bodies // 6, 100), progress=tqdm)
    for kind in kinds:
        if args.data == 'population':
            summary = fit_population(
                kind, people, others, args.out, options=options, trees=trees, progress=tqdm)
        else:
            summary = fit_table(kind, Path(args.data), args.out, trees=trees, progress=tqdm)
        for what, row in summary['split'].items():
            print(f'{kind}: {what} of the {row["n"]} rows held out: '
                  f'RMSE {100 * row["rmse_m"]:.1f} cm, r {row["pearson_r"]:.3f}')
        print(f'wrote body_dimensions_{kind}.onnx and .json into {args.out}')
    return 0
