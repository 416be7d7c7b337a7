"""People at their distances as visualization_msgs/MarkerArray."""
from __future__ import annotations

from builtin_interfaces.msg import Duration
from geometry_msgs.msg import Point
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
    markers = [Marker(header=header, action=Marker.DELETEALL)]
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

    def marker(namespace: str, kind: int, size: float, **fields: object) -> Marker:
        result = Marker(
            header=header, ns=namespace, id=track_id, type=kind, action=Marker.ADD,
            color=colour, lifetime=_LIFETIME, **fields)
        result.scale.x = size
        return result

    sphere = marker('person', Marker.SPHERE, 0.25)
    sphere.scale.y = sphere.scale.z = 0.25
    sphere.pose.position = _point(neck)
    label = marker(
        'label', Marker.TEXT_VIEW_FACING, 0.0,
        text=f'#{track_id} {distance:.2f} ± {sigma:.2f} m{PREDICTED_TEXT * predicted}')
    label.scale.z = 0.25
    label.pose.position = _point(neck - (0.0, _HEAD_ROOM, 0.0))
    near, far = max(1 - sigma / distance, 0.0), 1 + sigma / distance
    uncertainty = marker(
        'uncertainty', Marker.LINE_LIST, 0.04, points=[_point(near * neck), _point(far * neck)])
    markers = [sphere, label, uncertainty]
    limbs = rays[_LIMBS]
    limbs = limbs[np.isfinite(limbs).all(axis=(1, 2))].reshape(-1, 2) * neck[2]
    if len(limbs):
        markers.append(marker(
            'skeleton', Marker.LINE_LIST, 0.03,
            points=[Point(x=x, y=y, z=float(neck[2])) for x, y in limbs.tolist()]))
    return markers


def _point(position: NDArray[np.float64]) -> Point:
    x, y, z = position.tolist()
    return Point(x=x, y=y, z=z)


def _colour(track_id: int, *, opacity: float) -> ColorRGBA:
    blue, green, red = person_colour(track_id)
    return ColorRGBA(r=red / 255, g=green / 255, b=blue / 255, a=opacity)
