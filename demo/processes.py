"""Child processes that are ended with the process that started them."""
from contextlib import contextmanager
from pathlib import Path
import signal
import subprocess
import sys
import time

from depth_person.interrupts import deferred_interrupts, SIGNALS

HERE = Path(__file__).parent
BIN = Path(sys.executable).parent
#: How much of a log is shown when its process went wrong.
LOG_LINES = 20


class DemoError(Exception):
    """What went wrong, for the one who runs this."""


class Processes:
    """
    Starts processes, and ends each by its own id.

    :param logs: folder for what they print; None lets them print here.
    """

    def __init__(self, *, logs=None):
        self._logs = logs
        self._processes = {}

    def start(self, name, *command, quiet=True):
        """Start a process; quiet ones write to a log of their name."""
        log = (self._logs / f'{name}.log').open('wb') if quiet and self._logs else None
        with deferred_interrupts():  # or nobody would end what has just been started
            # A session of its own, so that Ctrl-C comes here alone and they end in order.
            self._processes[name] = subprocess.Popen(
                [str(word) for word in command], stdout=log,
                stderr=subprocess.STDOUT if log else None, start_new_session=True)
        if log:
            log.close()

    def check(self, *, may_end=()):
        """
        Return the names of those that may end and have.

        :raises DemoError: when another has ended, or one of these with an error.
        """
        ended = {name: process.returncode for name, process in self._processes.items()
                 if process.poll() is not None}
        for name, code in ended.items():
            if code or name not in may_end:
                raise DemoError(f'{name} ended with exit code {code}{self._last_words(name)}')
        return set(ended)

    def end(self, name, timeout_s=10.0):
        """End one; return its exit code."""
        process = self._processes.pop(name)
        if process.poll() is None:
            process.terminate()  # SIGINT would have it print a traceback while it still loads
        try:
            return process.wait(timeout_s)
        except subprocess.TimeoutExpired:
            process.kill()
            return process.wait()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        with deaf_to_interrupts():
            for name in reversed(list(self._processes)):
                self.end(name)

    def _last_words(self, name):
        log = self._logs / f'{name}.log' if self._logs else None
        if log is None or not log.exists():
            return ''
        lines = log.read_text(errors='replace').splitlines()[-LOG_LINES:]
        return '; it said:\n' + '\n'.join(lines)


@contextmanager
def deaf_to_interrupts():
    """Ignore Ctrl-C and SIGTERM, so that none leaves a process behind."""
    handlers = {number: signal.signal(number, signal.SIG_IGN) for number in SIGNALS}
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)


def hear_one_interrupt():
    """Let the first Ctrl-C or SIGTERM end this process in order, and no other disturb that."""
    def interrupt(*_):
        for number in SIGNALS:
            signal.signal(number, signal.SIG_IGN)
        raise KeyboardInterrupt

    for number in SIGNALS:
        signal.signal(number, interrupt)


def wait_until(done, *, what, timeout_s, processes, may_end=()):
    """Wait for a condition while the processes are well; raise DemoError when it never comes."""
    deadline = time.monotonic() + timeout_s
    while not done():
        processes.check(may_end=may_end)
        if time.monotonic() > deadline:
            raise DemoError(f'{what} did not happen within {timeout_s:.0f} s')
        time.sleep(0.1)
