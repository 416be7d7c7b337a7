"""A depth_node in a process of its own, and what it is fed."""
import struct

from sensor_msgs.msg import CameraInfo, PointCloud2, PointField

#: Nothing that a test publishes is lost on its way to the node.
RELIABLE = ('--ros-args', *(
    word for topic in ('camera_info', 'person_keypoints') for word in (
        '-p', f'qos_overrides./{topic}.subscription.reliability:=reliable')))
FACE_TO_FACE = {  # shoulders 90 px apart, at f = 900 px
    0: (640, 300), 1: (640, 360), 2: (595, 360), 5: (685, 360), 8: (610, 500), 11: (670, 500)}
#: A person 1.75 m tall, 6 m ahead of a camera at f = 900 px that is level, 1.5 m high.
STANDING = {
    0: (640, 352), 1: (640, 375), 2: (618, 375), 5: (662, 375), 8: (625, 450), 11: (655, 450),
    9: (625, 518), 12: (655, 518), 10: (625, 570), 13: (655, 570), 14: (637, 348), 15: (643, 348)}
#: Where a person's cues are in person_depth/people, and the one of the ground.
CUES, GROUND = 37, 8


def camera_info(width=1280, height=720, focal_length=900.0, frame_id='camera_optical_frame'):
    message = CameraInfo(width=width, height=height, distortion_model='plumb_bob', d=[0.0] * 5)
    message.header.frame_id = frame_id
    message.k = [focal_length, 0.0, 640.0, 0.0, focal_length, 360.0, 0.0, 0.0, 1.0]
    return message


def keypoints(*people, second=7):
    """Return the cloud of people given as {row: (u, v)}, packed by hand."""
    message = PointCloud2(
        height=len(people), width=18, point_step=16, row_step=288, is_dense=False,
        fields=[PointField(name=name, offset=offset, datatype=datatype, count=1)
                for name, offset, datatype in (
                    ('u', 0, 7), ('v', 4, 7), ('score', 8, 7), ('track_id', 12, 5))])
    nothing = (float('nan'),) * 3
    message.data = b''.join(
        struct.pack('<fffi', *((*rows[row], 0.9) if row in rows else nothing), track_id)
        for track_id, rows in enumerate(people, start=3) for row in range(18))
    message.header.frame_id = 'camera_optical_frame'
    message.header.stamp.sec = second
    message.header.stamp.nanosec = 123456789
    return message


class DepthNode:
    """
    A running depth_node and both ends of its topics.

    :param options: more of its command line.
    :param outputs: types of messages by the topics to listen to.
    :param parameters: of the node.
    """

    def __init__(self, domain, *options, outputs, **parameters):
        self.domain = domain
        self.program = domain.start('depth_node', *options, **parameters)
        self.outputs = {topic: domain.listen(kind, topic) for topic, kind in outputs.items()}
        self.camera_info = domain.publisher(CameraInfo, 'camera_info')
        self.keypoints = domain.publisher(PointCloud2, 'person_keypoints')
        domain.spin_until(lambda: all(map(domain.node.count_publishers, outputs)))
        domain.spin_for(0.5)

    def forget(self):
        """Forget what has come."""
        for messages in self.outputs.values():
            messages.clear()
