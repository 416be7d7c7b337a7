"""All nodes in one process: the same numbers as in three, and a clean end."""
import signal

import cv2
import numpy as np
import pytest
from sensor_msgs.msg import CompressedImage, Image, PointCloud2

from depth_person.nodes.image_messages import stamp_ns
from depth_person.replay.bags import BagWriter, jazzy_types

STAMP = 1_600_000_000_000_000_000
STEP = 200_000_000
FRAMES = 8
WAIT = ('-p', 'wait_for_subscribers:=true')
PARAMETERS = """
/**:
  ros__parameters:
    input_size: 128
    refiner: none  # quick: the bag's frames are not to be dropped
/**/camera_node:
  ros__parameters:
    source: /nowhere
    horizontal_fov: 60
    qos_overrides./image_raw.publisher.depth: 10
pose_node:
  ros__parameters:
    qos_overrides./image_raw.subscription.reliability: reliable
/**/depth_node:
  ros__parameters:
    qos_overrides./camera_info.subscription.reliability: reliable
    qos_overrides./person_keypoints.subscription: {reliability: reliable, depth: 10}
    estimator: shoulder
    convention: movenet
    filter: false  # a frame that is dropped would tell in all after it
    max_age: 0.0  # a busy machine is late
"""


@pytest.fixture(scope='module')
def bag(folder, tmp_path_factory):
    """Return a slow bag of images without CameraInfo."""
    types = jazzy_types().types
    path = tmp_path_factory.mktemp('bag') / 'bag'
    with BagWriter(path) as writer:
        for index in range(FRAMES):
            stamp = STAMP + index * STEP
            seconds, nanoseconds = divmod(stamp, 10**9)
            picture = cv2.imread(str(folder / f'{index:02}.png'))
            header = types['std_msgs/msg/Header'](
                stamp=types['builtin_interfaces/msg/Time'](sec=seconds, nanosec=nanoseconds),
                frame_id='eye')
            writer.write('/image_raw', stamp, types['sensor_msgs/msg/Image'](
                header=header, height=picture.shape[0], width=picture.shape[1],
                encoding='bgr8', is_bigendian=0, step=3 * picture.shape[1],
                data=picture.reshape(-1)))
    return path


@pytest.fixture
def params(tmp_path):
    """Return a parameter file as config/depth_person.yaml is one."""
    path = tmp_path / 'parameters.yaml'
    path.write_text(PARAMETERS)
    return path


def measured(domain, programs):
    """Return {stamp: bytes} of the people clouds that come until the camera has ended."""
    people = domain.listen(PointCloud2, 'person_depth/people')
    *_, camera = [domain.start(*command) for command in programs]
    domain.spin_until(lambda: people)
    domain.spin_until(lambda: camera.poll() is not None)
    domain.spin_for(1.0)
    return {stamp_ns(cloud.header): bytes(cloud.data) for cloud in people
            if cloud.width and not cloud.data[36]}


def test_one_process_gives_the_numbers_of_three(domain, other_domain, bag, params):
    ros_args = ['--ros-args', '--params-file', params]
    three = measured(other_domain, [
        ['depth_node', *ros_args], ['pose_node', *ros_args],
        ['camera_node', *ros_args, '-p', f'camera_node:source:={bag}', *WAIT]])
    one = measured(domain, [
        ['depth_person', 'run', '--params', params, '--source', bag, '--ros-args', *WAIT]])
    # A busy machine may drop a frame anywhere between three processes.
    common = three.keys() & one.keys()
    assert len(common) > FRAMES / 2
    assert {stamp: three[stamp] for stamp in common} == {stamp: one[stamp] for stamp in common}
    distances = [np.frombuffer(data, np.float32)[3] for data in one.values()]
    assert 0.1 < min(distances) <= max(distances) < 1.0  # a portrait, seen from near


def test_a_run_ends_with_its_recording_and_loses_no_frame(domain, bag, params):
    people = domain.listen(PointCloud2, 'person_depth/people')
    program = domain.start(
        'depth_person', 'run', '--params', params, '--source', bag, '--ros-args', *WAIT)
    domain.spin_until(lambda: len(people) == FRAMES)
    assert program.exit_code(5) == 0
    assert 'Traceback' not in program.said


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_within_two_seconds_and_without_a_traceback(
        domain, folder, params, number):
    people = domain.listen(PointCloud2, 'person_depth/people')
    program = domain.start(
        'depth_person', 'run', '--params', params, '--source', folder, '--loop')
    domain.spin_until(lambda: people)
    program.interrupt(number)
    assert program.exit_code(2) == 0
    assert 'Traceback' not in program.said


def test_two_cameras_in_namespaces_do_not_meet(domain, folder, params):
    clouds = {}
    for name in ('front', 'rear'):
        clouds[name] = domain.listen(PointCloud2, f'{name}/person_depth/people')
        domain.start(
            'depth_person', 'run', '--params', params, '--source', folder, '--loop', '--fps', '5',
            '--ros-args', '-r', f'__ns:=/{name}', '-p', f'frame_id:={name}_eye')
    overlay = domain.listen(CompressedImage, 'front/person_depth/image/compressed')
    image = domain.listen(Image, 'rear/image_raw')
    domain.spin_until(lambda: all(clouds.values()) and overlay and image)
    for name, received in clouds.items():
        assert {cloud.header.frame_id for cloud in received} == {f'{name}_eye'}
    assert overlay[0].header.frame_id == 'front_eye'
    assert domain.node.count_publishers('/image_raw') == 0
    for name in ('front', 'rear'):
        status = domain.status(f'{name}/depth_node')
        figures = {pair.key: pair.value for pair in status.values}
        for figure in ('latency median', 'latency p95', 'latency p99', 'processing median'):
            assert 0 < float(figures[figure].removesuffix(' ms')) < 5000
        assert figures['rate'].endswith(' Hz')


def test_stamps_of_another_time_are_called_so_instead_of_a_latency(domain, bag, params):
    domain.start('depth_person', 'run', '--params', params, '--source', bag, '--loop')
    domain.listen(PointCloud2, 'person_depth/people')
    status = domain.status('depth_node', lambda status: any(
        pair.key == 'latency' for pair in status.values))
    latency = {pair.key: pair.value for pair in status.values}['latency']
    assert 'use_sim_time' in latency


def test_with_sim_time_latency_is_that_of_the_bag(domain, bag, params):
    domain.start(
        'depth_person', 'run', '--params', params, '--source', bag, '--loop', '--ros-args',
        '-p', 'use_sim_time:=true', '-p', 'publish_clock:=true')
    domain.listen(PointCloud2, 'person_depth/people')
    status = domain.status('depth_node', lambda status: any(
        pair.key == 'latency median' for pair in status.values))
    figures = {pair.key: pair.value for pair in status.values}
    assert 0 <= float(figures['latency median'].removesuffix(' ms')) < 1000


@pytest.mark.parametrize(('words', 'said'), [
    (['--params', '/nowhere.yaml'], 'there is no parameter file /nowhere.yaml'),
    (['--source', '/nowhere.mp4'], "source '/nowhere.mp4' does not exist"),
    (['--horizontal-fov', '700'], 'horizontal_fov = 700 is out of range'),
])
def test_what_can_never_work_ends_it_with_one_message(domain, words, said):
    program = domain.start('depth_person', 'run', *words, ready=said)
    assert program.exit_code() == 1
    assert 'Traceback' not in program.said
