"""The test pattern: frames that come in time and say their number."""
import threading
from types import SimpleNamespace

import cv2
from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from depth_person.camera import pattern
from depth_person.camera.pattern import draw_pattern, read_number
from depth_person.camera.sources import open_source
from depth_person.errors import DepthPersonError


@given(st.integers(0, 2**24 - 1), st.integers(64, 700), st.integers(64, 300))
def test_every_frame_tells_its_number(number, width, height):
    image = draw_pattern(number, (width, height))
    assert image.shape == (height, width, 3)
    assert read_number(image) == number


@pytest.mark.parametrize('size', [(320, 240), (960, 540)])
def test_the_number_survives_jpeg_and_scaling(size):
    image = cv2.resize(draw_pattern(123_456, (1280, 720)), size, interpolation=cv2.INTER_AREA)
    _, jpeg = cv2.imencode('.jpg', image, (cv2.IMWRITE_JPEG_QUALITY, 50))
    assert read_number(cv2.imdecode(jpeg, cv2.IMREAD_COLOR)) == 123_456


def test_a_damaged_frame_has_no_number():
    image = draw_pattern(7, (320, 240))
    image[:30, 100:140] = 128
    assert read_number(image) is None


def test_two_frames_differ_all_over():
    one, other = (draw_pattern(number, (320, 240)) for number in (0, 10))
    assert np.mean(np.any(one != other, axis=-1)[30:]) > 0.9


def test_frames_come_at_their_rate_and_late_ones_are_dropped(monkeypatch):
    now = SimpleNamespace(s=0.0)

    def wait(seconds):
        now.s += seconds

    monkeypatch.setattr(pattern, 'time', SimpleNamespace(monotonic=lambda: now.s))
    monkeypatch.setattr(pattern, 'Event', lambda: SimpleNamespace(wait=wait, set=lambda: None))
    with open_source('test://320x240@50', clock=lambda: round(now.s * 1e9)) as source:
        assert source.live
        frames = [source.read() for _ in range(10)]
        wait(0.21)
        late = source.read()
    assert [read_number(frame.image) for frame in frames] == list(range(10))
    assert [frame.stamp_ns for frame in frames] == [20_000_000 * each for each in range(10)]
    assert late.image.shape == (240, 320, 3)
    assert read_number(late.image) == 19  # due since 0.38 s
    assert source.dropped == 9
    assert late.stamp_ns == 390_000_000


def test_closing_ends_a_read_that_waits():
    source = open_source('test://@0.1')
    source.read()
    threading.Timer(0.05, source.close).start()
    assert source.read() is None


def test_a_rate_may_be_given_instead():
    with open_source('test://', fps=5.0) as source:
        assert source.description == 'test pattern 1280x720 at 5 Hz'


@pytest.mark.parametrize(('spec', 'said'), [
    ('test://wide', 'no test pattern; write test://WIDTHxHEIGHT@FPS'),
    ('test://640x480@0', 'no test pattern'),
    ('test://8x8', '8x8 px is not between'),
])
def test_what_is_no_pattern_is_refused(spec, said):
    with pytest.raises(DepthPersonError, match=said):
        open_source(spec)
