"""
Make the demo's bag from a sequence of frames with known distances.

    python demo/make_bag.py FOLDER demo/walk

FOLDER holds gt/*.json and the images they name, as `depth_person evaluate` takes them. The bag
gets the images as JPEG, their CameraInfo, and on /person_truth the true positions of the necks.
The sequence in demo/walk was rendered for this repository and is free of conditions.
"""
import argparse
import json
from pathlib import Path
import sys

import cv2
import numpy as np

from depth_person.errors import DepthPersonError
from depth_person.replay.bags import BagWriter, jazzy_types

TYPES = jazzy_types().types
FRAME_ID = 'camera_optical_frame'
START_NS = 1_780_000_000 * 10**9  # a fixed time, so that the same frames make the same bag
QUALITY = 60  # the network finds necks as well as in the originals, in half the bytes
PERSON = np.dtype([
    ('x', '<f4'), ('y', '<f4'), ('z', '<f4'), ('range', '<f4'), ('track_id', '<i4')])
POINT_FIELD_TYPES = {'<f4': 7, '<i4': 5}  # FLOAT32 and INT32 of sensor_msgs/PointField


def make(msgtype, /, **fields):
    """Return a message of the type of this name."""
    return TYPES[msgtype](**fields)


def camera_info(header, frame):
    """Return the intrinsics of a frame."""
    k = frame['K']
    matrix = np.array([k['fx'], 0, k['cx'], 0, k['fy'], k['cy'], 0, 0, 1], np.float64)
    projection = np.hstack([matrix.reshape(3, 3), np.zeros((3, 1))]).ravel()
    whole = make('sensor_msgs/msg/RegionOfInterest', x_offset=0, y_offset=0, height=0, width=0,
                 do_rectify=False)
    return make(
        'sensor_msgs/msg/CameraInfo', header=header, height=frame['height'],
        width=frame['width'], distortion_model='plumb_bob',
        d=np.array(frame['dist_plumb_bob'], np.float64), k=matrix, r=np.eye(3).ravel(),
        p=projection, binning_x=0, binning_y=0, roi=whole)


def truth(header, frame):
    """Return where the people's necks are, as a cloud like that of person_depth/people."""
    people = np.array(
        [(*person['neck_cam_m'], person['range_m'], person['id'])
         for person in frame['persons']], PERSON)
    fields = [
        make('sensor_msgs/msg/PointField', name=name, offset=PERSON.fields[name][1],
             datatype=POINT_FIELD_TYPES[PERSON[name].str], count=1)
        for name in PERSON.names]
    return make(
        'sensor_msgs/msg/PointCloud2', header=header, height=1, width=len(people), fields=fields,
        is_bigendian=False, point_step=PERSON.itemsize, row_step=people.nbytes,
        data=np.frombuffer(people.tobytes(), np.uint8), is_dense=True)


def write(folder, path):
    """Write the bag; return how many frames it has."""
    frames = [json.loads(file.read_text()) for file in sorted((folder / 'gt').glob('*.json'))]
    if not frames:
        raise DepthPersonError(f'{folder} holds no gt/*.json; give the folder of a sequence')
    with BagWriter(path) as bag:
        for frame in frames:
            stamp_ns = START_NS + round(frame['time_s'] * 1e9)
            stamp = make('builtin_interfaces/msg/Time', sec=stamp_ns // 10**9,
                         nanosec=stamp_ns % 10**9)
            header = make('std_msgs/msg/Header', stamp=stamp, frame_id=FRAME_ID)
            image = cv2.imread(str(folder / frame['image']))
            if image is None:
                raise DepthPersonError(f'{folder / frame["image"]} is no image')
            _, jpeg = cv2.imencode('.jpg', image, [
                cv2.IMWRITE_JPEG_QUALITY, QUALITY, cv2.IMWRITE_JPEG_OPTIMIZE, 1])
            picture = make('sensor_msgs/msg/CompressedImage', header=header,
                           format='bgr8; jpeg compressed bgr8', data=jpeg.ravel())
            bag.write('/camera_info', stamp_ns, camera_info(header, frame))
            bag.write('/person_truth', stamp_ns, truth(header, frame))
            bag.write('/image_raw/compressed', stamp_ns, picture)
    return len(frames)


def main():
    """Make the bag; return the exit code."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('folder', type=Path)
    parser.add_argument('bag', type=Path)
    args = parser.parse_args()
    try:
        count = write(args.folder, args.bag)
    except DepthPersonError as error:
        print(f'make_bag: {error}', file=sys.stderr)
        return 1
    size = sum(file.stat().st_size for file in args.bag.iterdir())
    print(f'{args.bag}: {count} frames, {size / 1e6:.1f} MB')
    return 0


if __name__ == '__main__':
    sys.exit(main())
