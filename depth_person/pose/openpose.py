"""Networks of OpenPose's kind: heat maps and part-affinity fields, COCO-18 or BODY_25."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depth_person.errors import DepthPersonError
from depth_person.pose.graph import Graph, Value
from depth_person.pose.heatmaps import find_peaks
from depth_person.pose.image_tensor import check_image, ImageTensor, Pixels
from depth_person.pose.movenet import MIN_KEYPOINTS
from depth_person.pose.options import PoseOptions
from depth_person.pose.paf import group, Limb
from depth_person.pose.skeleton import N_KEYPOINTS
from depth_person.pose.warps import to_raw

Array = NDArray[np.float32]

#: The mean of the map that marks the background is greater, that of any other map less.
_BACKGROUND = 0.5


@dataclass(frozen=True)
class Layout:
    """
    What the channels of a network mean.

    :ivar rows: for each COCO-18 row the heat map that marks it.
    :ivar n_parts: heat maps that mark keypoints; one more marks the background.
    :ivar limbs: what the fields join; COCO-18's arms are joined to the ears, too.
    """

    rows: tuple[int, ...]
    n_parts: int
    limbs: tuple[Limb, ...]

    @property
    def n_heat(self) -> int:
        """Channels of the heat maps."""
        return self.n_parts + 1

    @property
    def n_fields(self) -> int:
        """Channels of the fields."""
        return 2 * len(self.limbs)


def _limbs(text: str) -> tuple[Limb, ...]:
    """Return limbs of which the first field has channels 0 and 1, and so on."""
    pairs = (pair.split('-') for pair in text.split())
    return tuple(
        Limb(int(start), int(end), 2 * index) for index, (start, end) in enumerate(pairs))


#: In the order of the fields' channels, from OpenPose's documentation of its output.
COCO18 = Layout(tuple(range(N_KEYPOINTS)), N_KEYPOINTS, _limbs(
    '1-8 8-9 9-10 1-11 11-12 12-13 1-2 2-3 3-4 2-16 1-5 5-6 6-7 5-17 1-0 0-14 0-15 14-16 15-17'))
BODY25 = Layout((0, 1, 2, 3, 4, 5, 6, 7, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18), 25, _limbs(
    '1-8 9-10 10-11 8-9 8-12 12-13 13-14 1-2 2-3 3-4 2-17 1-5 5-6 6-7 5-18 1-0 0-15 0-16 15-17 '
    '16-18 14-19 19-20 14-21 11-22 22-23 11-24'))


@dataclass(frozen=True)
class Heads:
    """
    Where a network gives heat maps and fields.

    :ivar names: of one output that holds both, or of heat maps and fields.
    :ivar channels_first: whether outputs are (1, channels, h, w).
    """

    layout: Layout
    names: tuple[str, ...]
    channels_first: bool


def find_heads(graph: Graph) -> Heads | None:
    """Return the heads of a network of this kind; the last ones, where it has several stages."""
    # Where both readings fit (57 rows of cells), outputs are laid out as the input.
    nhwc = graph.inputs[0].shape[-1:] == (3,)
    for channels_first in (not nhwc, nhwc):
        for layout in (COCO18, BODY25):
            def last(channels: int, *, first: bool = channels_first) -> tuple[str, ...]:
                fitting = [value.name for value in graph.outputs
                           if _channels(value, channels_first=first) == channels]
                return tuple(fitting[-1:])

            both = last(layout.n_heat + layout.n_fields)
            names = both or last(layout.n_heat) + last(layout.n_fields)
            if both or len(names) == 2:
                return Heads(layout, names, channels_first)
    return None


def _channels(value: Value, *, channels_first: bool) -> int | None:
    if len(value.shape) != 4:
        return None
    return value.shape[1] if channels_first else value.shape[3]


class OpenPose:
    """
    Finds people in BGR images by heat maps and part-affinity fields.

    The neck is a keypoint of its own, marked as such in training.
    """

    convention = 'openpose'
    neck_measured = True

    def __init__(self, graph: Graph, heads: Heads, options: PoseOptions) -> None:
        """Take an open network over; raise DepthPersonError when it is not fit."""
        # Networks converted from Caffe scale outside, those from TensorFlow in the graph.
        nhwc = graph.inputs[0].shape[-1:] == (3,)
        pixels = Pixels('bgr', 'bytes' if nhwc else 'centred').told(
            order=options.pixel_order, values=options.pixel_values)
        self._tensor = ImageTensor(graph, pixels)
        sides = slice(2, 4) if heads.channels_first else slice(1, 3)
        if len({value.shape[sides] for value in graph.outputs if value.name in heads.names}) > 1:
            raise DepthPersonError(
                f'{graph.path} {graph}: heat maps and fields should be of one size')
        self._graph, self._heads, self._options = graph, heads, options

    @property
    def inference_s(self) -> float:
        """Seconds that the network took for the last image."""
        return self._graph.inference_s

    def __call__(self, image: NDArray[np.uint8]) -> NDArray[np.float32]:
        """Return the people in an image; see PoseNetwork."""
        check_image(image)
        self._graph.restart()
        options, layout = self._options, self._heads.layout
        tensor, matrix, size = self._tensor.fit(image, options.input_size)
        heat, field = self._split(self._graph.run(tensor, self._heads.names))
        peaks = find_peaks(heat[..., :layout.n_parts], min_score=options.min_score)
        people = group(peaks, field, layout.limbs, n_maps=layout.n_parts)
        stride = np.array(size, np.float32) / heat.shape[1::-1]
        points = to_raw(matrix, ((peaks.points + 0.5) * stride - 0.5)[None])[0]
        marked = np.column_stack([points, peaks.scores])
        rows = people[:, layout.rows]
        keypoints = np.full((*rows.shape, 3), np.nan, np.float32)
        keypoints[rows >= 0] = marked[rows[rows >= 0]]
        persons = (rows >= 0).sum(1) >= MIN_KEYPOINTS
        return keypoints[persons][:options.max_people]

    def _split(self, outputs: list[Array]) -> tuple[Array, Array]:
        """Return heat maps (h, w, n) and fields (h, w, m) from the outputs."""
        heads = [np.moveaxis(output[0], 0, -1) if self._heads.channels_first else output[0]
                 for output in outputs]
        n_heat = self._heads.layout.n_heat
        if len(heads) == 1:
            both, = heads
            # The background's map ends the heat maps, and is 1 nearly everywhere.
            if both[..., -1].mean() > _BACKGROUND > both[..., n_heat - 1].mean():
                return both[..., -n_heat:], both[..., :-n_heat]
            return both[..., :n_heat], both[..., n_heat:]
        return heads[0], heads[1]
