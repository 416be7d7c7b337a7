"""Checked access to what a JSON file holds."""
from __future__ import annotations

from collections.abc import Sequence
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depth_person.errors import DepthPersonError


class Record:
    """
    A JSON object that names the key of whatever is wrong with it.

    A key that is absent or null is absent, and asking for it an error.

    :param where: the path of keys that leads to it, with a space at its end.
    """

    def __init__(self, values: Any, where: str = '') -> None:
        if not isinstance(values, dict):
            raise DepthPersonError(f'{where}is not a JSON object')
        self._values = values
        self._where = where

    @classmethod
    def read(cls, path: Path) -> Record:
        """Return the object that a file holds."""
        try:
            return cls(json.loads(path.read_text(encoding='utf-8')))
        except OSError as error:
            raise DepthPersonError(f'cannot be read: {error.strerror}') from error
        except (RecursionError, ValueError) as error:
            raise DepthPersonError(f'is not valid JSON: {error}') from error

    def __contains__(self, key: str) -> bool:
        return self._values.get(key) is not None

    def fault(self, key: str, what: str) -> DepthPersonError:
        """Return the error that says what is wrong with a key."""
        return DepthPersonError(f'{self._where}{key} {what}')

    def _get(self, key: str) -> Any:
        if key not in self:
            raise self.fault(key, 'is missing')
        return self._values[key]

    def number(self, key: str, default: float | None = None) -> float:
        """Return a finite number; the default, if there is one, where the key is absent."""
        value = self._get(key) if default is None or key in self else default
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise self.fault(key, f'is not a number but {value!r}')
        try:
            number = float(value)
        except OverflowError:  # a whole number of hundreds of digits
            number = math.inf
        if not math.isfinite(number):
            raise self.fault(key, f'is {number}')
        return number

    def positive(self, key: str) -> float:
        """Return a number above zero."""
        value = self.number(key)
        if value <= 0:
            raise self.fault(key, f'is {value:g}, not positive')
        return value

    def text(self, key: str, default: str | None = None) -> str:
        """Return a text; the default, if there is one, where the key is absent."""
        value = self._get(key) if default is None or key in self else default
        if not isinstance(value, str):
            raise self.fault(key, f'is not a text but {value!r}')
        return value

    def texts(self, key: str, count: int) -> tuple[str, ...]:
        """Return a list of so many texts."""
        value = self._get(key)
        if not (isinstance(value, list) and len(value) == count
                and all(isinstance(item, str) for item in value)):
            raise self.fault(key, f'is not a list of {count} texts')
        return tuple(value)

    def array(self, key: str, shape: Sequence[int]) -> NDArray[np.float64]:
        """Return numbers in nested lists of this shape."""
        value = self._get(key)
        try:
            array = np.asarray(value, np.float64)
        except (OverflowError, TypeError, ValueError) as error:
            raise self.fault(key, 'is not a list of numbers') from error
        if array.shape != tuple(shape):
            raise self.fault(key, f'has the shape {array.shape}, not {tuple(shape)}')
        if not np.isfinite(array).all():
            raise self.fault(key, 'holds NaN or infinity')
        return array

    def child(self, key: str) -> Record:
        """Return the object under a key."""
        return Record(self._get(key), f'{self._where}{key}: ')

    def children(self, key: str) -> list[Record]:
        """Return the objects of a list."""
        value = self._get(key)
        if not isinstance(value, list):
            raise self.fault(key, 'is not a list')
        return [Record(item, f'{self._where}{key}[{i}]: ') for i, item in enumerate(value)]

    def identity(self, key: str) -> int | str:
        """Return a whole number of 64 bits or a text."""
        value = self._get(key)
        if isinstance(value, bool) or not isinstance(value, (int, str)):
            raise self.fault(key, f'is neither a whole number nor a text but {value!r}')
        if isinstance(value, int) and not -2**63 <= value < 2**63:
            raise self.fault(key, f'is {value}, a number of more than 64 bits')
        return value
