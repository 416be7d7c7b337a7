"""Numbers on the command line that have bounds, as types for argparse."""
from __future__ import annotations

import argparse
from collections.abc import Callable
import math
from typing import TypeVar

Number = TypeVar('Number', int, float)


def at_least(lowest: Number, *, at_most: float = math.inf) -> Callable[[str], Number]:
    """
    Return a converter that takes numbers of the lowest one's type from it on.

    :param at_most: the largest; infinity itself is not taken.
    """
    def number(text: str) -> Number:
        value = type(lowest)(text)
        if not (lowest <= value <= at_most and value < math.inf):
            raise ValueError(text)
        return value

    # argparse's message names it so.
    number.__name__ = (f'number of at least {lowest}' if at_most == math.inf
                       else f'number from {lowest} to {at_most}')
    return number


def positive(text: str) -> float:
    """Return a number above zero."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0 < value < math.inf:
        raise argparse.ArgumentTypeError(f'{text!r} is not a number above zero')
    return value
