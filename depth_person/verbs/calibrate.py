"""The verb calibrate: intrinsics from a board, from a person, or from a field of view."""
from __future__ import annotations

import argparse
from pathlib import Path
import re

from depth_person.camera.board_calibration import MODELS
from depth_person.camera.calibration import save_camera_info
from depth_person.camera.intrinsics import Intrinsics
from depth_person.errors import DepthPersonError
from depth_person.verbs.calibrate_ways import (
    from_board,
    from_field_of_view,
    from_person,
    write_person,
)
from depth_person.verbs.numbers import positive

#: Ways of calibrating, by the option that chooses each.
_WAYS = ('chessboard', 'charuco', 'at', 'fov', 'diagonal_fov')


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's arguments."""
    parser.epilog = (
        'Give --chessboard or --charuco with a SOURCE; or --at for a person at known distances; '
        'or --fov with --size. All write the YAML that camera_info_url takes; with --person, the '
        'body is measured instead and a parameter file written.')
    parser.add_argument(
        'source', nargs='?', metavar='SOURCE',
        help='camera, video, folder of images or bag that shows the board; Ctrl-C ends a live one')
    parser.add_argument(
        '-o', '--output', type=Path, required=True, metavar='FILE', help='what is written')
    parser.add_argument('--overwrite', action='store_true', help='replace FILE')
    parser.add_argument('--name', default='camera', help="the camera's name in FILE")
    board = parser.add_argument_group('from a board')
    board.add_argument(
        '--chessboard', type=_counts, metavar='CxR', help='inner corners across and down')
    board.add_argument('--charuco', type=_counts, metavar='CxR', help='squares across and down')
    board.add_argument('--square', type=positive, metavar='M', help='side of a square, metres')
    board.add_argument('--marker', type=positive, metavar='M', help='side of a marker, metres')
    board.add_argument(
        '--dictionary', default='4X4_50', help='of the markers (default %(default)s)')
    board.add_argument(
        '--model', choices=MODELS, default=MODELS[0],
        help='of the lens (default %(default)s; equidistant is for fisheyes)')
    board.add_argument(
        '--views', type=int, default=40, metavar='N',
        help='stop when so many different views are found (default %(default)s)')
    board.add_argument(
        '--every', type=int, default=1, metavar='N', help='look at every Nth frame only')
    board.add_argument('--image-topic', metavar='TOPIC', help='of a bag with several')
    person = parser.add_argument_group('from a person')
    person.add_argument(
        '--at', nargs=2, action='append', metavar=('METRES', 'SOURCE'),
        help='frames of the person at this distance, from the lens to the base of the neck; may '
             'be given several times')
    person.add_argument(
        '--distance-sigma', type=positive, default=0.05, metavar='M',
        help='how well it was measured, one standard deviation (default %(default)s m)')
    person.add_argument(
        '--shoulder-width', type=positive, metavar='M',
        help='between the shoulder keypoints; 0.35 unless a stature is given')
    person.add_argument('--stature', type=positive, metavar='M', help="the person's")
    person.add_argument(
        '--estimator', choices=('skeleton', 'shoulder'), default='skeleton',
        help='how keypoints are turned into a range (default %(default)s; shoulder is the '
             "source paper's formula)")
    person.add_argument(
        '--person', action='store_true',
        help="learn the person's shoulder width and stature instead; needs --camera-info-url")
    person.add_argument('--camera-info-url', metavar='URL', help="the camera's calibration")
    field = parser.add_argument_group('from a field of view')
    field.add_argument('--fov', type=positive, metavar='DEG', help='horizontal')
    field.add_argument('--diagonal-fov', type=positive, metavar='DEG', help='corner to corner')
    field.add_argument('--size', type=_counts, metavar='WxH', help='of the image, pixels')


def main(args: argparse.Namespace) -> int:
    """Calibrate in the way that the options choose; return the exit code."""
    chosen = [way for way in _WAYS if getattr(args, way) is not None]
    if len(chosen) != 1:
        names = ', '.join(f'--{way.replace("_", "-")}' for way in _WAYS)
        raise DepthPersonError(f'give one of {names}; {len(chosen)} are given')
    if args.output.exists() and not args.overwrite:
        raise DepthPersonError(
            f'{args.output} exists; choose another file or say --overwrite')
    if args.person:
        write_person(args)
    elif args.at:
        _save(args, from_person(args))
    elif args.fov or args.diagonal_fov:
        _save(args, from_field_of_view(args))
    else:
        _save(args, from_board(args))
    return 0


def _save(args: argparse.Namespace, intrinsics: Intrinsics) -> None:
    save_camera_info(args.output, args.name, intrinsics)
    print(f'wrote {args.output}; use it with camera_info_url: file://{args.output.absolute()}')


def _counts(text: str) -> tuple[int, int]:
    """Return two whole numbers written 9x6."""
    match = re.fullmatch(r'(\d+)[xX](\d+)', text)
    if match is None or not (int(match[1]) and int(match[2])):
        raise argparse.ArgumentTypeError(f'{text!r} is not like 9x6')
    return int(match[1]), int(match[2])
