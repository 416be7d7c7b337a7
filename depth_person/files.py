"""Writes text files whole or not at all."""
from __future__ import annotations

import os
from pathlib import Path

from depth_person.errors import DepthPersonError


def write_text(path: Path, text: str) -> None:
    """
    Write a file, and its folder where there is none.

    A crash in between leaves the file that was there before.

    :raises DepthPersonError: when the file cannot be written.
    """
    temporary = path.with_name(f'.{path.name}.{os.getpid()}')
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            with temporary.open('w', encoding='utf-8') as file:
                file.write(text)
                file.flush()
                os.fsync(file.fileno())
            temporary.replace(path)
        finally:
            temporary.unlink(missing_ok=True)
    except OSError as error:
        raise DepthPersonError(f'cannot write {path}: {error.strerror}') from error
