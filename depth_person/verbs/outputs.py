"""Where results must not be written to."""
from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from depth_person.errors import DepthPersonError


def spare(inputs: Iterable[Path], output: Path) -> None:
    """
    Raise DepthPersonError when writing to a place would touch what is to be read.

    :param output: a folder or file that may be replaced.
    """
    target = output.resolve()
    for path in inputs:
        source = path.resolve()
        if target == source:
            raise DepthPersonError(f'{output} is one of the bags to read; name another')
        if source in target.parents:
            raise DepthPersonError(f'{output} lies within {path}, which is read; name another')
        if target in source.parents:
            raise DepthPersonError(f'{path}, which is read, lies within {output}; name another')
