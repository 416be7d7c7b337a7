"""What every source of frames gives."""
from __future__ import annotations

from abc import abstractmethod
import re

from depth_person.camera.frame import Frame
from depth_person.closing import Closing
from depth_person.errors import DepthPersonError


class SourceLost(DepthPersonError):  # noqa: N818 - a loss, named in the interface
    """A source has stopped that should have gone on: a stream lost, a file torn."""


class Source(Closing):
    """
    Where frames come from; a context manager that closes on leaving.

    :ivar live: whether the camera sets the pace. If not, frames come as fast as they are read, and
        whoever reads paces them by their stamps.
    :ivar description: what is read, for messages; holds no password.
    :ivar dropped: frames of a live source that came and were never read.
    """

    live: bool = False
    description: str
    dropped: int = 0

    @abstractmethod
    def read(self) -> Frame | None:
        """
        Return the next frame, waiting for it; None when the source has ended.

        :raises SourceLost: when the source has stopped before its end.
        """

    @abstractmethod
    def close(self) -> None:
        """Stop reading; a second call does nothing."""


def mask_password(url: str) -> str:
    """Return a URL with its passwords replaced by ***."""
    # Up to the last @, since passwords may hold @ and / without being quoted.
    url = re.sub(r'(://[^:/@]*):.*@', r'\1:***@', url)
    return re.sub(r'(?i)([?&][^=&]*(?:pass|pwd|token|key|auth|secret)[^=&]*)=[^&#]*',
                  r'\1=***', url)
