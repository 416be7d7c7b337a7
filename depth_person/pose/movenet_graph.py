"""Converts MoveNet's TensorFlow.js graphs to ONNX; needs the onnx package."""
from __future__ import annotations

from pathlib import Path

from depth_person.errors import DepthPersonError
from depth_person.pose.movenet import BOX_HEADS, HEADS, INPUT, STRIDE

try:
    import onnx

    from depth_person.pose import movenet_keypoints, onnx_writer
except ImportError as error:
    raise DepthPersonError(
        'converting a model needs the onnx package: pip install onnx') from error
from depth_person.pose.tfjs import read_graph_model

#: Where each head ends in the graph.
_SCOPES = {
    'center': 'center_0',
    'keypoint_regression': 'kpt_regress_0',
    'keypoint_heatmap': 'kpt_heatmap_0',
    'keypoint_offset': 'kpt_offset_0',
    'box_scale': 'box_scale_0',
    'box_offset': 'box_offset_0',
}
_SCORES = ('center', 'keypoint_heatmap')


def convert_movenet(graph_file: Path, target: Path, *, side: int | None) -> None:
    """
    Write a MoveNet as ONNX: for many people its raw heads, for one person keypoints.

    :param graph_file: the JSON file; its weights lie beside it.
    :param side: of the square input of a network for one person, which then takes a batch; None
        for the network for many people, which takes one image of any size in multiples of 32.
    :raises DepthPersonError: when the graph is not one that can be converted.
    """
    graph = read_graph_model(graph_file)
    names = HEADS if side else (*HEADS, *BOX_HEADS)
    model = onnx_writer.convert(
        graph, {name: graph.scope_end(_SCOPES[name]) for name in names}, sigmoid=_SCORES,
        image=INPUT, image_shape=['batch', side, side, 3] if side else [1, 'height', 'width', 3])
    if side:
        model = movenet_keypoints.with_keypoints(
            onnx_writer.with_scales(model), side=side // STRIDE)
    onnx.save(model, target)
