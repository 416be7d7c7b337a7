"""What several tests of the core share."""
from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from depth_person.pose.installer import install
from depth_person.pose.store import MODELS


@pytest.fixture(scope='session')
def network() -> Callable[[str], Path]:
    """Return a function that gives the ONNX file of a network, installing it where missing."""
    return dict(zip(MODELS, install(list(MODELS)), strict=True)).__getitem__
