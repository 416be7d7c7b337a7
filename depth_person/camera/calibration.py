"""Camera calibration files: the YAML of ROS's camera_calibration, found by URL."""
from __future__ import annotations

import os
from pathlib import Path
import re
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray
import yaml

from depth_person.camera.intrinsics import Intrinsics
from depth_person.camera.presets import load_preset
from depth_person.errors import DepthPersonError
from depth_person.files import write_text


def load_camera_info(url: str, *, camera_name: str = 'camera') -> tuple[str, Intrinsics]:
    """
    Read a calibration file.

    :param url: a path, a URL as resolve_url takes it, or preset://CAMERA/WIDTHxHEIGHT.
    :param camera_name: what ${NAME} in the URL stands for, and the name of a camera whose file
        gives none.
    :returns: the camera's name and its intrinsics.
    :raises DepthPersonError: naming the file and the key at fault.
    """
    if is_preset(url):
        return load_preset(url.partition('://')[2])
    path = resolve_url(url, camera_name=camera_name)
    try:
        document = yaml.safe_load(path.read_text(encoding='utf-8'))
    except (OSError, UnicodeDecodeError) as error:
        raise DepthPersonError(f'calibration {path} cannot be read: {error}') from error
    except yaml.YAMLError as error:
        reason = ' '.join(str(error).split())
        raise DepthPersonError(f'calibration {path} is not YAML: {reason}') from error
    if not isinstance(document, dict):
        raise DepthPersonError(
            f'calibration {path} holds no keys such as image_width and camera_matrix; '
            'write it with camera_calibration')
    try:
        intrinsics = _parse(document)
    except DepthPersonError as error:
        raise DepthPersonError(f'calibration {path}: {error}') from error
    return str(document.get('camera_name') or camera_name), intrinsics


def is_preset(url: str) -> bool:
    """Return whether a URL names a preset, which is nobody's to change."""
    return url.startswith('preset://')


def save_camera_info(path: str | Path, camera_name: str, intrinsics: Intrinsics) -> None:
    """
    Write a calibration file; a crash in between leaves the file that was there before.

    :raises DepthPersonError: when the file cannot be written.
    """
    projection = np.column_stack((intrinsics.matrix, np.zeros(3)))
    document = {
        'image_width': intrinsics.width,
        'image_height': intrinsics.height,
        'camera_name': camera_name,
        'camera_matrix': _matrix_node(intrinsics.matrix),
        'distortion_model': intrinsics.distortion_model,
        'distortion_coefficients': _matrix_node(np.array([intrinsics.distortion])),
        'rectification_matrix': _matrix_node(np.eye(3)),
        'projection_matrix': _matrix_node(projection),
    }
    text = yaml.safe_dump(document, sort_keys=False, default_flow_style=None, width=99)
    write_text(Path(path), text)


def resolve_url(url: str, *, camera_name: str = 'camera') -> Path:
    """
    Return the file that a camera_info URL names.

    :param url: file:///PATH, package://NAME/PATH or a plain path; ${NAME} stands for the camera's
        name, ${ROS_HOME} for ROS's folder (by default ~/.ros).
    :param camera_name: what ${NAME} stands for.
    :raises DepthPersonError: for other URLs and for packages that are not installed.
    """
    if not url.strip():
        raise DepthPersonError('the URL of the calibration is empty; give a path or file:///PATH')
    variables = {
        'NAME': camera_name,
        'ROS_HOME': os.environ.get('ROS_HOME') or str(Path.home() / '.ros'),
    }
    unknown = set(re.findall(r'\$\{(\w*)\}', url)) - set(variables)
    if unknown:
        raise DepthPersonError(
            f'${{{min(unknown)}}} in {url} is not known; known are ${{NAME}} and ${{ROS_HOME}}')
    url = re.sub(r'\$\{(\w+)\}', lambda match: variables[match[1]], url)
    scheme, separator, rest = url.partition('://')
    if not separator:
        return Path(url).expanduser()
    if scheme == 'file':
        if not rest.startswith('/'):
            raise DepthPersonError(f'{url} has no absolute path; write file:///PATH')
        return Path(unquote(rest))
    if scheme == 'package':
        package, _, inside = rest.partition('/')
        if not package or not inside:
            raise DepthPersonError(f'{url} is incomplete; write package://NAME/PATH')
        return _package_share(package) / unquote(inside)
    raise DepthPersonError(
        f'{url} cannot be opened; calibrations come from file://, package://, preset:// or a '
        'plain path')


def _package_share(package: str) -> Path:
    """Return the share folder of an installed ROS package."""
    # The index of ament_index_python is this same look-up; it need not be installed for it.
    prefixes = [prefix for prefix in os.environ.get('AMENT_PREFIX_PATH', '').split(':') if prefix]
    for prefix in prefixes:
        marker = Path(prefix, 'share', 'ament_index', 'resource_index', 'packages', package)
        if marker.exists():
            return Path(prefix, 'share', package)
    raise DepthPersonError(
        f'package {package} is not found in AMENT_PREFIX_PATH '
        f'({":".join(prefixes) or "which is empty"}); source its workspace, or use file://')


def _parse(document: dict[str, Any]) -> Intrinsics:
    """Return the intrinsics of a camera_calibration document; messages name the key at fault."""
    width, height = _size(document, 'image_width'), _size(document, 'image_height')
    matrix = _matrix(document, 'camera_matrix', (3, 3))
    model = document.get('distortion_model')
    if not isinstance(model, str):
        raise DepthPersonError('distortion_model is missing or is no name')
    distortion = _matrix(document, 'distortion_coefficients', None)
    for key, shape in (('rectification_matrix', (3, 3)), ('projection_matrix', (3, 4))):
        if key in document:
            _matrix(document, key, shape)
    intrinsics = Intrinsics.from_camera_info_fields(
        width, height, model, d=distortion, k=matrix)
    if intrinsics is None:
        raise DepthPersonError('camera_matrix is zero: this camera has not been calibrated yet')
    return intrinsics


def _size(document: dict[str, Any], key: str) -> int:
    value = document.get(key)
    if not isinstance(value, int) or isinstance(value, bool) or value <= 0:
        raise DepthPersonError(f'{key} must be a positive whole number, not {value!r}')
    return value


def _matrix(
    document: dict[str, Any], key: str, shape: tuple[int, int] | None,
) -> NDArray[np.float64]:
    """
    Return the matrix under a key.

    :param shape: rows and columns it must have; None for any single row or column.
    """
    node = document.get(key)
    if not isinstance(node, dict) or not {'rows', 'cols', 'data'} <= node.keys():
        raise DepthPersonError(f'{key} is missing or lacks rows, cols or data')
    try:
        data = np.array(node['data'], np.float64)
    except (TypeError, ValueError) as error:
        raise DepthPersonError(f'{key} holds something that is no number') from error
    if not np.isfinite(data).all():
        raise DepthPersonError(f'{key} holds NaN or infinity; calibrate the camera again')
    rows, columns = node['rows'], node['cols']
    if data.ndim != 1 or (shape or (rows, columns)) != (rows, columns) \
            or data.size != rows * columns:
        wanted = f'{shape[0]}x{shape[1]}' if shape else f'{rows}x{columns}'
        raise DepthPersonError(
            f'{key} must be {wanted}, but says {rows}x{columns} with {data.size} values')
    return data


def _matrix_node(matrix: NDArray[np.float64]) -> dict[str, Any]:
    return {'rows': matrix.shape[0], 'cols': matrix.shape[1], 'data': matrix.ravel().tolist()}
