"""Crops come from halves of a part of the frame as if all of the frame had been halved."""
from __future__ import annotations

import cv2
import numpy as np
import pytest

from depth_person.pose.cutting import CropCutter

SIDE = 64
#: Centre and side of crops for which the frame is halved twice, twice, once and not at all.
CROPS = [(300.0, 200.0, 300.0), (420.2, 260.4, 512.0), (120.3, 90.7, 200.0), (600.0, 350.0, 90.0)]


def frame(size, seed):
    noise = np.random.default_rng(seed).integers(0, 256, (*size[::-1], 3), np.uint8)
    return cv2.GaussianBlur(noise, (3, 3), 0)


def cut(cutter, image, crops):
    places = np.array(crops, np.float32)
    return cutter.cut(image, places[:, :2], places[:, 2]).copy()


@pytest.mark.parametrize('size', [(640, 384), (642, 386), (641, 387)])
@pytest.mark.parametrize('moved', [(0, 0), (-290.6, -190.2), (333.3, 180.5), (-1500, 10)])
@pytest.mark.parametrize('chosen', [[0], [2], [3], [0, 2], [0, 1, 2, 3]])
def test_crops_do_not_depend_on_how_much_is_halved(size, moved, chosen):
    crops = [(CROPS[index][0] + moved[0], CROPS[index][1] + moved[1], CROPS[index][2])
             for index in chosen]
    corners = [(0.0, 0.0, 500.0), (*size, 500.0)]  # so that all of the frame is halved
    cutter, image = CropCutter(SIDE), frame(size, seed=1)
    whole = cut(CropCutter(SIDE), image, [*crops, *corners])
    cut(cutter, frame(size, seed=2), corners)  # what is left of it in the buffers shows nowhere
    np.testing.assert_array_equal(cut(cutter, image, crops), whole[:len(crops)])


def test_a_crop_is_the_mean_of_the_pixels_that_it_joins():
    image = frame((640, 384), seed=1)
    crop = cut(CropCutter(SIDE), image, [(319.5, 191.5, 256.0)])[0]
    blocks = image[64:320, 192:448, ::-1].reshape(SIDE, 4, SIDE, 4, 3)
    np.testing.assert_allclose(crop, blocks.mean((1, 3)), atol=1.5)


def test_frames_of_another_size_are_cut_anew():
    cutter = CropCutter(SIDE)
    for size in ((640, 384), (320, 240), (642, 386)):
        image = frame(size, seed=3)
        np.testing.assert_array_equal(
            cut(cutter, image, CROPS), cut(CropCutter(SIDE), image, CROPS))
