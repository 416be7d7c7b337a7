"""Which topics of a bag hold the images of a camera and its calibration."""
from __future__ import annotations

from collections.abc import Collection, Mapping

from depth_person.camera.bag import Topic
from depth_person.errors import DepthPersonError

IMAGE = 'sensor_msgs/msg/Image'
COMPRESSED_IMAGE = 'sensor_msgs/msg/CompressedImage'
CAMERA_INFO = 'sensor_msgs/msg/CameraInfo'
#: Ends the name of the picture that this package draws, which is no camera's.
_OVERLAY = 'person_depth/image/compressed'


def choose_image_topic(
    topics: Mapping[str, Topic], wanted: str | None, *, where: str, option: str,
) -> str:
    """
    Return the image topic of this name, or the only one.

    :param where: whose topics they are, for messages.
    :param option: by which the user says what is wanted.
    :raises DepthPersonError: when there is none, or several; lists them.
    """
    candidates = [
        topic.name for topic in topics.values()
        if topic.msgtype in (IMAGE, COMPRESSED_IMAGE)
        and (wanted is not None or not topic.name.endswith(_OVERLAY))]
    if wanted is not None:
        return _named(topics, wanted, candidates, where=where, kind='image topic')
    if not candidates:
        raise DepthPersonError(
            f'{where} has no topic of type {IMAGE} or {COMPRESSED_IMAGE}; it has '
            f'{", ".join(topics) or "no topics"}')
    if len(candidates) > 1:
        raise DepthPersonError(
            f'{where} has several image topics; choose by {option}: '
            f'{_listed(topics, candidates)}')
    return candidates[0]


def choose_info_topic(
    topics: Mapping[str, Topic], wanted: str | None, *, image_topic: str, where: str,
) -> str | None:
    """
    Return the CameraInfo topic of this name, the one beside the images, or else the only one.

    :returns: None where there is no single one.
    :raises DepthPersonError: when there is none of the wanted name.
    """
    candidates = [topic.name for topic in topics.values() if topic.msgtype == CAMERA_INFO]
    if wanted is not None:
        return _named(topics, wanted, candidates, where=where, kind='camera_info topic')
    beside = image_topic.removesuffix('/compressed').rpartition('/')[0] + '/camera_info'
    if beside in candidates:
        return beside
    return candidates[0] if len(candidates) == 1 else None


def _named(
    topics: Mapping[str, Topic], wanted: str, candidates: Collection[str], *, where: str,
    kind: str,
) -> str:
    wanted = '/' + wanted.lstrip('/')
    if wanted in candidates:
        return wanted
    if wanted in topics:
        raise DepthPersonError(
            f'{wanted} of {where} is of type {topics[wanted].msgtype}, which is no {kind}; it has '
            f'{_listed(topics, candidates)}')
    raise DepthPersonError(
        f'{where} has no {kind} {wanted}; it has {_listed(topics, candidates)}')


def _listed(topics: Mapping[str, Topic], names: Collection[str]) -> str:
    return ', '.join(f'{name} ({topics[name].msgtype})' for name in names) or 'none'
