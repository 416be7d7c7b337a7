"""From the bytes of image messages to BGR."""
import array

import cv2
import numpy as np
import pytest

from depth_person.camera.encodings import decode_compressed, to_bgr
from depth_person.errors import DepthPersonError

# Two rows of two pixels, as (b, g, r).
BLUE, GREEN, RED, WHITE = (255, 0, 0), (0, 255, 0), (0, 0, 255), (255, 255, 255)
BGR = np.array([[BLUE, GREEN], [RED, WHITE]], np.uint8)


def pixels(*values):
    return np.array(values, np.uint8).tobytes()


@pytest.mark.parametrize(('encoding', 'data', 'step'), [
    ('bgr8', BGR.tobytes(), 6),
    ('8UC3', BGR.tobytes(), 6),
    ('rgb8', BGR[..., ::-1].tobytes(), 6),
    ('bgra8', pixels([(*BLUE, 9), (*GREEN, 9)], [(*RED, 9), (*WHITE, 9)]), 8),
    ('rgba8', pixels([(*BLUE[::-1], 9), (*GREEN, 9)], [(*RED[::-1], 9), (*WHITE, 9)]), 8),
])
def test_packed_colours(encoding, data, step):
    image = to_bgr(data, encoding=encoding, height=2, width=2, step=step)

    np.testing.assert_array_equal(image, BGR)


@pytest.mark.parametrize(('encoding', 'data', 'step', 'is_bigendian'), [
    ('mono8', bytes([0, 100, 200, 255]), 2, False),
    ('8UC1', bytes([0, 100, 200, 255]), 2, False),
    ('mono16', np.array([0, 100, 200, 255], '<u2') * 256 + 7, 4, False),
    ('mono16', (np.array([0, 100, 200, 255], '<u2') * 256 + 7).astype('>u2'), 4, True),
])
def test_greys_become_colours(encoding, data, step, is_bigendian):
    image = to_bgr(bytes(data), encoding=encoding, height=2, width=2, step=step,
                   is_bigendian=is_bigendian)

    np.testing.assert_array_equal(image, np.repeat([[[0], [100]], [[200], [255]]], 3, axis=2))


# Y 81, U 90, V 240 is red by BT.601; Y 16 and 235 with U = V = 128 are black and white.
@pytest.mark.parametrize(('encoding', 'pair'), [
    ('yuv422', (90, 81, 240, 81)),
    ('uyvy', (90, 81, 240, 81)),
    ('yuyv', (81, 90, 81, 240)),
    ('yuv422_yuy2', (81, 90, 81, 240)),
])
def test_yuv_pairs(encoding, pair):
    grey = {81: 235, 90: 128, 240: 128}
    data = pixels(pair, [grey[value] for value in pair])

    image = to_bgr(data, encoding=encoding, height=2, width=2, step=4)

    np.testing.assert_allclose(image, [[RED, RED], [WHITE, WHITE]], atol=2)


@pytest.mark.parametrize(('encoding', 'chroma'), [('nv12', (90, 240)), ('nv21', (240, 90))])
def test_yuv_planes(encoding, chroma):
    data = pixels([81, 81], [81, 81], chroma)

    image = to_bgr(data, encoding=encoding, height=2, width=2, step=2)

    np.testing.assert_allclose(image, np.full((2, 2, 3), RED), atol=2)


@pytest.mark.parametrize('pattern', ['rggb', 'bggr', 'gbrg', 'grbg'])
@pytest.mark.parametrize('colour', ['r', 'g', 'b'])
def test_bayer_patterns_light_up_their_own_colour(pattern, colour):
    tile = np.array([255 * (letter == colour) for letter in pattern], np.uint8).reshape(2, 2)

    image = to_bgr(np.tile(tile, (8, 8)).tobytes(), encoding=f'bayer_{pattern}8', height=16,
                   width=16, step=16)

    np.testing.assert_array_equal(image[8, 8], [255 * (colour == letter) for letter in 'bgr'])


@pytest.mark.parametrize(('encoding', 'row_bytes'), [
    ('bgr8', 15), ('rgb8', 15), ('rgba8', 20), ('mono8', 5), ('mono16', 10), ('bayer_rggb8', 5),
])
def test_padding_at_the_end_of_rows_is_skipped(encoding, row_bytes):
    rows = np.random.default_rng(0).integers(0, 255, (6, row_bytes), np.uint8)
    padded = np.hstack((rows, np.full((6, 7), 99, np.uint8)))

    image = to_bgr(padded.tobytes(), encoding=encoding, height=6, width=5, step=row_bytes + 7)

    plain = to_bgr(rows.tobytes(), encoding=encoding, height=6, width=5, step=row_bytes)
    np.testing.assert_array_equal(image, plain)
    assert image.flags.c_contiguous


def test_padded_yuv_planes_are_read():
    rows = np.random.default_rng(0).integers(0, 255, (6, 4), np.uint8)
    padded = np.hstack((rows, np.full((6, 3), 99, np.uint8)))

    image = to_bgr(padded.tobytes(), encoding='nv12', height=4, width=4, step=7)

    plain = to_bgr(rows.tobytes(), encoding='nv12', height=4, width=4, step=4)
    np.testing.assert_array_equal(image, plain)


@pytest.mark.parametrize('container', [bytes, bytearray, memoryview, np.array])
def test_bgr8_is_not_copied(container):
    data = container(BGR.ravel() if container is np.array else BGR.tobytes())

    image = to_bgr(data, encoding='bgr8', height=2, width=2, step=6)

    assert np.shares_memory(image, np.frombuffer(data, np.uint8))


def test_the_data_of_rclpy_messages_is_read():
    data = array.array('B', BGR.tobytes())

    np.testing.assert_array_equal(
        to_bgr(data, encoding='bgr8', height=2, width=2, step=6), BGR)


@pytest.mark.parametrize(('changes', 'message'), [
    ({'height': 0}, '2x0 px is empty'),
    ({'width': 0}, '0x2 px is empty'),
    ({'encoding': '32FC1'}, "'32FC1' is not supported"),
    ({'encoding': ''}, "'' is not supported"),
    ({'step': 5}, 'step 5 is smaller than its row of 6 bytes'),
    ({'step': 0}, 'step 0 is smaller'),
    ({'height': 3}, '12 bytes is too short for 3 rows of 6 bytes'),
    ({'data': b''}, '0 bytes is too short'),
    ({'encoding': 'yuyv', 'width': 3, 'step': 6}, '3x2 px is not possible in encoding yuyv'),
    ({'encoding': 'nv12', 'height': 3, 'step': 2}, '2x3 px is not possible in encoding nv12'),
    ({'encoding': 'nv12', 'width': 3, 'step': 3}, '3x2 px is not possible in encoding nv12'),
])
def test_what_is_no_image_is_refused_in_one_line(changes, message):
    fields = {'data': BGR.tobytes(), 'encoding': 'bgr8', 'height': 2, 'width': 2, 'step': 6}

    with pytest.raises(DepthPersonError, match=message) as caught:
        to_bgr(**{**fields, **changes})

    assert '\n' not in str(caught.value)


def picture():
    ramp = np.linspace(0, 255, 64, dtype=np.uint8)
    return np.dstack(np.broadcast_arrays(ramp[:, None], ramp[None, :], np.uint8(60)))


@pytest.mark.parametrize('kind', ['jpg', 'png', 'webp', 'bmp'])
def test_compressed_images_are_decoded(kind):
    _, data = cv2.imencode('.' + kind, picture())

    np.testing.assert_allclose(decode_compressed(data.tobytes(), kind), picture(), atol=12)


@pytest.mark.parametrize('depth', [np.uint8, np.uint16])
def test_grey_pngs_become_colours_of_8_bits(depth):
    grey = np.full((4, 6), 100, depth) * (257 if depth == np.uint16 else 1)
    _, data = cv2.imencode('.png', grey)

    np.testing.assert_array_equal(decode_compressed(data), np.full((4, 6, 3), 100))


@pytest.mark.parametrize('padding', [b'\0' * 5000, b'\xff' * 100])
def test_padding_behind_a_jpeg_is_no_fault(padding):
    data = cv2.imencode('.jpg', picture())[1].tobytes() + padding

    assert decode_compressed(data).shape == (64, 64, 3)


@pytest.mark.parametrize('kind', ['jpg', 'png', 'webp'])
@pytest.mark.parametrize('left', [0.0, 0.02, 0.5, 0.95])
def test_torn_images_are_refused_without_noise(kind, left, capfd):
    data = cv2.imencode('.' + kind, picture())[1].tobytes()

    with pytest.raises(DepthPersonError, match=r'torn|corrupt'):
        decode_compressed(data[:int(left * len(data))], kind)

    assert kind == 'png' or capfd.readouterr().err == ''  # libpng writes straight to stderr


def test_the_format_of_an_unknown_kind_is_named():
    with pytest.raises(DepthPersonError, match="format '16UC1; compressedDepth png'"):
        decode_compressed(b'\x00' * 12 + b'whatever', '16UC1; compressedDepth png')
