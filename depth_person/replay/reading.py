"""Reads folders of frames with known distances, and files of recorded keypoints."""
from __future__ import annotations

from dataclasses import replace
from itertools import groupby
import math
from operator import itemgetter
from pathlib import Path

import numpy as np

from depth_person.camera.intrinsics import Intrinsics
from depth_person.distance.estimator import Mounting
from depth_person.errors import DepthPersonError
from depth_person.replay.dataset import Dataset, Fault, Reference, TrueFrame, TruePerson
from depth_person.replay.record import Record

#: Words of a reference_point's description, and what they say of it.
_REFERENCE_WORDS = {'surface': Reference.SURFACE, 'centre': Reference.VERTICAL}


def read_dataset(path: Path) -> Dataset:
    """
    Read a folder of stills, of sequences or of both, or a file of recorded keypoints.

    Stills are gt/*.json, sequences seq/NAME/gt/*.json, both in order of name. A gt folder whose
    frames all have time_s is itself a sequence. A frame that cannot be read becomes a fault.

    :raises DepthPersonError: when there is nothing of the kind at the path.
    """
    if path.is_file():
        return _read_recording(path)
    frames, faults = _read_frames(path, path)
    timed = all(frame.time_s is not None for frame in frames)
    clips = [frames] if timed else [[frame] for frame in frames]
    for folder in sorted(path.glob('seq/*/')):
        frames, torn = _read_frames(folder, path)
        clips.append(frames)
        faults += torn
    if not (faults or any(clips)):
        raise DepthPersonError(
            f'{path} holds no gt/*.json and no seq/NAME/gt/*.json; '
            'give a folder of frames with known distances')
    return Dataset(tuple(tuple(clip) for clip in clips if clip), tuple(faults))


def _read_frames(folder: Path, root: Path) -> tuple[list[TrueFrame], list[Fault]]:
    """Return the frames of one gt folder, and what was wrong with the others."""
    frames, faults = [], []
    for path in sorted(folder.glob('gt/*.json')):
        try:
            frames.append(_frame(Record.read(path), folder, root))
        except DepthPersonError as error:
            faults.append(Fault(str(path.relative_to(root)), str(error)))
    return frames, faults


def _frame(record: Record, folder: Path, root: Path) -> TrueFrame:
    name = record.text('image')
    if not (folder / name).is_file():
        raise record.fault('image', f'names {name}, which is not there')
    return TrueFrame(
        name=(folder.relative_to(root) / name).as_posix(), image=folder / name,
        intrinsics=_intrinsics(record),
        people=tuple(_person(person) for person in record.children('persons')),
        scenario=record.text('scenario', ''), tag=record.text('tag', ''),
        time_s=_optional_number(record, 'time_s'),
        mounting=_mounting(record.child('camera')) if 'camera' in record else Mounting())


def _intrinsics(record: Record) -> Intrinsics:
    matrix = record.child('K')
    distortion = (
        record.array('dist_plumb_bob', [5]) if 'dist_plumb_bob' in record else np.zeros(5))
    return Intrinsics(
        int(record.positive('width')), int(record.positive('height')),
        fx=matrix.positive('fx'), fy=matrix.positive('fy'),
        cx=matrix.number('cx'), cy=matrix.number('cy'), distortion=tuple(distortion.tolist()))


def _mounting(camera: Record) -> Mounting:
    mounting = Mounting()
    if 'pitch_down_deg' in camera and 'roll_cw_deg' in camera:
        pitch = math.radians(camera.number('pitch_down_deg'))
        roll = math.radians(camera.number('roll_cw_deg'))
        mounting = replace(mounting, gravity=np.array([
            math.sin(roll) * math.cos(pitch), math.cos(roll) * math.cos(pitch),
            math.sin(pitch)]))
    level = not any(camera.number(f'slope_{way}_deg', 0.0) for way in ('fwd', 'right'))
    if 'height_m' in camera and level:
        mounting = replace(mounting, height=camera.number('height_m'))
    return mounting


def _optional_number(record: Record, key: str) -> float | None:
    return record.number(key) if key in record else None


def _person(record: Record) -> TruePerson:
    boxes = [record.array(key, [4]) for key in ('bbox_full', 'bbox_visible') if key in record]
    return TruePerson(
        id=record.identity('id'),
        depth=record.positive('depth_z_m'), range=record.positive('range_m'),
        reference=_reference(record.text('reference_point', '')),
        boxes=np.array(boxes).reshape(-1, 4),
        kind=record.text('kind', '') or None,
        yaw_deg=_optional_number(record, 'yaw_deg'),
        visible_fraction=_optional_number(record, 'visible_fraction'),
        keypoints=record.array('keypoints_px', [17, 3]) if 'keypoints_px' in record else None,
        flags=record.texts('keypoints_flag', 17) if 'keypoints_flag' in record else None,
        neck=record.array('neck_px', [2]) if 'neck_px' in record else None)


def _reference(description: str) -> Reference:
    """Return what a data set's words, such as '3D box centre', say of its reference point."""
    return next(
        (reference for word, reference in _REFERENCE_WORDS.items() if word in description),
        Reference.NECK)


def _read_recording(path: Path) -> Dataset:
    """
    Read people[] of a file, each with a frame's name, K, keypoints_detected, depth and range.

    The depth is z of xyz_m, whose other entries are not used. The image's size is not recorded;
    it is taken as twice the principal point.
    """
    try:
        recording = Record.read(path)
        records = recording.children('people')
        reference = _reference(recording.text('reference_point', ''))
    except DepthPersonError as error:
        raise DepthPersonError(f'{path} {error}') from error
    people, faults = [], []
    for i, record in enumerate(records):
        try:
            people.append((record.text('frame'), _recorded_camera(record.child('K')),
                           _recorded_person(record, i, reference)))
        except DepthPersonError as error:
            faults.append(Fault(path.name, str(error)))
    clips = []
    for name, rows in groupby(sorted(people, key=itemgetter(0)), itemgetter(0)):
        _, cameras, present = zip(*rows, strict=True)
        clips.append((TrueFrame(name, None, cameras[0], present, scenario='recorded'),))
    return Dataset(tuple(clips), tuple(faults))


def _recorded_camera(matrix: Record) -> Intrinsics:
    cx, cy = matrix.positive('cx'), matrix.positive('cy')
    return Intrinsics(
        math.ceil(2 * cx) + 1, math.ceil(2 * cy) + 1,
        fx=matrix.positive('fx'), fy=matrix.positive('fy'), cx=cx, cy=cy)


def _recorded_person(record: Record, index: int, reference: Reference) -> TruePerson:
    depth = record.array('xyz_m', [3])[2]
    if depth <= 0:
        raise record.fault('xyz_m', f'has the depth {depth:g}, not a positive one')
    return TruePerson(
        id=index, depth=float(depth), range=record.positive('range_m'), reference=reference,
        recorded=record.array('keypoints_detected', [17, 3]))
