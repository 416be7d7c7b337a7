"""What all tests share."""
import signal

from hypothesis import settings
import pytest

# A busy machine is slow at times, and what a test proves does not depend on it. The examples are
# the same in every run; `--hypothesis-profile explore` draws others, and more of them.
settings.register_profile('repeatable', deadline=None, derandomize=True)
settings.register_profile('explore', deadline=None, max_examples=1000)
settings.load_profile('repeatable')

# Where jobs run in the background Ctrl-C is ignored, here and in every program that is started.
signal.signal(signal.SIGINT, signal.default_int_handler)

#: Files of the core that talk to other processes.
_LIVE = ('test_camera_live', 'test_camera_streams')


def pytest_collection_modifyitems(items):
    """
    Give tests that talk to other processes in real time a second try.

    On a busy machine a process may stand still for longer than the queues of DDS or of a stream
    hold, which is no fault of what is tested; a fault fails twice.
    """
    for item in items:
        if item.path.parent.name in ('nodes', 'system') or item.path.stem in _LIVE:
            item.add_marker(pytest.mark.flaky(reruns=1))
