"""What all tests share."""
from hypothesis import settings
import pytest

# A busy machine is slow at times; what a test proves does not depend on it.
settings.register_profile('patient', deadline=None)
settings.load_profile('patient')

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
