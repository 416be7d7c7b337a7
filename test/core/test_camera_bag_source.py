"""Rosbags as sources of frames."""
import logging

from bag_messages import camera_info, compressed, header, image, K, new, picture, string
import numpy as np
import pytest

from depth_person.camera.intrinsics import Intrinsics
from depth_person.camera.sources import open_source, SourceLost
from depth_person.errors import DepthPersonError
from depth_person.replay.bags import BagWriter

SECOND = 10**9
INTRINSICS = Intrinsics(64, 48, 300.0, 300.0, 31.5, 23.5)


def stamp(index):
    return 1000 * SECOND + index * SECOND // 10


@pytest.fixture
def write(tmp_path):
    """Return a function that writes topic and message, a tenth of a second apart, into a bag."""
    def write_bag(*messages):
        with BagWriter(tmp_path / 'bag') as writer:
            for index, (topic, message) in enumerate(messages):
                writer.write(topic, stamp(index) + 7, message)
        return str(tmp_path / 'bag')
    return write_bag


def read_all(source):
    with source:
        return list(iter(source.read, None))


def grey_of(frame):
    return round(float(frame.image.mean()))


@pytest.mark.parametrize('make', [image, compressed])
def test_frames_come_with_recorded_stamps_frames_and_intrinsics(write, make):
    bag = write(
        ('/cam/camera_info', camera_info(stamp(0))),
        *(('/cam/image', make(stamp(index), picture(50 * index))) for index in range(4)))

    source = open_source(bag, frame_id='other', clock=lambda: 1)
    frames = read_all(source)

    assert [grey_of(frame) for frame in frames] == [0, 50, 100, 150]
    assert [frame.stamp_ns for frame in frames] == [stamp(index) for index in range(4)]
    assert {frame.frame_id for frame in frames} == {'bag_optical_frame'}
    assert {frame.intrinsics for frame in frames} == {INTRINSICS}
    assert not source.live


def test_raw_images_of_a_bag_are_not_copied(write):
    bag = write(('/cam/image', image(stamp(0), picture(50))))

    frame, = read_all(open_source(bag))

    assert not frame.image.flags.owndata


def test_images_take_the_last_camera_info_before_them_or_else_the_first(write):
    def zoomed(focal_length):
        return camera_info(0, k=(focal_length, *K[1:4], focal_length, *K[5:]))

    bag = write(
        ('/cam/image', image(stamp(0), picture(0))),
        ('/cam/image', image(stamp(1), picture(0))),
        ('/cam/camera_info', zoomed(300.0)),
        ('/cam/camera_info', zoomed(400.0)),
        ('/cam/image', image(stamp(2), picture(0))))

    frames = read_all(open_source(bag))

    assert [frame.intrinsics.fx for frame in frames] == [300.0, 300.0, 400.0]


@pytest.mark.parametrize(('infos', 'expected'), [
    (['/left/camera_info', '/right/camera_info'], 300.0),
    (['/elsewhere/camera_info'], 300.0),
    (['/right/camera_info', '/elsewhere/camera_info'], None),
    ([], None),
])
def test_the_camera_info_beside_the_images_is_taken_or_the_only_one(write, infos, expected):
    bag = write(
        *((topic, camera_info(0, k=K if index == 0 else (9.0, *K[1:4], 9.0, *K[5:])))
          for index, topic in enumerate(infos)),
        ('/left/image_raw/compressed', compressed(stamp(0), picture(0))))

    frame, = read_all(open_source(bag))

    assert (frame.intrinsics and frame.intrinsics.fx) == expected


def test_several_image_topics_are_a_question_for_the_user(write):
    bag = write(
        ('/left/image', image(stamp(0), picture(10))),
        ('/right/image', compressed(stamp(0), picture(200))))

    with pytest.raises(DepthPersonError, match=r'choose by image_topic: '
                       r'/left/image \(sensor_msgs/msg/Image\), /right/image'):
        open_source(bag)
    with pytest.raises(DepthPersonError, match=r'no image topic /top; it has /left/image'):
        open_source(bag, image_topic='/top')
    for name in ('/right/image', 'right/image'):
        frame, = read_all(open_source(bag, image_topic=name))
        assert grey_of(frame) == 200


def test_a_bag_without_images_names_what_it_has(write):
    bag = write(('/text', string('hello')))

    with pytest.raises(DepthPersonError, match=r'no topic of type sensor_msgs.*; it has /text'):
        open_source(bag)


def test_a_loop_starts_over_while_time_goes_on(write):
    bag = write(*(('/image', image(stamp(index), picture(50 * index))) for index in range(3)))

    with open_source(bag, loop=True) as source:
        frames = [source.read() for _ in range(7)]

    assert [grey_of(frame) for frame in frames] == [0, 50, 100, 0, 50, 100, 0]
    assert [frame.stamp_ns for frame in frames] == [stamp(index) for index in range(7)]


def test_an_uncalibrated_camera_info_gives_no_intrinsics(write, caplog):
    bag = write(
        ('/camera_info', camera_info(0, k=(0.0,) * 9)),
        ('/image', image(stamp(0), picture(0))))

    with caplog.at_level(logging.WARNING):
        frame, = read_all(open_source(bag))

    assert frame.intrinsics is None
    assert caplog.text == ''


@pytest.mark.parametrize(('fault', 'message'), [
    ({'k': (float('nan'), *K[1:])}, 'NaN'),
    ({'k': (-1.0, *K[1:])}, 'not positive'),
    ({'width': 640, 'height': 480}, '64x48 px, but /camera_info is for 640x480 px'),
])
def test_faulty_camera_infos_are_reported_once_counted_and_not_used(
        write, caplog, fault, message):
    bag = write(*[
        ('/camera_info', camera_info(0, **fault)),
        ('/image', image(stamp(0), picture(0))),
    ] * 2)

    with caplog.at_level(logging.WARNING), open_source(bag) as source:
        frames = list(iter(source.read, None))

    assert [frame.intrinsics for frame in frames] == [None, None]
    assert source.bad_camera_infos >= 2
    assert len(caplog.records) == 1
    assert message in caplog.text


def test_images_that_cannot_be_read_are_left_out_named_and_counted(write, caplog):
    torn = compressed(stamp(1), picture(50))
    torn.data = torn.data[:100]
    bag = write(
        ('/image', compressed(stamp(0), picture(0))),
        ('/image', torn),
        ('/image', compressed(stamp(2), picture(100))))

    with caplog.at_level(logging.WARNING), open_source(bag) as source:
        frames = list(iter(source.read, None))

    assert [grey_of(frame) for frame in frames] == [0, 100]
    assert source.skipped == 1
    assert 'an image on /image is left out' in caplog.text
    assert 'torn' in caplog.text


@pytest.mark.parametrize('loop', [False, True])
def test_a_bag_of_images_in_an_unknown_encoding_is_a_fault(write, loop):
    bag = write(*[('/image', image(stamp(0), picture(0), encoding='32FC1'))] * 3)

    with open_source(bag, loop=loop) as source, \
            pytest.raises(DepthPersonError, match=r'no image on /image: .* .32FC1. is not'):
        source.read()


def test_a_topic_without_messages_is_a_fault(tmp_path):
    with BagWriter(tmp_path / 'bag') as writer:
        writer.add_topic('/image', 'sensor_msgs/msg/Image')

    with open_source(str(tmp_path / 'bag')) as source, \
            pytest.raises(DepthPersonError, match='no image on /image: it holds no message there'):
        source.read()


def test_missing_stamps_and_frames_are_filled_in(write):
    anonymous = image(0, picture(0), frame_id='')
    bag = write(('/image', anonymous))

    frame, = read_all(open_source(bag, frame_id='mine'))

    assert frame.stamp_ns == stamp(0) + 7, 'the time of recording'
    assert frame.frame_id == 'mine'


@pytest.mark.parametrize('single_file', [False, True])
def test_a_torn_bag_gives_its_frames_and_then_says_so(write, tmp_path, single_file):
    noise = np.random.default_rng(0).integers(0, 255, (480, 640, 3), np.uint8)
    bag = write(*(('/image', image(stamp(index), noise)) for index in range(10)))
    path = tmp_path / 'bag/bag.mcap'
    path.write_bytes(path.read_bytes()[:6_000_000])
    stamps = []

    with open_source(str(path) if single_file else bag) as source, \
            pytest.raises(SourceLost, match=r'bag\.mcap is cut off.*; 6 images were read'):
        stamps.extend(frame.stamp_ns for frame in iter(source.read, None))

    assert stamps == [stamp(index) for index in range(6)]


def test_a_message_that_does_not_decode_is_left_out(tmp_path):
    with BagWriter(tmp_path / 'bag') as writer:
        writer.write('/image', 1, image(stamp(0), picture(0)))
        writer.write_raw('/image', 2, b'\0\1\0\0garbage')
        writer.write('/image', 3, image(stamp(1), picture(50)))

    assert [grey_of(frame) for frame in read_all(open_source(str(tmp_path / 'bag')))] == [0, 50]


def test_a_closed_source_has_ended(write):
    source = open_source(write(('/image', image(stamp(0), picture(0)))), loop=True)
    source.read()

    source.close()
    source.close()

    assert source.read() is None


def test_other_topics_do_not_disturb(write):
    bag = write(
        ('/text', string('hello')),
        ('/tf', header(0)),
        ('/image', image(stamp(0), picture(70))),
        ('/range', new('sensor_msgs/msg/Range', header=header(0), radiation_type=0,
                       field_of_view=0.1, min_range=0.1, max_range=5.0, range=1.0, variance=0.0)))

    assert [grey_of(frame) for frame in read_all(open_source(bag))] == [70]
