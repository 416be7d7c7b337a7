"""Heat maps and part-affinity fields as a network of OpenPose's kind would draw them."""
from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float32]

#: A person in cells about the neck, in the order of COCO-18: x, y.
FIGURE = np.array([
    [0.4, -3.1], [0, 0], [-2.4, 0.2], [-3.1, 3.4], [-3.3, 6.2], [2.5, 0.1], [3.2, 3.3],
    [3.6, 6.4], [-1.5, 6.9], [-1.7, 11.2], [-1.6, 15.3], [1.6, 6.8], [1.8, 11.1], [1.9, 15.4],
    [-0.4, -3.9], [1.2, -3.8], [-1.3, -3.5], [2.0, -3.4]], np.float32)


def figure(x: float, y: float, *, scale: float = 1.0) -> Array:
    """Return FIGURE with its neck at a point."""
    return scale * FIGURE + np.array([x, y], np.float32)


@dataclass(frozen=True)
class Drawing:
    """
    How OpenPose describes one of its layouts.

    :ivar pairs: the keypoints of limb after limb.
    :ivar channels: those of each limb's field, x and y, in the same order.
    :ivar rows: for each COCO-18 row the heat map.
    """

    n_parts: int
    pairs: tuple[tuple[int, int], ...]
    channels: tuple[tuple[int, int], ...]
    rows: tuple[int, ...]


def _twos(text: str) -> tuple[tuple[int, int], ...]:
    numbers = [int(number) for number in text.split(',')]
    return tuple(zip(numbers[::2], numbers[1::2], strict=True))


#: POSE_COCO_PAIRS and POSE_COCO_MAP_IDX; there the channels begin after 19 heat maps.
COCO = Drawing(
    18, _twos('1,2,1,5,2,3,3,4,5,6,6,7,1,8,8,9,9,10,1,11,11,12,12,13,1,0,0,14,14,16,0,15,15,17,'
              '2,16,5,17'),
    tuple((x - 19, y - 19) for x, y in _twos(
        '31,32,39,40,33,34,35,36,41,42,43,44,19,20,21,22,23,24,25,26,27,28,29,30,47,48,49,50,'
        '53,54,51,52,55,56,37,38,45,46')),
    tuple(range(18)))
#: The same of BODY_25; the channels are counted from the first field.
BODY_25 = Drawing(
    25, _twos('1,8,1,2,1,5,2,3,3,4,5,6,6,7,8,9,9,10,10,11,8,12,12,13,13,14,1,0,0,15,15,17,0,16,'
              '16,18,2,17,5,18,14,19,19,20,14,21,11,22,22,23,11,24'),
    _twos('0,1,14,15,22,23,16,17,18,19,24,25,26,27,6,7,2,3,4,5,8,9,10,11,12,13,30,31,32,33,'
          '36,37,34,35,38,39,20,21,28,29,40,41,42,43,44,45,46,47,48,49,50,51'),
    (0, 1, 2, 3, 4, 5, 6, 7, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18))


class DrawnFields:
    """Empty maps of so many rows and columns of cells; people are drawn into them."""

    def __init__(self, drawing: Drawing, rows: int, columns: int) -> None:
        self.drawing = drawing
        self.heat = np.zeros((rows, columns, drawing.n_parts + 1), np.float32)
        self.field = np.zeros((rows, columns, 2 * len(drawing.pairs)), np.float32)
        self._drawn = np.zeros(self.field.shape, np.float32)

    def draw(self, person: Array, *, score: float = 0.9, missing: Iterable[int] = ()) -> Array:
        """
        Draw a person; return it, NaN for what is missing.

        :param person: (18, 2) x, y in cells.
        :param missing: COCO-18 rows that are not drawn.
        """
        person = np.array(person, np.float32)
        person[list(missing)] = np.nan
        parts = np.full((self.drawing.n_parts, 2), np.nan, np.float32)
        parts[list(self.drawing.rows)] = person
        if self.drawing.n_parts == 25:  # the middle of the hips; feet near the ankles
            parts[8] = (parts[9] + parts[12]) / 2
        for part, (x, y) in enumerate(parts):
            if np.isfinite(x):
                self.mark(part, x, y, score)
        for pair, channels in zip(self.drawing.pairs, self.drawing.channels, strict=True):
            start, end = parts[list(pair)]
            if np.isfinite(start).all() and np.isfinite(end).all():
                self.join(channels, start, end)
        return person

    def mark(self, part: int, x: float, y: float, score: float, *, sigma: float = 0.9) -> None:
        """Let a heat map peak at a point."""
        rows, columns = np.indices(self.heat.shape[:2], np.float32)
        spot = score * np.exp(-((columns - x) ** 2 + (rows - y) ** 2) / (2 * sigma ** 2))
        np.maximum(self.heat[..., part], spot, out=self.heat[..., part])

    def join(self, channels: tuple[int, int], start: Array, end: Array) -> None:
        """
        Draw a unit vector from start to end on the cells near the line between.

        Where two people's limbs cross, the field is the mean of both, as in training.
        """
        rows, columns = np.indices(self.heat.shape[:2], np.float32)
        way = end - start
        length = np.hypot(*way)
        unit = way / max(length, 1e-6)
        along = (columns - start[0]) * unit[0] + (rows - start[1]) * unit[1]
        across = np.abs((columns - start[0]) * unit[1] - (rows - start[1]) * unit[0])
        near = (along >= -1) & (along <= length + 1) & (across <= 1)
        for channel, component in zip(channels, unit, strict=True):
            drawn = self._drawn[near, channel]
            self.field[near, channel] *= drawn / (drawn + 1)
            self.field[near, channel] += component / (drawn + 1)
            self._drawn[near, channel] += 1
