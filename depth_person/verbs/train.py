"""The verb train: repeat the training of the networks that the package ships."""
from __future__ import annotations

import argparse
from pathlib import Path

from tqdm import tqdm

from depth_person.errors import DepthPersonError


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare `train skeleton`."""
    networks = parser.add_subparsers(dest='network', required=True, metavar='NETWORK')
    skeleton = networks.add_parser(
        'skeleton', help='the lifter of the estimator skeleton, on bodies of our own making')
    skeleton.add_argument(
        '--out', type=Path, required=True, metavar='DIR',
        help='folder for skeleton.onnx and skeleton.json')
    skeleton.add_argument(
        '--bodies', type=_positive, metavar='N', help='people to sample (default 30000)')
    skeleton.add_argument(
        '--epochs', type=_positive, metavar='N',
        help='how often each is seen, each time in another view (default 800)')
    skeleton.add_argument('--seed', type=int, metavar='S', help='default 1')


def _positive(text: str) -> int:
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f'{text} is not a positive number')
    return value


def main(args: argparse.Namespace) -> int:
    """Train, and print the figures on held-out bodies."""
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
