"""People at their distances as visualization_msgs/MarkerArray."""
from __future__ import annotations

from copy import copy

from builtin_interfaces.msg import Duration
from geometry_msgs.msg import Point, Pose, Vector3
import numpy as np
from numpy.typing import NDArray
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from depth_person.camera.intrinsics import Intrinsics
from depth_person.distance.tracked import TrackedPeople
from depth_person.overlay import person_colour
from depth_person.pose.skeleton import LIMBS

_LIMBS = np.array(LIMBS)
#: How people are drawn who are only predicted.
PREDICTED_OPACITY = 0.35
PREDICTED_TEXT = ' (predicted)'

_LIFETIME = Duration(nanosec=500_000_000)
_HEAD_ROOM = 0.45  # metres from the neck up to the label, clear of the head


def _blank(namespace: str, kind: int, x: float, y: float = 0.0, z: float = 0.0) -> Marker:
    return Marker(ns=namespace, type=kind, scale=Vector3(x=x, y=y, z=z), lifetime=_LIFETIME)


# Markers are copied from these, what they share included: to make one takes five times as long.
_DELETE_ALL = Marker(action=Marker.DELETEALL)
_SPHERE = _blank('person', Marker.SPHERE, 0.25, 0.25, 0.25)
_LABEL = _blank('label', Marker.TEXT_VIEW_FACING, 0.0, z=0.25)
_UNCERTAINTY = _blank('uncertainty', Marker.LINE_LIST, 0.04)
_SKELETON = _blank('skeleton', Marker.LINE_LIST, 0.03)


def encode_markers(
    tracked: TrackedPeople, header: Header, intrinsics: Intrinsics | None,
) -> MarkerArray:
    """
    Return the markers of /person_depth; people without a range are left out.

    Who is only predicted is see-through, with a label that says so.

    :param intrinsics: of the image; None while the camera is uncalibrated, when nobody has a
        range.
    """
    people, distances = tracked.people, tracked.distances
    markers = [_marker(_DELETE_ALL, header=header)]
    finite = np.isfinite(distances.position).all(axis=1) & np.isfinite(distances.range_sigma)
    rows = np.flatnonzero(distances.known & finite)
    if intrinsics is not None and rows.size:
        rays = intrinsics.undistort(people.keypoints[rows, :, :2])
        for row, person_rays in zip(rows, rays, strict=True):
            markers += _person(
                header, int(people.track_ids[row]), distances.position[row],
                distance=float(distances.range[row]), sigma=float(distances.range_sigma[row]),
                rays=person_rays, predicted=bool(tracked.predicted[row]))
    return MarkerArray(markers=markers)


def _person(
    header: Header, track_id: int, neck: NDArray[np.float64], *, distance: float, sigma: float,
    rays: NDArray[np.float64], predicted: bool,
) -> list[Marker]:
    """Return the markers of one person."""
    colour = _colour(track_id, opacity=PREDICTED_OPACITY if predicted else 1.0)

    person = {'header': header, 'id': track_id, 'color': colour}
    label = f'#{track_id} {distance:.2f} ± {sigma:.2f} m{PREDICTED_TEXT * predicted}'
    near, far = max(1 - sigma / distance, 0.0), 1 + sigma / distance
    markers = [
        _marker(_SPHERE, pose=Pose(position=_point(neck)), **person),
        _marker(_LABEL, text=label, **person,
                pose=Pose(position=_point(neck - (0.0, _HEAD_ROOM, 0.0)))),
        _marker(_UNCERTAINTY, points=[_point(near * neck), _point(far * neck)], **person)]
    limbs = _LIMBS[np.isfinite(rays[_LIMBS]).all(axis=(1, 2))]
    if len(limbs):
        z = float(neck[2])
        points = [Point(x=x, y=y, z=z) for x, y in (rays * z).tolist()]
        ends = limbs.ravel().tolist()
        markers.append(_marker(_SKELETON, points=[points[end] for end in ends], **person))
    return markers


def _marker(blank: Marker, **fields: object) -> Marker:
    marker = copy(blank)
    for name, value in fields.items():
        setattr(marker, name, value)
    return marker


def _point(position: NDArray[np.float64]) -> Point:
    x, y, z = position.tolist()
    return Point(x=x, y=y, z=z)


def _colour(track_id: int, *, opacity: float) -> ColorRGBA:
    blue, green, red = person_colour(track_id)
    return ColorRGBA(r=red / 255, g=green / 255, b=blue / 255, a=opacity)
