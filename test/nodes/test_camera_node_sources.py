"""camera_node on live sources and with calibrations of every kind, heard over DDS."""
from dataclasses import replace
import socket
import time

import imageio_ffmpeg
import pytest
from senders import free_port
from sensor_msgs.msg import CameraInfo, CompressedImage, Image
from sensor_msgs.srv import SetCameraInfo
from streams import Stream

from depth_person.camera.calibration import load_camera_info, save_camera_info
from depth_person.camera.intrinsics import Intrinsics
from depth_person.nodes.image_messages import encode_camera_info, header, stamp_ns

KNOWN = Intrinsics(
    320, 240, 301.0, 302.0, 161.0, 119.0, 'rational_polynomial', (0.1, 0, 0, 0, 0, 0.2, 0, 0))


def arguments(source, **parameters):
    """Return the command line of a camera_node that starts at once."""
    words = [word for name, value in {'source': source, **parameters}.items()
             for word in ('-p', f'{name}:={value}')]
    return ['camera_node', '--ros-args', *words]


def set_camera_info(domain, intrinsics):
    """Hand a calibration over as a calibration tool does; return the answer."""
    client = domain.node.create_client(SetCameraInfo, 'set_camera_info')
    domain.spin_until(client.service_is_ready)
    message = encode_camera_info(
        intrinsics, header(stamp_ns=0, frame_id='eye'),
        width=intrinsics.width if intrinsics else 320, height=240)
    answer = client.call_async(SetCameraInfo.Request(camera_info=message))
    domain.spin_until(answer.done)
    return answer.result()


def test_a_calibration_that_is_handed_over_is_written_and_used(domain, tmp_path):
    domain.environment['ROS_HOME'] = str(tmp_path / 'ros')
    infos = domain.listen(CameraInfo, 'camera_info')
    domain.start(*arguments('test://320x240@20'))
    domain.spin_until(lambda: infos and infos[-1].k[0] == 0)

    empty = set_camera_info(domain, None)
    other = set_camera_info(domain, replace(KNOWN, width=640))
    answer = set_camera_info(domain, KNOWN)

    assert 'for 640x240 px, the images have 320x240; it is not taken' in other.status_message
    assert not other.success
    assert not empty.success
    assert 'empty' in empty.status_message
    assert answer.success
    path = tmp_path / 'ros' / 'camera_info' / 'camera.yaml'
    assert f'for the next start set camera_info_url to file://{path}' in answer.status_message
    assert load_camera_info(str(path))[1] == KNOWN
    domain.spin_until(lambda: infos[-1].k[0] == KNOWN.fx)
    assert infos[-1].distortion_model == 'rational_polynomial'
    assert list(infos[-1].d) == list(KNOWN.distortion)


def test_a_calibration_is_handed_over_into_the_file_that_is_named(domain, tmp_path):
    path = tmp_path / 'eye.yaml'
    save_camera_info(path, 'eye', Intrinsics.from_horizontal_fov(60, width=320, height=240))
    domain.start(*arguments('test://320x240@20', camera_info_url=path))

    answer = set_camera_info(domain, KNOWN)

    assert answer.status_message == f'written to {path}'
    assert load_camera_info(str(path))[1] == KNOWN


def test_a_preset_is_scaled_down_with_the_images(domain):
    images = domain.listen(Image, 'image_raw')
    infos = domain.listen(CameraInfo, 'camera_info')
    program = domain.start(*arguments(
        'test://1280x720@10', camera_info_url='preset://logitech_c920/1280x720',
        image_width=320))
    domain.spin_until(lambda: images and infos)
    assert (images[0].width, images[0].height) == (320, 180)
    assert (infos[0].width, infos[0].height) == (320, 180)
    assert infos[0].k[0] == pytest.approx(906.77 / 4, abs=0.01)
    assert 'nominal, the focal length is good to about 5 %' in program.said


def test_a_known_delay_goes_into_the_stamps_and_may_be_changed(domain):
    images = domain.listen(Image, 'image_raw')
    domain.start(*arguments('test://320x240@20', time_offset=-5.0))
    domain.spin_until(lambda: images)
    assert 5.0 <= (time.time_ns() - stamp_ns(images[-1].header)) * 1e-9 < 7.0
    assert domain.set_parameter('camera_node', 'time_offset', 0.0).successful
    domain.spin_until(lambda: time.time_ns() - stamp_ns(images[-1].header) < 2e9)


def test_jpeg_is_made_for_subscribers(domain):
    images = domain.listen(CompressedImage, 'image_raw/compressed')
    domain.start(*arguments('test://320x240@20'))
    domain.spin_until(lambda: images)
    assert bytes(images[0].data[:2]) == b'\xff\xd8'


@pytest.mark.parametrize(('parameters', 'said'), [
    ({'source': '/dev/null'}, '/dev/null is no camera'),
    ({'source': 'test://8x8'}, 'a test pattern of 8x8 px'),
    ({'source': 'test://', 'camera_info_url': 'preset://none/1x1'}, 'there is no preset'),
])
def test_what_no_waiting_brings_ends_it_with_one_message(domain, parameters, said):
    program = domain.start(*arguments(**parameters), ready=said)
    assert program.exit_code() == 1
    assert 'Traceback' not in program.said


def test_a_password_reaches_neither_log_nor_diagnostics(domain):
    port = free_port(socket.SOCK_STREAM)
    program = domain.start(*arguments(f'rtsp://me:hunter%32@127.0.0.1:{port}/live'))
    status = domain.fault('camera_node', 'refuses connections')
    assert 'rtsp://me:***@127.0.0.1' in status.message
    program.hears('refuses connections')
    assert 'hunter' not in program.said + str(status)


def test_a_stream_that_is_lost_is_reported_and_opened_again(domain, tmp_path):
    images = domain.listen(Image, 'image_raw')
    with Stream('rtsp-tcp', imageio_ffmpeg.get_ffmpeg_exe(), tmp_path) as stream:
        domain.start(*arguments(stream.source, timeout=1.0, horizontal_fov=60))
        domain.spin_until(lambda: images)
        stream.stop()
        domain.fault('camera_node', 'trying again in')
        domain.spin_for(0.5)
        count, before_ns = len(images), stamp_ns(images[-1].header)
        stream.start()
        domain.spin_until(lambda: len(images) > count)
        domain.healthy('camera_node')
    assert stamp_ns(images[count].header) - before_ns > 0.5e9  # nothing of before the loss


def test_one_process_says_that_it_has_no_use_for_compressed_images(domain):
    program = domain.start('depth_person', 'run', '--source', 'test://320x240@5', '--ros-args',
                           '-p', 'compressed:=true')
    domain.fault('pose_node', 'compressed has no effect in one process')
    domain.fault('depth_node', 'compressed has no effect in one process')
    assert 'Traceback' not in program.said
