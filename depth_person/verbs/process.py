"""Runs the pipeline over the images of bags; writes a bag with the results added."""
from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from itertools import product
from pathlib import Path
import sys
from typing import Any

from rclpy.exceptions import InvalidNamespaceException
from rclpy.validate_namespace import validate_namespace
from tqdm import tqdm
from tqdm.contrib.logging import logging_redirect_tqdm

from depth_person import __version__
from depth_person.camera.bag_topics import choose_image_topic, choose_info_topic
from depth_person.distance.estimators import ESTIMATORS
from depth_person.errors import DepthPersonError
from depth_person.interrupts import noted_interrupts
from depth_person.nodes.result_codec import ResultCodec
from depth_person.pipeline import Pipeline
from depth_person.replay.bags import BagWriter
from depth_person.replay.input_bags import InputBags
from depth_person.replay.process import Job, Outcome, Processor
from depth_person.replay.surroundings import Surroundings
from depth_person.replay.unfinished import (
    begin_anew,
    keep_better,
    RecordedPeople,
    RunRecord,
    set_aside,
)
from depth_person.settings.depth import DepthSettings
from depth_person.settings.files import node_settings
from depth_person.settings.pose import PoseSettings

#: Exit codes beside 0, everything was used, and 1, nothing could be done.
_PARTLY, _INTERRUPTED = 3, 130

_EPILOG = (
    'exit code: 0 all frames were processed; 1 nothing could be done; 3 done, but something in '
    'the bags could not be read or used, which is named; 130 stopped, go on with --resume')


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's arguments."""
    parser.epilog = _EPILOG
    parser.add_argument(
        'bags', nargs='+', type=Path, metavar='IN',
        help='rosbag: a folder, .mcap, .db3, or a ROS 1 .bag; several are merged by time')
    parser.add_argument(
        '-o', '--output', type=Path, required=True, metavar='OUT', help='the bag to write (MCAP)')
    parser.add_argument(
        '--params', type=Path, metavar='FILE',
        help='ROS 2 parameter file; what it gives to pose_node and depth_node is used')
    parser.add_argument(
        '--estimator', choices=ESTIMATORS, help='how a range is computed')
    parser.add_argument('--model', metavar='NAME', help='pose network')
    parser.add_argument(
        '--namespace', default='/', type=_namespace, metavar='NS',
        help='of the nodes: where results and inputs are, and which sections of the parameter '
             'file fit')
    parser.add_argument('--image-topic', metavar='TOPIC', help='where there are several')
    parser.add_argument('--camera-info-topic', metavar='TOPIC', help='where there are several')
    parser.add_argument(
        '--remap', action='append', default=[], metavar='FROM:=TO',
        help='a topic of depth_node by the name that it has in the bags, such as '
             'imu:=/mavros/imu/data')
    parser.add_argument(
        '--without-images', action='store_true', help='leave all images out of OUT')
    parser.add_argument('--compress', action='store_true', help='compress OUT with zstd')
    there = parser.add_mutually_exclusive_group()
    there.add_argument(
        '--resume', action='store_true', help='go on where a run was stopped')
    there.add_argument(
        '--overwrite', action='store_true', help='begin OUT, which process has written, anew')
    parser.add_argument(
        '--quiet', action='store_true', help='print nothing but what is wrong')


def main(args: argparse.Namespace) -> int:
    """Process the bags; return the exit code."""
    _check_output(args)
    with InputBags(args.bags) as bags:
        outcome = _process(args, bags)
    if not isinstance(outcome, RunRecord):
        for note in outcome.notes:
            _say(args, note)
    for fault in outcome.faults:
        print(f'depth_person process: {fault}', file=sys.stderr)
    if isinstance(outcome, RunRecord):
        _say(args, f'{args.output} is finished already')
    else:
        _say(args, f'{args.output}: {outcome.frames} frames with {outcome.people} people'
             + ('' if outcome.finished else '; stopped before the end, go on with --resume'))
    if not outcome.finished:
        return _INTERRUPTED
    return _PARTLY if outcome.faults else 0


def _check_output(args: argparse.Namespace) -> None:
    """Raise DepthPersonError when OUT is taken, or when writing it would cost something else."""
    out = args.output
    if not out.name:
        raise DepthPersonError(f'{out} is no name for a new folder')
    places = out, out.with_name(f'{out.name}.before')
    for source, place in product(args.bags, places):
        _keep_apart(source, place)
    try:
        taken = [place for place in places if place.exists()]
        strange = [place for place in taken if not (place / 'process.json').exists()]
    except OSError as error:  # such as a folder that may not be looked into
        raise DepthPersonError(f'bag {out} cannot be written: {error}') from error
    if out in taken and not (args.resume or args.overwrite):
        raise DepthPersonError(
            f'{out} exists already; name another, or --resume or --overwrite what process began')
    if args.overwrite and strange:
        raise DepthPersonError(
            f'{strange[0]} is no bag of results; it is not overwritten: it may be a recording')


def _keep_apart(source: Path, target: Path) -> None:
    """Raise DepthPersonError when replacing the target would touch the source."""
    read, written = source.resolve(), target.resolve()
    if written == read:
        raise DepthPersonError(f'{target} is one of the bags to read; name another')
    if read in written.parents:
        raise DepthPersonError(f'{target} lies within {source}, which is read; name another')
    if written in read.parents:
        raise DepthPersonError(f'{source}, which is read, lies within {target}; name another')


def _process(args: argparse.Namespace, bags: InputBags) -> Outcome | RunRecord:
    """Write the bag; return the record of the run where that has been done before."""
    job = _job(args, bags)
    pose, depth = _settings(args)
    namespace = args.namespace.rstrip('/') + '/'
    codec = ResultCodec(depth, namespace=namespace)
    # What decides the results, and so whether a run can go on.
    settings = {
        'version': __version__, 'pose_node': asdict(pose), 'depth_node': asdict(depth),
        'job': asdict(job), 'namespace': namespace, 'remap': args.remap,
        'compress': args.compress, 'input': bags.identity(job.image_topic)}
    if args.resume and (done := _finished(args.output, settings)):
        return done
    surroundings = Surroundings(
        bags, depth, namespace=namespace, remaps=dict(_remaps(args.remap)))
    pipeline = Pipeline(pose.pose_options(), depth.distance_options())
    if args.overwrite:
        begin_anew(args.output)
    before = set_aside(args.output, settings, codec.keypoint_topic) if args.resume else None
    try:
        with RecordedPeople(before, codec.keypoint_topic) as recorded:
            processor = Processor(
                bags, job, pipeline=pipeline, codec=codec, surroundings=surroundings,
                recollection=recorded)
            return _run(
                args, processor, total=bags.count(job.image_topic), settings=settings)
    finally:
        if before is not None:
            keep_better(args.output, before, codec.keypoint_topic)


def _run(
    args: argparse.Namespace, processor: Processor, *, total: int, settings: dict[str, Any],
) -> Outcome:
    with BagWriter(args.output, compress=args.compress) as writer, noted_interrupts() as stop, \
            _progress(args, total) as on_frame:
        RunRecord(settings).write(args.output)
        outcome = processor.run(writer, on_frame=on_frame, stopping=stop.is_set)
        if outcome.finished and not (outcome.frames or outcome.faults):
            outcome.faults.append('there is no image')
    RunRecord(settings, outcome.finished, outcome.faults).write(args.output)
    return outcome


def _finished(path: Path, settings: dict[str, Any]) -> RunRecord | None:
    if not path.is_dir():
        return None
    record = RunRecord.read(path)
    record.check(settings, path)
    return record if record.finished else None


def _job(args: argparse.Namespace, bags: InputBags) -> Job:
    image_topic = choose_image_topic(
        bags.topics, args.image_topic, where=bags.description, option='--image-topic')
    info_topic = choose_info_topic(
        bags.topics, args.camera_info_topic, image_topic=image_topic, where=bags.description)
    return Job(image_topic, info_topic, copy_images=not args.without_images)


def _settings(args: argparse.Namespace) -> tuple[PoseSettings, DepthSettings]:
    pose = node_settings(
        'pose_node', PoseSettings, file=args.params, namespace=args.namespace,
        overrides={'model': args.model} if args.model else {})
    depth = node_settings(
        'depth_node', DepthSettings, file=args.params, namespace=args.namespace,
        overrides={'estimator': args.estimator} if args.estimator else {})
    return pose, depth


def _namespace(name: str) -> str:
    """Return a namespace with a slash at its begin, as a type for argparse."""
    namespace = '/' + name.strip('/')
    try:
        validate_namespace(namespace)
    except InvalidNamespaceException as error:
        raise argparse.ArgumentTypeError(str(error).partition('\n')[0]) from error
    return namespace


def _remaps(pairs: list[str]) -> Iterator[tuple[str, str]]:
    for pair in pairs:
        name, separator, target = pair.partition(':=')
        if not (name and separator and target):
            raise DepthPersonError(f'--remap {pair} does not read FROM:=TO')
        yield name, target


@contextmanager
def _progress(args: argparse.Namespace, total: int) -> Iterator[Callable[[], None]]:
    """Show how far the frames are; yield what to call after each."""
    with logging_redirect_tqdm(), tqdm(
            total=total or None, unit='frame', disable=True if args.quiet else None) as bar:
        yield lambda: bar.update() and None


def _say(args: argparse.Namespace, message: str) -> None:
    if not args.quiet:
        print(message)
