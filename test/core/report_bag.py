"""Writes a bag of images, keypoints, results and truth, for the tests of report."""
from __future__ import annotations

from pathlib import Path

from average_body import seen, standing_at
from bag_messages import camera_info, compressed, new, picture
import numpy as np
from result_bags import cloud, people, START_NS, STEP_NS, TOPIC

from depth_person.replay.bags import BagWriter

FRAMES = 12
WIDTH, HEIGHT = 640, 360
K = (450.0, 0.0, 319.5, 0.0, 450.0, 179.5, 0.0, 0.0, 1.0)
KEYPOINT = np.dtype([('u', '<f4'), ('v', '<f4'), ('score', '<f4'), ('track_id', '<i4')])


def true_place(index: int) -> tuple[float, float, float]:
    """Return where the one person is, metres."""
    return 0.3, 0.1, 4.0 + 0.1 * index


def write_report_bag(
    path: Path, *, too_far: float = 1.1, sigma: float = 0.3, delay_ns: int = 0,
    images: bool = True,
) -> Path:
    """
    Write the bag; return its path.

    :param too_far: by this factor every result is.
    :param delay_ns: from the stamp to the recording of results.
    """
    with BagWriter(path) as bag:
        for index in range(FRAMES):
            stamp = START_NS + index * STEP_NS
            place = np.array(true_place(index))
            bag.write('/person_truth', stamp, cloud(stamp, people((*place, 0.0, 5))))
            found = people((*(too_far * place), sigma, 1))
            bag.write(TOPIC, stamp + delay_ns, cloud(stamp, found))
            if images:
                bag.write('/camera_info', stamp, camera_info(
                    stamp, width=WIDTH, height=HEIGHT, k=K))
                bag.write('/image_raw/compressed', stamp, compressed(
                    stamp, picture(100 + index, width=WIDTH, height=HEIGHT)))
                bag.write('/person_keypoints', stamp, keypoints(stamp, place))
    return path


def keypoints(stamp_ns: int, place: np.ndarray):
    """Return the keypoints of an average body in an image half as large as average_body's."""
    skeleton = seen(standing_at(place)).keypoints[0]
    points = np.zeros((1, 18), KEYPOINT)
    points['u'], points['v'], points['score'] = (skeleton / (2, 2, 1)).T
    points['track_id'] = 1
    return new(
        'sensor_msgs/msg/PointCloud2', header=cloud(stamp_ns, people()).header, height=1,
        width=18, fields=[
            new('sensor_msgs/msg/PointField', name=name, offset=4 * index,
                datatype=5 if name == 'track_id' else 7, count=1)
            for index, name in enumerate(KEYPOINT.names)],
        is_bigendian=False, point_step=16, row_step=18 * 16,
        data=np.frombuffer(points.tobytes(), np.uint8), is_dense=False)
