"""Images and intrinsics as messages."""
from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, RegionOfInterest
from std_msgs.msg import Header

from depth_person.camera.intrinsics import Intrinsics
from depth_person.errors import DepthPersonError
from depth_person.nodes.image_messages import (
    decode_camera_info,
    decode_image,
    encode_camera_info,
    encode_image,
    encode_jpeg,
    header,
    image_size,
    stamp_ns,
)

HEADER = header(stamp_ns=1_999_999_999, frame_id='eye')
K = [800.0, 0.0, 320.0, 0.0, 810.0, 240.0, 0.0, 0.0, 1.0]


@given(st.integers(0, 2**31 * 10**9 - 1))
def test_stamps_survive(nanoseconds):
    message = header(stamp_ns=nanoseconds, frame_id='eye')
    assert 0 <= message.stamp.nanosec < 10**9
    assert stamp_ns(message) == nanoseconds


def test_an_image_is_its_rows_one_after_the_other():
    image = np.arange(2 * 3 * 3, dtype=np.uint8).reshape(2, 3, 3)
    message = encode_image(image, HEADER)
    assert (message.height, message.width, message.step, message.encoding) == (2, 3, 9, 'bgr8')
    assert list(message.data) == list(range(18))
    assert message.header == HEADER


@pytest.mark.parametrize('view', [
    lambda image: image[:, ::-1], lambda image: image[::2], lambda image: image[:, 1:4]])
def test_views_of_images_survive(view):
    image = view(np.random.default_rng(0).integers(0, 256, (6, 8, 3), np.uint8))
    frame = decode_image(encode_image(image, HEADER))
    assert (frame.image == image).all()
    assert (frame.stamp_ns, frame.frame_id) == (1_999_999_999, 'eye')
    assert frame.intrinsics is None


def test_a_decoded_image_shares_the_bytes_of_its_message():
    message = encode_image(np.zeros((4, 4, 3), np.uint8), HEADER)
    frame = decode_image(message)
    message.data[0] = 7
    assert frame.image[0, 0, 0] == 7


def test_a_jpeg_image_survives_about():
    image = np.full((16, 24, 3), (30, 120, 200), np.uint8)
    message = encode_jpeg(image, HEADER, quality=95)
    assert message.format == 'bgr8; jpeg compressed bgr8'
    assert image_size(message) == (24, 16)
    assert decode_image(message).image == pytest.approx(image, abs=4)


def test_bad_images_are_refused():
    with pytest.raises(DepthPersonError, match='empty'):
        decode_image(Image(encoding='bgr8'))
    with pytest.raises(DepthPersonError, match='cannot be decoded'):
        decode_image(CompressedImage(format='jpeg', data=b'no picture'))


@pytest.mark.parametrize(('model', 'distortion'), [
    ('plumb_bob', (0.1, -0.2, 0.01, 0.02, 0.3)),
    ('rational_polynomial', (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8)),
    ('equidistant', (0.1, 0.2, 0.3, 0.4)),
])
def test_intrinsics_survive(model, distortion):
    intrinsics = Intrinsics(640, 480, 800.5, 810.25, 320.0, 240.0, model, distortion)
    message = encode_camera_info(intrinsics, HEADER, width=640, height=480)
    assert message.header == HEADER
    assert message.p.tolist() == [800.5, 0, 320, 0, 0, 810.25, 240, 0, 0, 0, 1, 0]
    assert message.r.tolist() == np.eye(3).ravel().tolist()
    assert decode_camera_info(message) == intrinsics


def test_no_intrinsics_are_an_uncalibrated_message_of_the_size():
    message = encode_camera_info(None, Header(), width=640, height=480)
    assert (message.width, message.height) == (640, 480)
    assert not message.k.any()
    assert decode_camera_info(message) is None


def test_a_region_of_interest_and_binning_are_those_of_rep_104():
    message = CameraInfo(
        width=640, height=480, distortion_model='plumb_bob', d=[0.0] * 5, k=K, binning_x=2,
        binning_y=4, roi=RegionOfInterest(x_offset=100, y_offset=40, width=320, height=240))
    intrinsics = decode_camera_info(message)
    assert (intrinsics.width, intrinsics.height) == (160, 60)
    assert (intrinsics.fx, intrinsics.fy) == (400.0, 202.5)
    # Pixel 219.5 of the full image is 119.5 of the region: the middle of its bin 59.75.
    assert intrinsics.cx == pytest.approx((320 - 100 + 0.5) / 2 - 0.5)
    assert intrinsics.cy == pytest.approx((240 - 40 + 0.5) / 4 - 0.5)


@pytest.mark.parametrize('broken', [
    {'k': [float('nan'), *K[1:]]}, {'k': [-800.0, *K[1:]]}, {'width': 0},
    {'distortion_model': 'thin_prism'}, {'d': [float('inf'), 0.0, 0.0, 0.0, 0.0]},
])
def test_impossible_intrinsics_are_refused(broken):
    fields = {'width': 640, 'height': 480, 'distortion_model': 'plumb_bob', 'd': [0.0] * 5,
              'k': K, **broken}
    with pytest.raises(DepthPersonError):
        decode_camera_info(CameraInfo(**fields))
