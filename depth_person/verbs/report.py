"""The verb report: one self-contained page about a bag of results."""
from __future__ import annotations

import argparse
from pathlib import Path
import sys

from depth_person.errors import DepthPersonError
from depth_person.files import write_text
from depth_person.verbs.numbers import at_least


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.description = (
        'Write one page that needs nothing beside it: ranges, places, latency, sample frames, '
        'and errors where the truth is known. Exit code 0: all of the bag was used, 1: no page, '
        '3: a page, which names what could not be used.')
    parser.add_argument('bag', type=Path, metavar='BAG', help='bag with results')
    parser.add_argument(
        '-o', '--output', type=Path, default=Path('report.html'), metavar='FILE',
        help='the page (default %(default)s)')
    parser.add_argument(
        '--truth', metavar='TOPIC|CSV',
        help='true places: a topic of clouds (x, y, z or range, track_id), or a CSV file '
             '(stamp_ns, stamp_s or time_s; id; x, y, z or range)')
    parser.add_argument(
        '--topic', metavar='NAME', help='of the results, in a bag that has several')
    parser.add_argument(
        '--image-topic', metavar='NAME', help='of the sample frames, in a bag that has several')
    parser.add_argument(
        '--frames', type=at_least(0, at_most=100), default=6, metavar='N',
        help='how many sample frames (default %(default)s)')


def main(args: argparse.Namespace) -> int:
    """Write the page; return 3 when some of the bag could not be used."""
    _check_output(args.output, args.bag, args.truth)
    from depth_person.replay.report import make_report  # needs matplotlib
    report = make_report(
        args.bag, truth=args.truth, topic=args.topic, image_topic=args.image_topic,
        frames=args.frames)
    write_text(args.output, report.html)
    print(f'wrote {args.output} ({args.output.stat().st_size / 1e6:.1f} MB)')
    for fault in report.faults:
        print(f'depth_person report: {fault}', file=sys.stderr)
    return 3 if report.faults else 0


def _check_output(output: Path, bag: Path, truth: str | None) -> None:
    """Raise DepthPersonError when the page would replace what is to be read."""
    target = output.resolve()
    folder = bag if bag.is_dir() else bag.parent
    read = {bag, *(path for path in folder.glob('*') if path.suffix != '.html')}
    if truth is not None:
        read.add(Path(truth))
    if target in {path.resolve() for path in read}:
        raise DepthPersonError(f'{output} is a part of what is read; name another')
