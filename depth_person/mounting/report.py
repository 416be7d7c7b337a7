"""What the inputs have to say of themselves."""
from __future__ import annotations

from typing import Protocol


class Report(Protocol):
    """Where faults and figures of the inputs go: a node's diagnostics, or a log."""

    def fault(self, key: str, message: str) -> None:
        """Report what is wrong until it is cleared."""

    def clear(self, key: str) -> None:
        """Take a fault back."""

    def count(self, name: str) -> None:
        """Add one to a count."""

    def value(self, name: str, text: str) -> None:
        """Set a text."""
