"""What every source of frames gives."""
from __future__ import annotations

from abc import abstractmethod
import re

from depth_person.camera.frame import Frame
from depth_person.closing import Closing
from depth_person.errors import DepthPersonError


class SourceLost(DepthPersonError):  # noqa: N818 - a loss, named in the interface
    """A source has stopped that should have gone on: a stream lost, a file torn."""


class SourceUnusable(DepthPersonError):  # noqa: N818 - a state, as SourceLost
    """A source that no waiting brings: no camera, no permission, wrong credentials."""


class Source(Closing):
    """
    Where frames come from; a context manager that closes on leaving.

    :ivar live: whether the camera sets the pace. If not, frames come as fast as they are read, and
        whoever reads paces them by their stamps.
    :ivar recorded: whether stamps are those of a recording, not counted from the time of opening.
    :ivar description: what is read, for messages; holds no password.
    :ivar dropped: frames of a live source that came and were never read.
    """

    live: bool = False
    recorded: bool = False
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
    """Return a URL, or a GStreamer pipeline with URLs, with its passwords replaced by ***."""
    # Up to the last @ (in a pipeline, of a word), since passwords may hold @ and / without being
    # quoted; with fewer slashes too, since a URL that is mistyped is shown in a message.
    password = r'\S*' if ' ! ' in url else '.*'
    url = re.sub(rf'(://|:/|^|[\s="\'])([^:/@\s]*):(?!/){password}@', r'\1\2:***@', url)
    return re.sub(r'(?i)((?:[?&\s;]|^)[\w-]*(?:pass|pwd|pw|token|key|auth|secret)[\w-]*)=[^&#\s]*',
                  r'\1=***', url)
