"""Nominal intrinsics of common cameras in their common modes, from documented figures."""
from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import yaml

from depth_person.camera.intrinsics import Intrinsics
from depth_person.errors import DepthPersonError

_FOLDER = Path(__file__).parent / 'presets'


def preset_names() -> list[str]:
    """Return the names of all presets: CAMERA/WIDTHxHEIGHT."""
    return [f'{camera}/{mode}' for camera in _cameras() for mode in _read(camera)['modes']]


def load_preset(name: str) -> tuple[str, Intrinsics]:
    """
    Return a camera's name and its nominal intrinsics, without distortion.

    :param name: CAMERA/WIDTHxHEIGHT; a mode belongs to it, since many crop the sensor.
    :raises DepthPersonError: when there is none of that name; lists what there is.
    """
    camera, _, mode = name.partition('/')
    if camera not in _cameras():
        raise DepthPersonError(
            f'there is no preset for camera {camera!r}; there are {", ".join(_cameras())}; others '
            'have to be calibrated')
    document = _read(camera)
    if mode not in document['modes']:
        raise DepthPersonError(
            f'preset {camera} has no mode {mode!r}; it has {", ".join(document["modes"])}; a mode '
            'that is not listed may be cropped, so it has to be calibrated')
    width, height = map(int, mode.split('x'))
    crop_width, crop_height = document['modes'][mode]
    focal_length = _focal_length(document)
    return document['camera'], Intrinsics(
        width, height, focal_length * width / crop_width, focal_length * height / crop_height,
        (width - 1) / 2, (height - 1) / 2)


def preset_uncertainty(name: str) -> float:
    """Return the standard deviation of a preset's focal length over it."""
    return float(_read(name.partition('/')[0])['uncertainty_percent']) / 100


def _focal_length(document: dict[str, Any]) -> float:
    """Return the focal length in pixels of the whole sensor, or of the largest mode."""
    if 'focal_length_px' in document:
        return float(document['focal_length_px'])
    if 'focal_length_mm' in document:
        return 1000 * float(document['focal_length_mm']) / float(document['pixel_um'])
    width, height = document['size']
    if 'horizontal_fov_deg' in document:
        return width / 2 / math.tan(math.radians(document['horizontal_fov_deg']) / 2)
    return math.hypot(width, height) / 2 / math.tan(math.radians(document['diagonal_fov_deg']) / 2)


def _cameras() -> list[str]:
    return sorted(file.stem for file in _FOLDER.glob('*.yaml'))


def _read(camera: str) -> dict[str, Any]:
    return yaml.safe_load((_FOLDER / f'{camera}.yaml').read_text(encoding='utf-8'))
