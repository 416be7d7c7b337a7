"""Images are fitted, positions mapped back and doubles dropped without a shift."""
from __future__ import annotations

from drawn_heads import FIGURE
from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from depth_person.pose.movenet import Letterbox, one_per_person


@pytest.mark.parametrize(('width', 'height', 'fitted', 'network'), [
    (1280, 720, (512, 288), (288, 512)),
    (640, 480, (512, 384), (384, 512)),
    (480, 640, (384, 512), (512, 384)),
    (1920, 1080, (512, 288), (288, 512)),
    (1000, 700, (512, 358), (384, 512)),
    (100, 7, (512, 36), (64, 512)),
    (1, 1, (512, 512), (512, 512)),
])
def test_the_network_sees_the_whole_image_in_multiples_of_32(width, height, fitted, network):
    letterbox = Letterbox(512, step=32)
    image = letterbox.fill(np.full((height, width, 3), 255, np.uint8))
    assert letterbox.size == fitted
    assert image.shape == (1, *network, 3)
    assert (image[0, :fitted[1], :fitted[0]] == 255).all()
    assert not image[0, fitted[1]:].any()
    assert not image[0, :, fitted[0]:].any()


def test_the_network_sees_red_green_and_blue_in_its_own_order():
    image = Letterbox(32, step=32).fill(np.full((32, 32, 3), (1, 2, 3), np.uint8))
    assert image[0, 5, 5].tolist() == [3, 2, 1]


@pytest.mark.parametrize('long_side', [256, 512, 640, 1280])
@pytest.mark.parametrize(('width', 'height'), [(1280, 720), (1000, 700), (720, 1280)])
def test_a_spot_is_mapped_back_to_the_pixel_it_came_from(width, height, long_side):
    """Half a pixel is what a wrong convention costs; this sees a tenth."""
    u, v = 0.37 * width, 0.61 * height
    rows, columns = np.indices((height, width))
    spot = 255 * np.exp(-((columns - u) ** 2 + (rows - v) ** 2) / (2 * 12 ** 2))
    letterbox = Letterbox(long_side, step=32)
    seen = letterbox.fill(np.repeat(spot[..., None], 3, 2).astype(np.uint8))[0, ..., 0]
    rows, columns = np.indices(seen.shape)
    # Centres of mass count pixel centres at integers: from the corner that is half a pixel more.
    centre = np.array([np.average(columns, weights=seen), np.average(rows, weights=seen)]) + 0.5
    np.testing.assert_allclose(
        letterbox.to_raw(centre.astype(np.float32)), [u, v], atol=0.1)


def test_the_corners_of_the_image_come_back():
    letterbox = Letterbox(512, step=32)
    letterbox.fill(np.zeros((700, 1000, 3), np.uint8))
    corners = np.array([[0, 0], letterbox.size], np.float32)
    np.testing.assert_allclose(
        letterbox.to_raw(corners), [[-0.5, -0.5], [999.5, 699.5]], atol=1e-4)


def test_the_buffer_is_kept_from_frame_to_frame_and_follows_a_new_size():
    letterbox = Letterbox(64, step=32)
    first = letterbox.fill(np.full((64, 64, 3), 9, np.uint8))
    assert letterbox.fill(np.full((64, 64, 3), 7, np.uint8)) is first
    assert (first == 7).all()
    assert letterbox.fill(np.zeros((32, 64, 3), np.uint8)).shape == (1, 32, 64, 3)


def test_an_image_that_may_not_be_written_or_is_part_of_another_is_taken():
    image = np.zeros((64, 80, 3), np.uint8)
    image[:, 40:] = 200
    part = image[:, 40:]
    part.flags.writeable = False
    assert (Letterbox(64, step=32).fill(part)[0, :, :40] == 200).all()


def skeleton(x=0.0, y=0.0, *, size=1.0, missing=()):
    keypoints = np.column_stack([FIGURE * size + (x, y), np.ones(17)]).astype(np.float32)
    keypoints[list(missing)] = np.nan
    low, high = np.nanmin(keypoints[:, :2], 0), np.nanmax(keypoints[:, :2], 0)
    return keypoints, np.concatenate([low, high])


def kept(*skeletons):
    keypoints, boxes = (np.stack(part) for part in zip(*skeletons, strict=True))
    return one_per_person(keypoints, boxes).tolist()


@pytest.mark.parametrize(('second', 'expected'), [
    (skeleton(), [0]),  # the same
    (skeleton(0.5, 0.5), [0]),  # a cell beside
    (skeleton(missing=range(11, 17)), [0]),  # the same, legs hidden
    (skeleton(5, 0), [0, 1]),  # a body's breadth beside
    (skeleton(0, -3, size=0.6), [0, 1]),  # somebody smaller, behind
    (skeleton(60, 0), [0, 1]),
])
def test_one_person_gives_one_skeleton(second, expected):
    assert kept(skeleton(), second) == expected


def test_the_earlier_of_two_doubles_is_kept():
    assert kept(skeleton(40), skeleton(0.3), skeleton(), skeleton(40.2)) == [0, 1]


def test_nobody_is_one_per_person():
    assert one_per_person(np.empty((0, 17, 3), np.float32), np.empty((0, 4))).shape == (0,)


@settings(max_examples=30)
@given(scale=st.floats(0.5, 50), x=st.floats(-50, 50))
def test_what_counts_as_double_does_not_depend_on_the_size_in_the_image(scale, x):
    beside = skeleton(x * scale, 0, size=scale)
    assert kept(skeleton(size=scale), beside) == kept(skeleton(), skeleton(x, 0))
