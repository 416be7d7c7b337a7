"""Where a detector looks: the whole frame at several sizes, and parts of it for far people."""
from __future__ import annotations

from dataclasses import dataclass
from itertools import product
import math

import numpy as np
from numpy.typing import NDArray

from depth_person.pose.movenet import SIDE_STEP, TRAINED_SIDE

#: Milliseconds that a look is taken to last for a thousand pixels of the network's input: as on
#: two AVX2 cores. A figure of its own, not the time measured, so that a recording gives the same
#: people on every machine and whatever else runs there.
MS_PER_KILOPIXEL = 0.25

#: Longer side of the frame, in pixels of the network's input, at which far people are looked for:
#: in parts of the frame when people are tracked, and in one piece in the first frame.
FAR_SIDE = 960
#: How much of a part belongs to its neighbour, too, in pixels of the network's input.
_OVERLAP = 48


@dataclass(frozen=True)
class Look:
    """
    One image for the detector: a part of the frame, and how large the network sees it.

    :ivar x: of its upper left corner, raw pixels.
    :ivar y: likewise.
    :ivar width: raw pixels.
    :ivar height: likewise.
    :ivar input_side: its longer side in the network's input, pixels.
    """

    x: int
    y: int
    width: int
    height: int
    input_side: int

    @property
    def cost_ms(self) -> float:
        """How long the network takes for it, by the model of MS_PER_KILOPIXEL."""
        scale = self.input_side / max(self.width, self.height)
        columns, rows = (
            math.ceil(round(side * scale) / SIDE_STEP) for side in (self.width, self.height))
        return MS_PER_KILOPIXEL * columns * rows * SIDE_STEP ** 2 / 1000

    @property
    def largest(self) -> float:
        """The largest body that the network sees as a whole in it, raw pixels."""
        return TRAINED_SIDE * max(self.width, self.height) / self.input_side

    def part(self, image: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return its part of a frame, which is not copied."""
        return image[self.y:self.y + self.height, self.x:self.x + self.width]


def whole_looks(width: int, height: int, *, input_side: int) -> list[Look]:
    """
    Return the looks at the whole frame, the largest people first.

    :param input_side: of the look for people at middle distances.
    """
    sides = sorted({min(TRAINED_SIDE, input_side), input_side})
    return [Look(0, 0, width, height, side) for side in sides]


def far_look(width: int, height: int) -> Look:
    """Return the look at the whole frame that finds far people; slow."""
    return Look(0, 0, width, height, FAR_SIDE)


def far_parts(width: int, height: int, *, input_side: int) -> list[Look]:
    """
    Return overlapping parts of the frame that see together as far as far_look.

    None is larger in the network's input than input_side by 5/8 of it; where the whole frame at
    input_side is seen as far, there are none.
    """
    if input_side >= FAR_SIDE:
        return []
    raw_per_input = max(width, height) / FAR_SIDE
    part_sides = (max(round(side * raw_per_input), 1) for side in (input_side, input_side * 5 / 8))
    columns, rows = (
        _spans(length, part, _OVERLAP * raw_per_input)
        for length, part in zip((width, height), part_sides, strict=True))
    return [
        Look(x, y, part_width, part_height,
             round(max(part_width, part_height) / raw_per_input))
        for (y, part_height), (x, part_width) in product(rows, columns)]


def _spans(length: int, part: int, overlap: float) -> list[tuple[int, int]]:
    """Return where parts that cover a length begin, and how long they are."""
    if part >= length:
        return [(0, length)]
    count = math.ceil((length - overlap) / (part - overlap))
    starts = np.rint(np.linspace(0, length - part, count)).astype(int)
    return [(int(start), part) for start in starts]
