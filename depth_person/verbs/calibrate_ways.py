"""The ways in which the verb calibrate finds a camera or a person, from its arguments."""
from __future__ import annotations

import argparse
from collections.abc import Iterator
import math
import sys
import time

import numpy as np
from tqdm import tqdm
import yaml

from depth_person.camera.board_calibration import BoardCalibration, BoardViews, calibrate
from depth_person.camera.boards import Board, CharucoBoard, Chessboard
from depth_person.camera.calibration import load_camera_info
from depth_person.camera.frame import Frame
from depth_person.camera.intrinsics import Intrinsics
from depth_person.camera.sources import open_source
from depth_person.distance.estimator import Body
from depth_person.distance.estimators import make_estimator
from depth_person.distance.person_calibration import (
    focal_length,
    largest_person,
    Measured,
    shoulder_width,
    Stand,
    stature,
)
from depth_person.errors import DepthPersonError
from depth_person.files import write_text
from depth_person.pose.people import People

#: A live camera is looked at for so long where a person stands, seconds.
_LIVE_S = 5.0
#: Frames of one distance that are looked at.
_MOST_FRAMES = 300


def from_board(args: argparse.Namespace) -> Intrinsics:
    """Return the intrinsics that a board tells; print coverage, errors and uncertainty."""
    board = _board(args)
    views: BoardViews | None = None
    bar = tqdm(_frames(_named_source(args), args.image_topic, args.every),
               unit='frame', disable=None)
    try:
        for frame in bar:
            if views is None:
                height, width = frame.image.shape[:2]
                views = BoardViews(width, height)
            elif frame.image.shape[:2] != (views.height, views.width):
                raise DepthPersonError(
                    f'the images change from {views.width}x{views.height} to '
                    f'{frame.image.shape[1]}x{frame.image.shape[0]}; calibrate one size at a time')
            found = board.find(frame.image)
            if found is not None and views.offer(found):
                bar.set_postfix(views=len(views.views), covered=f'{views.coverage().mean():.0%}')
                if len(views.views) >= args.views:
                    break
    except KeyboardInterrupt:  # how a live camera is ended
        print('\nstopped; calibrating with what has been seen', file=sys.stderr)
    finally:
        bar.close()
    if views is None:
        raise DepthPersonError('the source holds no images')
    _show_coverage(views)
    result = calibrate(views, model=args.model)
    _show(result)
    return result.intrinsics


def _board(args: argparse.Namespace) -> Board:
    if args.square is None:
        raise DepthPersonError('say how large a square is: --square 0.025')
    if args.chessboard:
        return Chessboard(*args.chessboard, square=args.square)
    if args.marker is None:
        raise DepthPersonError('say how large a marker is: --marker 0.018')
    return CharucoBoard(
        *args.charuco, square=args.square, marker=args.marker, dictionary=args.dictionary)


def _named_source(args: argparse.Namespace) -> str:
    if not args.source:
        raise DepthPersonError('say where the board is seen: a camera, video, folder or bag')
    return str(args.source)


def _frames(spec: str, image_topic: str | None = None, every: int = 1) -> Iterator[Frame]:
    """Yield the frames of a source, or every so many of them."""
    with open_source(spec, image_topic=image_topic) as source:
        index = 0
        while (frame := source.read()) is not None:
            if index % max(every, 1) == 0:
                yield frame
            index += 1


def _show_coverage(views: BoardViews) -> None:
    seen = views.coverage()
    print(f'{len(views.views)} different views; the board was in {seen.mean():.0%} of the image:')
    for row in seen:
        print('  ' + ''.join('#' if cell else '.' for cell in row))


def _show(result: BoardCalibration) -> None:
    camera = result.intrinsics
    print(f'fx {camera.fx:.2f}, fy {camera.fy:.2f} px, give or take {result.focal_sigma:.2%}; '
          f'cx {camera.cx:.2f}, cy {camera.cy:.2f}')
    print(f'{camera.distortion_model} ' + ' '.join(f'{each:.5f}' for each in camera.distortion))
    left_out = f', {result.outliers} left out' if result.outliers else ''
    print(f'reprojection error {result.reprojection_error:.3f} px '
          f'over {result.views} views{left_out}')


def from_person(args: argparse.Namespace) -> Intrinsics:
    """Return the intrinsics that a person at known distances tells, with their uncertainty."""
    stands, (width, height) = _stands(args)
    body = Body(shoulder_width=args.shoulder_width, stature=args.stature)
    if body.shoulder_width is None and body.stature is None:
        body = Body(shoulder_width=0.35)
        print('taking 0.35 m for the shoulder width, as the source paper does')
    result = focal_length(
        stands, width=width, height=height, estimator=make_estimator(args.estimator, body=body))
    _tell('focal length', result, 'px')
    degrees = math.degrees(2 * math.atan(width / 2 / result.value))
    print(f'that is a horizontal field of view of {degrees:.1f} degrees')
    return Intrinsics(
        width, height, result.value, result.value, (width - 1) / 2, (height - 1) / 2)


def _tell(name: str, result: Measured, unit: str) -> None:
    print(f'{name} {result.value:.4g} +- {result.sigma:.2g} {unit} '
          f'({result.sigma / result.value:.1%}), from {result.frames} frames')


def write_person(args: argparse.Namespace) -> None:
    """Measure the body, and write the parameters that say so."""
    if not (args.at and args.camera_info_url):
        raise DepthPersonError(
            '--person needs the camera, --camera-info-url, and the person, --at METRES SOURCE')
    _, intrinsics = load_camera_info(args.camera_info_url)
    stands, size = _stands(args)
    if size != (intrinsics.width, intrinsics.height):
        raise DepthPersonError(
            f'the calibration is for {intrinsics.width}x{intrinsics.height}, the images are '
            f'{size[0]}x{size[1]}; calibrate at the size in use')
    width, tall = shoulder_width(stands, intrinsics), stature(stands, intrinsics)
    _tell('shoulder width', width, 'm')
    _tell('stature', tall, 'm')
    parameters = {
        'shoulder_width': round(width.value, 3),
        'shoulder_width_sigma': round(max(width.sigma / width.value, 0.005), 3),
        'stature': round(tall.value, 3),
    }
    document = {'/**/depth_node': {'ros__parameters': parameters}}
    write_text(args.output, yaml.safe_dump(document, sort_keys=False))
    print(f'wrote {args.output}; use it with: depth_person run --params {args.output}')


def _stands(args: argparse.Namespace) -> tuple[list[Stand], tuple[int, int]]:
    """Return the person at each distance, and the images' size."""
    sizes = set[tuple[int, int]]()
    stands = []
    for metres, spec in args.at:
        people = _people(spec, sizes)
        stands.append(Stand(people, _metres(metres), args.distance_sigma))
    if len(sizes) != 1:
        raise DepthPersonError(
            'the images have different sizes: '
            + ', '.join(f'{width}x{height}' for width, height in sorted(sizes)))
    return stands, sizes.pop()


def _people(spec: str, sizes: set[tuple[int, int]]) -> People:
    """Return the largest person of each frame as one People, a row a frame."""
    # The network's libraries are loaded only where a person is looked for.
    from depth_person.pose.pipeline import PoseEstimator, PoseOptions
    pose = PoseEstimator(PoseOptions())
    found: list[People] = []
    deadline = time.monotonic() + _LIVE_S
    with open_source(spec) as source:
        bar = tqdm(desc=source.description, unit='frame', disable=None)
        while len(found) < _MOST_FRAMES and (frame := source.read()) is not None:
            sizes.add((frame.image.shape[1], frame.image.shape[0]))
            found.append(largest_person(pose.estimate(frame)))
            bar.update()
            if source.live and time.monotonic() > deadline:
                break
        bar.close()
    found = [people for people in found if len(people)]
    if not found:
        raise DepthPersonError(f'nobody is seen in {spec}; have the whole person in the picture')
    return People(
        np.concatenate([people.keypoints for people in found]),
        np.concatenate([people.track_ids for people in found]),
        neck_measured=found[0].neck_measured, convention=found[0].convention)


def from_field_of_view(args: argparse.Namespace) -> Intrinsics:
    """Return the pinhole of a field of view."""
    if args.size is None:
        raise DepthPersonError('say how large the image is: --size 1280x720')
    width, height = args.size
    degrees = args.fov
    if args.diagonal_fov:
        if not args.diagonal_fov < 180:
            raise DepthPersonError(f'{args.diagonal_fov:g} degrees are no field of view')
        along = math.tan(math.radians(args.diagonal_fov) / 2) * width / math.hypot(width, height)
        degrees = 2 * math.degrees(math.atan(along))
    intrinsics = Intrinsics.from_horizontal_fov(degrees, width=width, height=height)
    print(f'focal length {intrinsics.fx:.1f} px; nothing is known of the distortion, and the '
          'principal point is taken as the middle of the image')
    return intrinsics


def _metres(text: str) -> float:
    try:
        return float(text)
    except ValueError as error:
        raise DepthPersonError(
            f'--at takes metres and a source, not {text!r}; such as --at 3 /dev/video0'
        ) from error
