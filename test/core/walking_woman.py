"""Frames of a photographed woman, before grey."""
from __future__ import annotations

import cv2
import numpy as np
import skimage.data

from depth_person.camera.frame import Frame


def picture(*places, side=150):
    """Return a 480x640 image with the same woman at places, each her upper left corner."""
    woman = cv2.resize(skimage.data.astronaut()[..., ::-1], (side, side))
    image = np.full((480, 640, 3), 90, np.uint8)
    for x, y in places:
        image[y:y + side, x:x + side] = woman
    return image


def frame(image, time_s=0.0):
    return Frame(image, stamp_ns=round(time_s * 1e9), frame_id='camera_optical_frame')
