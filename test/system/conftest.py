"""What the tests of whole programs share."""
import os

import pytest


@pytest.fixture
def ros_environment():
    """Return an environment in which ROS stays on this machine, in a domain of its own."""
    return {**os.environ, 'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST',
            'ROS_DOMAIN_ID': str(1 + os.getpid() % 100)}
