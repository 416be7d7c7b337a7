"""Makes results, in bags and without, for the tests of compare and report."""
from __future__ import annotations

from pathlib import Path
from typing import Any

from bag_messages import header, new
import numpy as np

from depth_person.replay.bags import BagWriter
from depth_person.replay.results import gather, PersonRows, Results

START_NS = 1_700_000_000 * 10**9
STEP_NS = 100_000_000
TOPIC = '/person_depth/people'
POINT = np.dtype([
    *((name, '<f4') for name in ('x', 'y', 'z', 'range', 'range_sigma')), ('track_id', '<i4')])
_TYPES = {'<f4': 7, '<i4': 5}


def cloud(stamp_ns: int, points: np.ndarray) -> Any:
    """Return a row of points as a message."""
    return new(
        'sensor_msgs/msg/PointCloud2', header=header(stamp_ns), height=1, width=len(points),
        fields=[
            new('sensor_msgs/msg/PointField', name=name, offset=points.dtype.fields[name][1],
                datatype=_TYPES[points.dtype[name].str], count=1)
            for name in points.dtype.names],
        is_bigendian=False, point_step=points.itemsize, row_step=points.nbytes,
        data=np.frombuffer(points.tobytes(), np.uint8), is_dense=False)


def people(*rows) -> np.ndarray:
    """Return points of (x, y, z, sigma, id)."""
    return np.array(
        [(x, y, z, np.linalg.norm((x, y, z)), sigma, track_id)
         for x, y, z, sigma, track_id in rows], POINT)


def results(frames) -> Results:
    """Return what reading a bag of these frames gives."""
    stamps = [START_NS + index * STEP_NS for index in range(len(frames))]
    return gather('results', {
        stamp: (stamp, PersonRows.of_points(people(*rows), 0))
        for stamp, rows in zip(stamps, frames, strict=True)})


def write_results(path: Path, frames, *, topic: str = TOPIC, stamps_ns=None) -> Path:
    """Write a bag with one message for the people of each frame; return its path."""
    with BagWriter(path) as bag:
        for index, rows in enumerate(frames):
            stamp = START_NS + index * STEP_NS if stamps_ns is None else stamps_ns[index]
            bag.write(topic, START_NS + index * STEP_NS, cloud(stamp, people(*rows)))
    return path
