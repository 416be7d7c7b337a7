"""Crops show what lies where they say, whatever they shrink and wherever they reach."""
from __future__ import annotations

import math

import cv2
from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from depth_person.pose.cutting import CropCutter

SIDE = 64
#: Centre and side of crops for which the frame shrinks to a quarter, a quarter, a half, and not.
CROPS = [(300.0, 200.0, 300.0), (420.2, 260.4, 512.0), (120.3, 90.7, 200.0), (600.0, 350.0, 90.0)]


def frame(size, seed):
    noise = np.random.default_rng(seed).integers(0, 256, (*size[::-1], 3), np.uint8)
    return cv2.GaussianBlur(noise, (3, 3), 0)


def cut(cutter, image, crops):
    places = np.array(crops, np.float32)
    made = cutter.cut(image, places[:, :2], places[:, 2])
    return made._replace(images=made.images.copy())


@pytest.mark.parametrize('size', [(640, 384), (641, 387)])
@pytest.mark.parametrize('moved', [(0, 0), (-290.6, -190.2), (333.3, 180.5), (-1500, 10)])
def test_crops_do_not_depend_on_others_nor_on_those_before(size, moved):
    crops = [(x + moved[0], y + moved[1], side) for x, y, side in CROPS]
    cutter, image = CropCutter(SIDE), frame(size, seed=1)
    cut(cutter, frame(size, seed=2), CROPS)
    together = cut(cutter, image, crops)
    for index, crop in enumerate(crops):
        alone = cut(CropCutter(SIDE), image, [crop])
        for each, all_of_them in zip(alone, together, strict=True):
            np.testing.assert_array_equal(each[0], all_of_them[index])


@settings(max_examples=60, deadline=None)
@given(
    spot=st.tuples(st.floats(150, 490), st.floats(150, 230)), side=st.floats(40, 600),
    off=st.tuples(st.floats(-0.25, 0.25), st.floats(-0.25, 0.25)))
def test_a_spot_lies_in_the_crop_where_the_crop_says(spot, side, off):
    """So do crops that reach beyond the frame."""
    width = 0.05 * side
    rows, columns = np.indices((384, 640))
    image = 250 * np.exp(
        -((columns - spot[0]) ** 2 + (rows - spot[1]) ** 2) / (2 * width ** 2))
    image = np.repeat(np.rint(image).astype(np.uint8)[..., None], 3, 2)
    wanted = np.array(spot) + np.multiply(off, side)
    crops = cut(CropCutter(SIDE), image, [(*wanted, side)])
    pixel = 2 ** max(math.ceil(math.log2(side / SIDE)) - 1, 0)  # of what the frame shrinks to
    assert np.abs(crops.centres[0] - wanted).max() <= pixel / 2 + 1e-3
    assert abs(crops.sides[0] - side) <= pixel / 2 + 1e-3
    seen = crops.images[0, ..., 0].astype(float)
    rows, columns = np.indices(seen.shape)
    found = np.array([np.average(columns, weights=seen), np.average(rows, weights=seen)])
    expected = SIDE * (0.5 + (spot - crops.centres[0]) / crops.sides[0]) - 0.5
    np.testing.assert_allclose(found, expected, atol=0.1)


def test_what_is_beyond_the_frame_is_black():
    image = np.full((100, 100, 3), 200, np.uint8)
    crop, = cut(CropCutter(SIDE), image, [(0.0, 0.0, 64.0)]).images
    assert (crop[33:, 33:] == 200).all()
    assert not crop[:31].any()
    assert not crop[:, :31].any()
    crop, = cut(CropCutter(SIDE), image, [(100.0, 100.0, 64.0)]).images
    assert (crop[:31, :31] == 200).all()
    assert not crop[33:].any()
    assert not crop[:, 33:].any()


@pytest.mark.parametrize('place', [(-400, 50), (400, 50), (50, -400), (50, 400)])
@pytest.mark.parametrize('side', [50, 64, 100, 300])
def test_nothing_is_seen_of_a_frame_that_is_elsewhere(place, side):
    cutter, white = CropCutter(SIDE), np.full((100, 100, 3), 255, np.uint8)
    assert cut(cutter, white, [(50.0, 50.0, side)]).images.any()
    assert not cut(cutter, white, [(*place, side)]).images.any()


def test_a_crop_is_the_mean_of_the_pixels_that_it_joins():
    image = frame((640, 384), seed=1)
    crop, = cut(CropCutter(SIDE), image, [(319.5, 191.5, 256.0)]).images
    blocks = image[64:320, 192:448, ::-1].reshape(SIDE, 4, SIDE, 4, 3)
    np.testing.assert_allclose(crop, blocks.mean((1, 3)), atol=1.5)


def test_frames_of_another_size_are_cut_anew():
    cutter = CropCutter(SIDE)
    for size in ((640, 384), (320, 240), (642, 386)):
        image = frame(size, seed=3)
        np.testing.assert_array_equal(
            cut(cutter, image, CROPS).images, cut(CropCutter(SIDE), image, CROPS).images)
