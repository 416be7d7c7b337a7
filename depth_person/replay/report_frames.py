"""Sample frames of a report, with what was found drawn into them."""
from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from depth_person.camera.bag import BagReader
from depth_person.camera.bag_topics import (
    choose_image_topic,
    choose_info_topic,
    COMPRESSED_IMAGE,
    IMAGE,
)
from depth_person.camera.intrinsics import Intrinsics
from depth_person.camera.message_fields import calibration, picture, stamp_ns
from depth_person.distance.estimator import Cue, Distances, Reason
from depth_person.distance.tracked import TrackedPeople
from depth_person.errors import DepthPersonError
from depth_person.overlay import draw
from depth_person.pose.people import People
from depth_person.pose.skeleton import Keypoint, N_KEYPOINTS
from depth_person.replay.clouds import CLOUD, cloud_points
from depth_person.replay.results import PEOPLE, Results

WIDTH = 800
_QUALITY = 80

Keypoints = dict[int, NDArray[np.float32]]


@dataclass
class SampleFrames:
    """
    Pictures of a recording.

    :ivar pictures: JPEG data URI by stamp (ns).
    :ivar images: how many images the topic has.
    :ivar unmeasured: how many of them have no result.
    :ivar simultaneous: how many have one that was recorded in the very same nanosecond.
    :ivar faults: what could not be used.
    :ivar remark: why there are no pictures; empty where there are.
    """

    pictures: dict[int, str] = field(default_factory=dict)
    images: int = 0
    unmeasured: int = 0
    simultaneous: int = 0
    faults: list[str] = field(default_factory=list)
    remark: str = ''


def sample_frames(
    bag: BagReader, results: Results, *, topic: str, count: int, image_topic: str | None = None,
) -> SampleFrames:
    """
    Return pictures of a few frames, evenly over those in which there are people.

    :param topic: of the results, which tells that of the keypoints.
    :param image_topic: None for the only one, or the only one beside the results.
    """
    frames = SampleFrames()
    try:
        images = choose_image_topic(
            bag.topics, image_topic or _beside(bag, topic), where=f'bag {bag.path}',
            option='--image-topic')
    except DepthPersonError as error:
        if image_topic is not None:
            raise
        frames.remark = str(error)
        return frames
    wanted = _choose(results, count)
    infos = choose_info_topic(
        bag.topics, None, image_topic=images, where=f'bag {bag.path}')
    keypoints = _keypoints(bag, topic.removesuffix(PEOPLE) + 'person_keypoints', wanted)
    recorded = dict(zip(
        results.stamps_ns.tolist(), results.recorded_ns.tolist(), strict=True))
    intrinsics: Intrinsics | None = None
    undecodable = 0
    for name, time_ns, message in bag.messages([images, *filter(None, [infos])]):
        if name == infos:
            intrinsics = _calibration(message)
            continue
        stamp = stamp_ns(message.header) or time_ns  # as process does
        frames.images += 1
        frames.unmeasured += stamp not in recorded
        frames.simultaneous += recorded.get(stamp) == time_ns
        if stamp not in wanted or stamp in frames.pictures:
            continue
        try:
            image = np.array(picture(message))
        except DepthPersonError:
            undecodable += 1
            continue
        fitting = intrinsics if intrinsics is not None and intrinsics.fits(image) else None
        draw(image, _tracked(results, wanted[stamp], keypoints.get(stamp, {}), fitting), fitting)
        frames.pictures[stamp] = _as_uri(image)
    if undecodable:
        frames.faults.append(f'{images}: {undecodable} of the sample frames hold no picture')
    if bag.undecodable[images]:
        frames.faults.append(f'{images}: {bag.undecodable[images]} messages cannot be decoded')
    return frames


def _beside(bag: BagReader, topic: str) -> str | None:
    """Return the only image topic of the namespace in which the results are, if there is one."""
    namespace = topic.removesuffix(PEOPLE)
    found = [
        name for name in bag.topics_of_type(IMAGE, COMPRESSED_IMAGE)
        if name.removesuffix('/compressed').rpartition('/')[0] + '/' == namespace]
    return found[0] if len(found) == 1 else None


def _choose(results: Results, count: int) -> dict[int, int]:
    """Return the indices of so many frames by their stamps."""
    people = results.people
    busy = np.unique(people.frame[np.isfinite(people.range)])
    frames = busy if len(busy) else np.arange(len(results.stamps_ns))
    chosen = frames[np.unique(np.linspace(0, len(frames) - 1, count).round().astype(int))]
    return {int(results.stamps_ns[index]): int(index) for index in chosen}


def _keypoints(bag: BagReader, topic: str, wanted: dict[int, int]) -> dict[int, Keypoints]:
    """Return (18, 3) keypoints by track id and by stamp, as far as they were recorded."""
    found: dict[int, Keypoints] = {}
    if topic not in bag.topics_of_type(CLOUD):
        return found
    for _, _, message in bag.messages([topic]):
        stamp = stamp_ns(message.header)
        if stamp in wanted:
            found[stamp] = dict(_skeletons(message))
    return found


def _skeletons(message: Any) -> Iterator[tuple[int, NDArray[np.float32]]]:
    try:
        points = cloud_points(message)
        for row in points:
            if len(row) == N_KEYPOINTS:
                yield int(row['track_id'][0]), np.stack(
                    [row[name] for name in ('u', 'v', 'score')], axis=-1).astype(np.float32)
    except (DepthPersonError, ValueError):  # no keypoints: the frame is drawn without skeletons
        return


def _calibration(message: Any) -> Intrinsics | None:
    try:
        return calibration(message)
    except DepthPersonError:  # whoever measured has said so; here it only places the hidden
        return None


def _tracked(
    results: Results, frame: int, keypoints: Keypoints, intrinsics: Intrinsics | None,
) -> TrackedPeople:
    """Return the people of a frame as the overlay draws them."""
    rows = results.people.take(results.people.frame == frame)
    skeletons = np.full((len(rows), N_KEYPOINTS, 3), np.nan, np.float32)
    for row, track_id in enumerate(rows.track_id.tolist()):
        if track_id in keypoints:
            skeletons[row] = keypoints[track_id]
        elif intrinsics is not None and not rows.predicted[row]:
            skeletons[row, Keypoint.NECK] = (*intrinsics.project(rows.position[row]), 1.0)
    known = np.isfinite(rows.range)
    distances = Distances.of(
        position=rows.position, range_sigma=rows.range_sigma,
        reason=np.where(known, Reason.NONE, Reason.TOO_FEW_KEYPOINTS).astype(np.uint8),
        cues=np.full(len(rows), Cue.NONE, np.uint8))
    people = People(skeletons, rows.track_id.astype(np.int32))
    return replace(TrackedPeople.unfiltered(people, distances), predicted=rows.predicted)


def _as_uri(image: NDArray[np.uint8]) -> str:
    height, width = image.shape[:2]
    if width > WIDTH:
        image = cv2.resize(
            image, (WIDTH, max(round(height * WIDTH / width), 1)), interpolation=cv2.INTER_AREA)
    _, data = cv2.imencode('.jpg', image, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
    return f'data:image/jpeg;base64,{b64encode(data.tobytes()).decode("ascii")}'
