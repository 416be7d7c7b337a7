"""The verb compare: what moved between two sets of results."""
from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from dataclasses import fields, replace
from pathlib import Path
import sys

import numpy as np
from numpy.typing import NDArray

from depth_person.errors import DepthPersonError
from depth_person.replay.compare import compare, Comparison, IDS, Tolerances
from depth_person.replay.golden import read_golden
from depth_person.replay.results import read_results, Results
from depth_person.verbs.numbers import at_least

_DEFAULTS = Tolerances()
_TOLERANCES = {
    'range': 'change of the range over the range',
    'position': 'how far the neck moved over the range',
    'sigma': 'change of sigma over sigma',
    'allow': 'share of people, and of frames, that may be beyond or missing',
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.description = (
        'Compare results person by person, by stamp. Exit code 0: the same within tolerances, '
        '1: not the same, 2: bad input.')
    for name in ('a', 'b'):
        parser.add_argument(
            name, type=Path, metavar=name.upper(),
            help='bag with results, or .json file of golden values, whose tolerances then hold')
    for name, meaning in _TOLERANCES.items():
        parser.add_argument(
            f'--{name}', type=at_least(0.0), metavar='SHARE', help=f'{meaning} '
            f'(default {getattr(_DEFAULTS, name):g}, or what the golden values say)')
    parser.add_argument(
        '--ids', choices=IDS, default=IDS[0],
        help='how track ids may differ: renamed, each person has one id throughout, whichever; '
             'same, the very same ids; any (default %(default)s)')
    parser.add_argument(
        '--topic', metavar='NAME', help='of the results, in a bag that has several')
    parser.add_argument(
        '--lines', type=at_least(0), default=20, metavar='N',
        help='list the N people who moved most (default %(default)s)')
    parser.add_argument(
        '--plots', type=Path, metavar='DIR', help='draw the differences as PNG files')


def main(args: argparse.Namespace) -> int:
    """Print what moved; return 0 within tolerances, 1 beyond them, 2 on bad input."""
    try:
        draw = _plotter() if args.plots else None
        comparison = _compare(args)
        print('\n'.join(_report(comparison, lines=args.lines)))
        if draw:
            for path in draw(comparison, args.plots):
                print(f'wrote {path}')
    except DepthPersonError as error:
        print(f'depth_person compare: {error}', file=sys.stderr)
        return 2
    faults = [(results.name, fault) for results in (comparison.a, comparison.b)
              for fault in results.faults]
    for name, fault in faults:
        print(f'depth_person compare: {name}: {fault}', file=sys.stderr)
    return 2 if faults else 0 if comparison.agree else 1


def _plotter() -> Callable[[Comparison, Path], list[Path]]:
    """Return draw_comparison; asked for before the work begins: matplotlib may be missing."""
    from depth_person.replay.compare_plots import draw_comparison
    return draw_comparison


def _compare(args: argparse.Namespace) -> Comparison:
    (a, golden_a), (b, golden_b) = (_read(path, args.topic) for path in (args.a, args.b))
    tolerances = golden_b or golden_a or _DEFAULTS
    given = {field.name: getattr(args, field.name) for field in fields(Tolerances)
             if getattr(args, field.name) is not None}
    return compare(a, b, replace(tolerances, **given), ids=args.ids)


def _read(path: Path, topic: str | None) -> tuple[Results, Tolerances | None]:
    if path.suffix == '.json':
        return read_golden(path)
    return read_results(path, topic=topic), None


def _report(comparison: Comparison, *, lines: int) -> Iterator[str]:
    """Yield the lines of the printed report."""
    for letter, results in (('A', comparison.a), ('B', comparison.b)):
        yield (f'{letter} {results.name}: {len(results.stamps_ns)} frames, '
               f'{len(results.tracks)} people')
    only_a, only_b = comparison.lone_frames
    yield (f'{len(comparison.pairs.stamps_ns)} frames in both, {only_a} only in A, '
           f'{only_b} only in B')
    yield ''
    yield (f'{"A":>6}{"B":>6}{"both":>7}{"only A":>8}{"only B":>8}{"range %":>17}'
           f'{"position %":>17}{"sigma %":>17}{"ids":>6}{"beyond":>8}')
    yield f'{"":35}' + 3 * f'{"median":>9}{"largest":>8}' + f'{"moved":>6}'
    for id_a, id_b, rows in comparison.tracks():
        yield _row(comparison, id_a, id_b, rows)
    yield ''
    yield from _worst(comparison, lines)
    yield _verdict(comparison)


def _row(
    comparison: Comparison, id_a: int | None, id_b: int | None, rows: NDArray[np.intp],
) -> str:
    pairs = comparison.pairs
    both = rows[pairs.both[rows]]
    cells = ''.join(
        _change(change[both]) for change in (
            comparison.range_change, comparison.position_change, comparison.sigma_change))
    return (f'{_name(id_a):>6}{_name(id_b):>6}{len(both):7d}'
            f'{(pairs.row_b[rows] < 0).sum():8d}{(pairs.row_a[rows] < 0).sum():8d}{cells}'
            f'{comparison.id_moved[rows].sum():6d}{comparison.beyond[rows].sum():8d}')


def _name(track_id: int | None) -> str:
    return '-' if track_id is None else f'#{track_id}'


def _change(changes: NDArray[np.float64]) -> str:
    known = changes[np.isfinite(changes)]
    if not known.size:
        return f'{"-":>9}{"-":>8}'
    return f'{100 * np.median(known):9.2f}{100 * known[np.argmax(np.abs(known))]:8.2f}'


def _worst(comparison: Comparison, lines: int) -> Iterator[str]:
    """Yield a line for each of those who are beyond tolerance, the worst first."""
    beyond = np.flatnonzero(comparison.beyond)
    if not (beyond.size and lines):
        return
    excess = np.where(comparison.missing | comparison.lost, np.inf, comparison.excess)
    order = beyond[np.argsort(-excess[beyond], kind='stable')][:lines]
    shown = f', the worst {len(order)} of {len(beyond)}' if len(order) < len(beyond) else ''
    yield f'what moved{shown}:'
    for row in order:
        yield f'  {_moved(comparison, row)}'
    yield ''


def _moved(comparison: Comparison, row: np.intp) -> str:
    """Return what is beyond tolerance of one person in one frame."""
    pairs = comparison.pairs
    in_a, in_b = pairs.row_a[row], pairs.row_b[row]
    results, own = (comparison.a, in_a) if in_a >= 0 else (comparison.b, in_b)
    people = results.people
    place = f'{results.stamps_ns[people.frame[own]] * 1e-9:.3f} s'
    if not pairs.both[row]:
        return (f'{place}  #{people.track_id[own]} only in {"A" if in_a >= 0 else "B"}, '
                f'at {people.range[own]:.3f} m')
    other = comparison.b.people
    parts = [
        f'range {people.range[own]:.3f} -> {other.range[in_b]:.3f} m '
        f'({100 * comparison.range_change[row]:+.2f} %)',
        f'position {100 * comparison.position_change[row]:.2f} %',
        f'sigma {people.range_sigma[own]:.3f} -> {other.range_sigma[in_b]:.3f} m']
    if comparison.id_moved[row]:
        parts.append('another id')
    return f'{place}  #{people.track_id[own]} -> #{other.track_id[in_b]}  {", ".join(parts)}'


def _verdict(comparison: Comparison) -> str:
    limits = ', '.join(
        f'{name} {100 * getattr(comparison.tolerances, name):g} %' for name in _TOLERANCES)
    if not len(comparison.pairs.stamps_ns):
        return 'different: no stamp is in both'
    return (f'{"the same" if comparison.agree else "different"}: '
            f'{comparison.beyond.sum()} of {len(comparison.beyond)} people beyond tolerance '
            f'({limits}), {sum(comparison.lone_frames)} frames in only one')
