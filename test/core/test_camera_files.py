"""Video files and folders of images as sources of frames."""
import logging

import cv2
import numpy as np
import pytest

from depth_person.camera.sources import is_live, open_source, SourceLost
from depth_person.errors import DepthPersonError

FPS = 25.0
SECOND = 10**9


def numbered_image(index):
    """Return an image whose brightness tells its number."""
    return np.full((48, 64, 3), 10 * (index % 25), np.uint8)


def number_of(frame):
    return round(float(frame.image.mean()) / 10)


def write_video(path, count, *, codec='MJPG', fps=FPS):
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*codec), fps, (64, 48))
    assert writer.isOpened()
    for index in range(count):
        writer.write(numbered_image(index))
    writer.release()
    return path


def write_images(folder, count, suffix='.png'):
    folder.mkdir(exist_ok=True)
    for index in range(count):
        cv2.imwrite(str(folder / f'{index:03d}{suffix}'), numbered_image(index))
    return folder


def read_all(source):
    with source:
        return list(iter(source.read, None))


@pytest.mark.parametrize(('suffix', 'codec'), [('avi', 'MJPG'), ('mp4', 'mp4v'), ('mkv', 'MJPG')])
def test_a_video_gives_its_frames_in_order_at_its_rate(tmp_path, suffix, codec):
    path = write_video(tmp_path / f'walk.{suffix}', 20, codec=codec)

    source = open_source(str(path), frame_id='front_optical_frame', clock=lambda: 5 * SECOND)
    frames = read_all(source)

    assert [number_of(frame) for frame in frames] == list(range(20))
    assert [frame.stamp_ns for frame in frames] == \
        [5 * SECOND + index * SECOND // 25 for index in range(20)]
    assert {frame.frame_id for frame in frames} == {'front_optical_frame'}
    assert frames[0].image.shape == (48, 64, 3)
    assert frames[0].intrinsics is None
    assert not source.live
    assert source.read() is None


def test_a_rate_may_be_given_instead(tmp_path):
    path = write_video(tmp_path / 'walk.avi', 3)

    frames = read_all(open_source(str(path), fps=10.0, clock=lambda: 0))

    assert [frame.stamp_ns for frame in frames] == [0, SECOND // 10, SECOND // 5]


@pytest.mark.parametrize('kind', ['video', 'folder'])
def test_a_loop_starts_over_while_time_goes_on(tmp_path, kind):
    path = (write_video(tmp_path / 'walk.avi', 4) if kind == 'video'
            else write_images(tmp_path / 'images', 4))

    with open_source(str(path), loop=True, fps=20.0, clock=lambda: 0) as source:
        frames = [source.read() for _ in range(10)]

    assert [number_of(frame) for frame in frames] == [0, 1, 2, 3, 0, 1, 2, 3, 0, 1]
    assert [frame.stamp_ns for frame in frames] == [index * SECOND // 20 for index in range(10)]


def test_frames_are_not_overwritten_by_later_ones(tmp_path):
    with open_source(str(write_video(tmp_path / 'walk.avi', 10))) as source:
        first = source.read()
        before = first.image.copy()
        for _ in range(9):
            source.read()

    np.testing.assert_array_equal(first.image, before)


@pytest.mark.parametrize('suffix', ['avi', 'mkv'])
def test_a_torn_video_gives_its_frames_and_then_says_so(tmp_path, suffix):
    path = write_video(tmp_path / f'walk.{suffix}', 60)
    data = path.read_bytes()
    path.write_bytes(data[:len(data) // 2])

    numbers = []
    with open_source(str(path)) as source, \
            pytest.raises(SourceLost, match=r'is torn: \d+ of 60 frames') as caught:
        numbers.extend(map(number_of, iter(source.read, None)))

    assert f'{len(numbers)} of 60 frames' in str(caught.value)
    assert 15 < len(numbers) < 45
    assert numbers == [index % 25 for index in range(len(numbers))]


@pytest.mark.parametrize('content', [b'', b'no video at all' * 100])
def test_a_file_of_another_kind_is_refused_without_noise(tmp_path, content, capfd):
    path = tmp_path / 'walk.mp4'
    path.write_bytes(content)

    with pytest.raises(DepthPersonError, match=r'walk\.mp4 cannot be read as a video'):
        open_source(str(path))

    assert capfd.readouterr().err == ''


def test_a_video_cut_before_its_index_is_refused(tmp_path):
    path = write_video(tmp_path / 'walk.mp4', 30, codec='mp4v')
    data = path.read_bytes()
    path.write_bytes(data[:len(data) // 2])

    with pytest.raises(DepthPersonError, match='cannot be read as a video: it is torn'):
        open_source(str(path))


def test_a_file_name_with_a_colon_is_no_url(tmp_path, monkeypatch):
    write_video(tmp_path / 'walk.avi', 2).rename(tmp_path / 'rtsp:12:30.avi')
    monkeypatch.chdir(tmp_path)

    assert len(read_all(open_source('rtsp:12:30.avi'))) == 2


def test_a_file_url_is_a_path(tmp_path):
    path = write_video(tmp_path / 'a walk.avi', 2)

    assert len(read_all(open_source(path.as_uri()))) == 2


def test_a_folder_gives_its_images_in_the_order_of_their_names(tmp_path):
    folder = write_images(tmp_path / 'images', 12)
    (folder / 'notes.txt').write_text('not an image')

    source = open_source(str(folder), fps=10.0, clock=lambda: SECOND)
    frames = read_all(source)

    assert [number_of(frame) for frame in frames] == list(range(12))
    assert [frame.stamp_ns for frame in frames] == \
        [SECOND + index * SECOND // 10 for index in range(12)]
    assert not source.live


def test_corrupt_images_are_left_out_named_and_counted(tmp_path, caplog):
    folder = write_images(tmp_path / 'images', 6)
    (folder / '001.png').write_bytes(b'')
    (folder / '004.png').write_bytes((folder / '004.png').read_bytes()[:60])

    with caplog.at_level(logging.WARNING), open_source(str(folder), clock=lambda: 0) as source:
        frames = list(iter(source.read, None))

    assert [number_of(frame) for frame in frames] == [0, 2, 3, 5]
    assert [round(frame.stamp_ns * 30 / SECOND) for frame in frames] == [0, 2, 3, 5]
    assert source.skipped == 2
    assert len(caplog.records) == 1
    assert '001.png' in caplog.text


@pytest.mark.parametrize('loop', [False, True])
def test_a_folder_of_nothing_but_corrupt_images_is_a_fault(tmp_path, loop):
    folder = write_images(tmp_path / 'images', 3)
    for path in folder.iterdir():
        path.write_bytes(b'\x89PNG torn')

    with open_source(str(folder), loop=loop) as source, \
            pytest.raises(DepthPersonError, match=r'none of the 3 images .*; 002\.png'):
        source.read()


def test_an_empty_folder_is_refused(tmp_path):
    with pytest.raises(DepthPersonError, match=r'holds no images .* and no rosbag'):
        open_source(str(tmp_path))


@pytest.mark.parametrize('kind', ['video', 'folder'])
def test_a_closed_source_has_ended(tmp_path, kind):
    path = (write_video(tmp_path / 'walk.avi', 20) if kind == 'video'
            else write_images(tmp_path / 'images', 20))
    source = open_source(str(path), loop=True)
    source.read()

    source.close()
    source.close()

    assert source.read() is None


@pytest.mark.parametrize(('spec', 'message'), [
    ('', "'' does not exist; give a video file"),
    ('nowhere/walk.mp4', "'nowhere/walk.mp4' does not exist"),
    ('a\0b', 'does not exist'),
    ('/dev/video97', 'no camera /dev/video97; .*/dev/video'),
    ('97', 'no camera /dev/video97; .*/dev/video'),
    ('gopher://host/x', 'gopher://host/x cannot be opened; known are rtsp'),
])
def test_what_is_no_source_is_refused(spec, message):
    with pytest.raises(DepthPersonError, match=message):
        open_source(spec)


def test_a_device_that_is_no_camera_is_refused_without_noise(capfd):
    with pytest.raises(DepthPersonError, match='/dev/null is no camera'):
        open_source('/dev/null')

    assert capfd.readouterr().err == ''


@pytest.mark.parametrize('fps', [0.0, -5.0, float('nan'), 1e9])
def test_an_impossible_rate_is_refused(tmp_path, fps):
    with pytest.raises(DepthPersonError, match='frames a second'):
        open_source(str(write_images(tmp_path / 'images', 1)), fps=fps)


@pytest.mark.parametrize(('spec', 'live'), [
    ('/dev/video0', True), ('/dev/null', True), ('0', True), ('rtsp://host/path', True),
    ('udp://@:5000', True), ('RTSP://host/path', True), ('http://host/mjpeg', True),
    ('cam.sdp', True), ('test://', True), ('v4l2src ! videoconvert ! appsink', True),
    ('http://host/a.mp4?x=1', False),
    ('flight.mp4', False), ('/data/bag', False), ('file:///data/flight.mp4', False),
    ('gopher://host', False), ('', False)])
def test_devices_and_streams_may_come_later(spec, live):
    assert is_live(spec) == live
