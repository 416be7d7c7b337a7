"""The parameters of every node."""
from __future__ import annotations

from dataclasses import dataclass

from depth_person.settings.parameter import parameter


@dataclass(frozen=True)
class NodeSettings:
    """The parameters that all nodes have."""

    autostart: bool = parameter(
        True, 'Configure and activate the node at its start; otherwise it waits for whoever '
        'manages lifecycle nodes.')
