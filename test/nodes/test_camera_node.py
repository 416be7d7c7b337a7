"""camera_node in a process of its own, heard over DDS."""
import signal

import cv2
import numpy as np
import pytest
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, CompressedImage, Image

from depth_person.camera.calibration import save_camera_info
from depth_person.camera.deblur import motion_kernel
from depth_person.camera.intrinsics import Intrinsics
from depth_person.nodes.image_messages import stamp_ns
from depth_person.replay.bags import BagWriter, jazzy_types

STAMP = 1_600_000_000_900_000_000
STEP = 100_000_000


def arguments(source, **parameters):
    """Return the command line of a camera_node that waits for a subscriber."""
    parameters = {'source': source, 'wait_for_subscribers': 'true', **parameters}
    words = [word for name, value in parameters.items() for word in ('-p', f'{name}:={value}')]
    return ['camera_node', '--ros-args', *words]


@pytest.fixture
def small_folder(folder, tmp_path):
    """Return the folder in images that DDS sends in one piece each."""
    result = tmp_path / 'small'
    result.mkdir()
    for path in folder.iterdir():
        cv2.imwrite(str(result / path.name), cv2.resize(cv2.imread(str(path)), (138, 150)))
    return result


@pytest.fixture(scope='module')
def bag(photograph, tmp_path_factory):
    """Return a bag of five JPEG images 0.1 s apart, from another year, with their CameraInfo."""
    types = jazzy_types().types
    path = tmp_path_factory.mktemp('bag') / 'bag'
    jpeg = cv2.imencode('.jpg', photograph)[1]
    height, width = photograph.shape[:2]
    with BagWriter(path) as writer:
        for index in range(5):
            seconds, nanoseconds = divmod(STAMP + index * STEP, 10**9)
            header = types['std_msgs/msg/Header'](
                stamp=types['builtin_interfaces/msg/Time'](sec=seconds, nanosec=nanoseconds),
                frame_id='drone_optical_frame')
            received = STAMP + index * STEP + 5_000_000
            writer.write('/drone/image_raw/compressed', received, types[
                'sensor_msgs/msg/CompressedImage'](header=header, format='jpeg', data=jpeg))
            writer.write('/drone/camera_info', received, types['sensor_msgs/msg/CameraInfo'](
                header=header, height=height, width=width, distortion_model='plumb_bob',
                d=np.array([0.1, 0, 0, 0, 0]),
                k=np.array([700.0, 0, 256, 0, 710, 300, 0, 0, 1]), r=np.eye(3).ravel(),
                p=np.zeros(12), binning_x=0, binning_y=0,
                roi=types['sensor_msgs/msg/RegionOfInterest'](0, 0, 0, 0, False)))
    return path


def test_every_image_of_a_folder_comes_with_its_camera_info(domain, small_folder):
    images = domain.listen(Image, 'image_raw')
    infos = domain.listen(CameraInfo, 'camera_info')
    program = domain.start(*arguments(
        small_folder, fps=5, horizontal_fov=60, frame_id='eye'))
    domain.spin_until(lambda: len(images) == 10 and len(infos) == 10)
    assert program.exit_code() == 0  # a recording that ends, ends the node
    assert [image.header for image in images] == [info.header for info in infos]
    assert images[0].header.frame_id == 'eye'
    steps = np.diff([stamp_ns(image.header) for image in images])
    assert steps == pytest.approx(200_000_000)
    first = images[0]
    picture = cv2.imread(str(small_folder / '00.png'))
    assert (first.height, first.width, first.step) == (*picture.shape[:2], 3 * picture.shape[1])
    assert first.encoding == 'bgr8'
    assert bytes(first.data) == picture.tobytes()
    focal_length = picture.shape[1] / 2 / np.tan(np.radians(30))
    assert infos[0].k[0] == infos[0].k[4] == pytest.approx(focal_length)
    assert (infos[0].width, infos[0].height) == (picture.shape[1], picture.shape[0])
    assert infos[0].p[0] == infos[0].k[0]


def test_a_bag_keeps_its_stamps_frame_and_intrinsics_and_drives_the_clock(domain, bag):
    images = domain.listen(CompressedImage, 'image_raw/compressed')
    infos = domain.listen(CameraInfo, 'camera_info')
    clocks = domain.listen(Clock, '/clock')
    program = domain.start(*arguments(bag, publish_clock='true'))
    domain.spin_until(lambda: program.poll() is not None)
    domain.spin_for(0.5)
    assert program.exit_code() == 0
    assert [stamp_ns(image.header) for image in images] == [
        STAMP + index * STEP for index in range(5)]
    assert {image.header.frame_id for image in images} == {'drone_optical_frame'}
    assert infos[0].k.tolist() == [700.0, 0, 256, 0, 710, 300, 0, 0, 1]
    assert infos[0].d.tolist() == [0.1, 0, 0, 0, 0]
    picture = cv2.imdecode(np.frombuffer(images[0].data, np.uint8), cv2.IMREAD_COLOR)
    assert picture.shape == (600, 512, 3)
    times = [clock.clock.sec * 10**9 + clock.clock.nanosec for clock in clocks]
    assert times == sorted(times)
    assert times[-1] == STAMP + 4 * STEP
    assert len(times) > 10  # between the frames, too


@pytest.mark.parametrize(('size', 'said'), [
    (None, 'the camera is uncalibrated'),
    ((640, 480), 'the calibration is for 640x480 px, the images have 552x600'),
])
def test_without_a_fitting_calibration_it_says_so_and_publishes_none(
        domain, folder, tmp_path, size, said):
    parameters = {}
    if size is not None:
        parameters['camera_info_url'] = f'file://{tmp_path}/eye.yaml'
        save_camera_info(
            tmp_path / 'eye.yaml', 'eye',
            Intrinsics.from_horizontal_fov(60, width=size[0], height=size[1]))
    infos = domain.listen(CameraInfo, 'camera_info')
    domain.listen(Image, 'image_raw')
    program = domain.start(*arguments(folder, **parameters))
    domain.spin_until(lambda: infos)
    assert (infos[0].k == 0).all()
    assert (infos[0].width, infos[0].height) == (552, 600)
    program.hears(said)
    program.exit_code()
    assert program.said.count(said) == 1


@pytest.mark.parametrize(('parameters', 'said'), [
    ({'source': "''"}, 'no source is given'),
    ({'source': '/nowhere/flight.mp4'}, "source '/nowhere/flight.mp4' does not exist"),
    ({'source': '/dev/null', 'camera_info_url': '/nowhere/eye.yaml'}, '/nowhere/eye.yaml'),
    ({'source': '/dev/null', 'horizontal_fov': '400'}, 'horizontal_fov = 400 is out of range'),
    ({'source': '/dev/null', 'loop': 'often'}, "loop takes a bool, not 'often'"),
])
def test_what_can_never_work_ends_it_with_one_message(domain, parameters, said):
    program = domain.start(*arguments(**{'wait_for_subscribers': 'false', **parameters}),
                           ready=said)
    assert program.exit_code() == 1
    assert 'Traceback' not in program.said
    assert program.said.count('\n') <= 2


def test_a_misspelt_parameter_is_reported(domain, folder):
    domain.start(*arguments(folder, horizontal_fow=60), ready='did you mean horizontal_fov?')


def test_a_camera_that_is_not_there_yet_is_tried_again_and_again(domain):
    program = domain.start(*arguments('/dev/video97', wait_for_subscribers='false'))
    program.hears('there is no camera /dev/video97')
    status = domain.fault('camera_node', 'trying again in 4 s')
    assert {pair.key: pair.value for pair in status.values}['reconnects'] == '4'
    program.interrupt(signal.SIGTERM)
    assert program.exit_code(5) == 0
    assert 'Traceback' not in program.said


def test_ctrl_c_while_a_stream_is_being_opened_ends_it_all_the_same(domain):
    """OpenCV then sits in a call of five seconds that nothing can end."""
    program = domain.start(*arguments('udp://127.0.0.1:9', wait_for_subscribers='false'))
    domain.spin_for(0.5)
    program.interrupt()
    assert program.exit_code(4) == 0
    assert 'Traceback' not in program.said
    assert 'terminate' not in program.said


def test_a_camera_node_that_is_started_again_is_heard_again(domain, folder):
    images = domain.listen(Image, 'image_raw')
    program = domain.start(*arguments(folder, loop='true', wait_for_subscribers='false'))
    domain.spin_until(lambda: images)
    program.kill()
    domain.spin_for(0.2)
    del images[:]
    program = domain.start(*arguments(folder, loop='true', wait_for_subscribers='false'))
    domain.spin_until(lambda: images)
    program.interrupt()
    assert program.exit_code(5) == 0
    assert 'Traceback' not in program.said


def test_a_known_motion_blur_is_undone(domain, photograph, tmp_path):
    blurred = cv2.filter2D(photograph, -1, motion_kernel(12.0, 30.0))
    cv2.imwrite(str(tmp_path / 'blurred.png'), blurred)
    images = domain.listen(Image, 'image_raw')
    domain.start(*arguments(tmp_path, motion_blur=12, motion_blur_angle=30))
    domain.spin_until(lambda: images)
    published = np.frombuffer(images[0].data, np.uint8).reshape(photograph.shape)

    def error(image):
        return np.abs(image.astype(float) - photograph).mean()

    assert error(published) < 0.7 * error(blurred)
