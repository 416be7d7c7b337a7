"""Lengths and directions of vectors, many at once."""
from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_Array = NDArray[np.float64]

#: Of space; NumPy takes longer to make it than to use it.
UNIT_MATRIX = np.eye(3)

_TINY = 1e-9
# The axes after and before each axis.
_NEXT, _LAST = [1, 2, 0], [2, 0, 1]


def length(vectors: _Array) -> _Array:
    """Return the lengths (...) of vectors (..., k)."""
    return np.sqrt((vectors ** 2).sum(axis=-1))


def unit(vectors: _Array) -> _Array:
    """Return vectors (..., k) at length 1; NaN for one that has no length."""
    return vectors / length(vectors)[..., None]


def unit_or_zero(vectors: _Array) -> _Array:
    """Return vectors (..., k) at length 1; zero for one that has no length."""
    return polar(vectors)[1]


def polar(vectors: _Array) -> tuple[_Array, _Array]:
    """Return the lengths (...) of vectors (..., k), and as unit_or_zero where they point."""
    lengths = length(vectors)
    return lengths, vectors / np.maximum(lengths, _TINY)[..., None]


def cross(one: _Array, other: _Array) -> _Array:
    """Return vector products (..., 3); np.cross takes several times as long for a few."""
    return one[..., _NEXT] * other[..., _LAST] - one[..., _LAST] * other[..., _NEXT]


def rays_through(plane: _Array) -> _Array:
    """Return unit view rays (..., 3) through points (..., 2) of the plane z = 1."""
    return unit(np.concatenate([plane, np.ones((*plane.shape[:-1], 1))], axis=-1))
