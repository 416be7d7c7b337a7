"""Live sources: the newest frame, and a loss that is noticed."""
import socket
import subprocess
import threading
import time

import imageio_ffmpeg
import numpy as np
import pytest
from senders import free_port

from depth_person.camera.live import LiveSource
from depth_person.camera.source import mask_password
from depth_person.camera.sources import open_source, SourceLost
from depth_person.camera.stamps import ArrivalStamps
from depth_person.errors import DepthPersonError


class FakeCamera:
    """A driver that gives frames as it is told to, and then blocks or ends."""

    def __init__(self):
        self.given = threading.Semaphore(0)
        self.index = -1
        self.released = threading.Event()
        self._last = threading.Event()

    def give(self, count=1):
        self.given.release(count)

    def end(self):
        self._last.set()
        self.given.release()

    def grab(self):
        self.given.acquire()
        self.index += 1
        return not self._last.is_set()

    def retrieve(self):
        return True, np.full((4, 4, 3), self.index, np.uint8)

    def get(self, prop):
        return 0.0

    def release(self):
        self.released.set()


@pytest.fixture
def camera():
    camera = FakeCamera()
    yield camera
    camera.end()  # lets the thread go


def open_fake(camera, timeout_s=0.2, **options):
    return LiveSource(camera, description='camera fake', frame_id='optical',
                      clock=options.get('clock', time.time_ns), timeout_s=timeout_s,
                      stamps=ArrivalStamps())


def wait_until(condition):
    deadline = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.001)


def test_only_the_newest_frame_is_given_and_the_rest_counted(camera):
    source = open_fake(camera)
    camera.give(5)
    wait_until(lambda: source.dropped == 4)

    frame = source.read()

    assert frame.image[0, 0, 0] == 4
    assert frame.frame_id == 'optical'
    assert source.live


def test_a_frame_is_stamped_when_it_arrives_not_when_it_is_read(camera):
    times = iter([100, 200, 300])
    source = open_fake(camera, clock=lambda: next(times))
    camera.give(2)
    wait_until(lambda: source.dropped == 1)
    time.sleep(0.05)

    assert source.read().stamp_ns == 200


def test_no_frame_is_given_twice(camera):
    source = open_fake(camera, timeout_s=5.0)
    camera.give()
    source.read()
    threading.Timer(0.05, camera.give).start()

    assert source.read().image[0, 0, 0] == 1


def test_a_driver_that_blocks_is_noticed_within_the_timeout(camera):
    source = open_fake(camera, timeout_s=0.2)
    camera.give(3)
    wait_until(lambda: source.dropped == 2)
    source.read()
    start = time.monotonic()

    with pytest.raises(SourceLost, match=r'fake is lost after 3 frames: no frame for 0\.2 s'):
        source.read()

    assert time.monotonic() - start < 3


def test_a_stream_that_ends_is_noticed_at_once(camera):
    source = open_fake(camera, timeout_s=30.0)
    camera.give()
    source.read()
    threading.Timer(0.05, camera.end).start()
    start = time.monotonic()

    with pytest.raises(SourceLost, match='it has stopped sending'):
        source.read()

    assert time.monotonic() - start < 5
    assert camera.released.is_set()


def test_closing_is_prompt_and_ends_a_read_that_waits(camera):
    source = open_fake(camera, timeout_s=30.0)
    frames = []
    reader = threading.Thread(target=lambda: frames.append(source.read()))
    reader.start()
    threading.Thread(target=lambda: (reader.join(), camera.end())).start()
    start = time.monotonic()

    source.close()
    source.close()

    assert time.monotonic() - start < 15
    assert frames == [None]
    assert camera.released.is_set()
    assert source.read() is None


def test_closing_does_not_wait_for_a_driver_that_hangs(camera):
    source = open_fake(camera, timeout_s=0.2)
    start = time.monotonic()

    source.close()

    assert time.monotonic() - start < 2


@pytest.mark.parametrize(('url', 'masked'), [
    ('rtsp://admin:hunter2@host:554/live', 'rtsp://admin:***@host:554/live'),
    ('rtsp://admin:p@ss/word:1@host/live', 'rtsp://admin:***@host/live'),
    ('rtsp://host:554/live', 'rtsp://host:554/live'),
    ('http://host/mjpeg?user=me&password=hunter2&x=1', 'http://host/mjpeg?user=me&password=***&x=1'),
    ('http://host/mjpeg?access_token=hunter2', 'http://host/mjpeg?access_token=***'),
    ('udp://0.0.0.0:5000', 'udp://0.0.0.0:5000'),
])
def test_passwords_are_masked(url, masked):
    assert mask_password(url) == masked


@pytest.mark.parametrize('path', ['/live', '/film.mp4'])
def test_a_refused_stream_is_reported_without_its_password(path, capfd):
    scheme = 'http' if path.endswith('.mp4') else 'rtsp'
    port = free_port(socket.SOCK_STREAM)

    with pytest.raises(DepthPersonError, match=r'//me:\*\*\*@127') as caught:
        open_source(f'{scheme}://me:hunter2@127.0.0.1:{port}{path}')

    written = capfd.readouterr()
    assert 'hunter2' not in str(caught.value) + written.out + written.err


@pytest.fixture
def stream():
    """Send MPEG-TS over UDP, 25 frames a second; yields the URL and the sender."""
    url = f'udp://127.0.0.1:{free_port()}'
    sender = subprocess.Popen(
        [imageio_ffmpeg.get_ffmpeg_exe(), '-v', 'error', '-re', '-f', 'lavfi',
         '-i', 'testsrc=size=320x240:rate=25', '-c:v', 'mpeg4', '-g', '5', '-f', 'mpegts',
         f'{url}?pkt_size=1316'], stdin=subprocess.DEVNULL)
    yield url, sender
    sender.kill()
    sender.wait()


def test_a_udp_stream_is_read_newest_first_and_its_loss_noticed(stream):
    url, sender = stream
    with open_source(url, timeout_s=1.0) as source:
        assert source.read().image.shape == (240, 320, 3)
        before = source.dropped
        time.sleep(1.0)  # a consumer slower than the camera

        frame = source.read()

        assert time.time_ns() - frame.stamp_ns < 0.5e9
        assert source.dropped - before >= 8
        sender.kill()
        start = time.monotonic()
        with pytest.raises(SourceLost, match='is lost after'):
            list(iter(source.read, None))
        assert time.monotonic() - start < 4
    assert source.read() is None
