"""Messages are serialised as another library does, with zeros in all gaps between fields."""
from bag_messages import camera_info, header, new
import numpy as np
import pytest

from depth_person.replay.bags import jazzy_types
from depth_person.replay.cdr import Serializer


def point(x):
    return new('geometry_msgs/msg/Point', x=x, y=2.5, z=-3.5)


def marker(text, points):
    def triple(msgtype):
        return new(msgtype, x=1.5, y=2.5, z=3.5)

    return new(
        'visualization_msgs/msg/Marker', header=header(5, 'eye'), ns=text, id=7, type=2, action=1,
        pose=new('geometry_msgs/msg/Pose', position=point(1.5), orientation=new(
            'geometry_msgs/msg/Quaternion', x=0.5, y=0.5, z=0.5, w=0.5)),
        scale=triple('geometry_msgs/msg/Vector3'),
        color=new('std_msgs/msg/ColorRGBA', r=1.0, g=0.5, b=0.25, a=1.0),
        lifetime=new('builtin_interfaces/msg/Duration', sec=1, nanosec=2), frame_locked=True,
        points=[point(float(index)) for index in range(points)], colors=[], texture_resource='t',
        texture=new('sensor_msgs/msg/CompressedImage', header=header(6, 'a'), format='png',
                    data=np.arange(3, dtype=np.uint8)),
        uv_coordinates=[], text=text, mesh_resource='m', mesh_file=new(
            'visualization_msgs/msg/MeshFile', filename='f', data=np.arange(5, dtype=np.uint8)),
        mesh_use_embedded_materials=True)


def status(name, pairs):
    return new(
        'diagnostic_msgs/msg/DiagnosticStatus', level=2, name=name, message='it ' + name,
        hardware_id='', values=[
            new('diagnostic_msgs/msg/KeyValue', key='k' * index, value='v')
            for index in range(pairs)])


MESSAGES = [
    header(5, 'a'), header(5, 'abcdefg'), camera_info(5),
    new('visualization_msgs/msg/MarkerArray', markers=[
        marker('a', 0), marker('label 4.32', 3), marker('', 1)]),
    new('diagnostic_msgs/msg/DiagnosticArray', header=header(5), status=[
        status('x', 3), status('odd', 0), status('', 1)]),
    new('sensor_msgs/msg/LaserScan', header=header(5, 'ab'), angle_min=0.5, angle_max=1.0,
        angle_increment=0.1, time_increment=0.2, scan_time=0.3, range_min=0.4, range_max=9.0,
        ranges=np.arange(1, 4, dtype=np.float32), intensities=np.empty(0, np.float32)),
    new('sensor_msgs/msg/JointState', header=header(5), name=['a', 'abcd', ''],
        position=np.arange(3.0), velocity=np.empty(0), effort=np.arange(2.0)),
    new('std_msgs/msg/Float64MultiArray', data=np.arange(3.0), layout=new(
        'std_msgs/msg/MultiArrayLayout', dim=[], data_offset=3)),
]


@pytest.mark.parametrize('message', MESSAGES, ids=lambda message: message.__msgtype__)
def test_the_bytes_are_those_that_rosbags_writes(message):
    msgtype = message.__msgtype__
    types = jazzy_types()
    assert Serializer(types).serialize(message, msgtype) == types.serialize_cdr(message, msgtype)
