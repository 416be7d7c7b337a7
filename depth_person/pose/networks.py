"""Which network a model is, and how it is opened."""
from __future__ import annotations

from dataclasses import replace

from depth_person.errors import DepthPersonError
from depth_person.pose.blazepose import BlazePose, is_blazepose
from depth_person.pose.graph import Graph
from depth_person.pose.image_tensor import AUTO
from depth_person.pose.movenet import is_movenet, MoveNet
from depth_person.pose.network import PoseNetwork
from depth_person.pose.openpose import find_heads, OpenPose
from depth_person.pose.options import PoseOptions
from depth_person.pose.rtmo import is_rtmo, Rtmo
from depth_person.pose.simcc import is_simcc, SimCC
from depth_person.pose.store import DEFAULT_MODEL, model_path, MODELS
from depth_person.pose.topdown import CropNetwork, TopDown


def open_network(options: PoseOptions) -> PoseNetwork:
    """
    Return the network of a model, ready to be called with images.

    What kind a file holds is told by what the network takes and gives.

    :raises DepthPersonError: when it cannot be had, or is of no kind that is known here.
    """
    path = model_path(options.model)
    if options.model in MODELS:
        return open_movenet(options)
    graph = Graph(path, threads=options.threads, provider=options.provider)
    if is_movenet(graph):
        return open_movenet(options)
    graph.rehearse(side=options.input_size)
    if heads := find_heads(graph):
        return OpenPose(graph, heads, options)
    if is_rtmo(graph):
        return Rtmo(graph, options)
    if is_simcc(graph):
        graph.rehearse_batch()
        return _top_down(SimCC(graph, options), options)
    if is_blazepose(graph):
        graph.rehearse_batch()
        return _top_down(BlazePose(graph, options), options)
    raise DepthPersonError(
        f'{path} {graph}: that is none of the networks known here (MoveNet as `depth_person '
        'models install` writes it, RTMO, RTMPose, OpenPose, BlazePose); msg_docs/networks.md '
        'says what each gives')


def _top_down(marker: CropNetwork, options: PoseOptions) -> TopDown:
    """Return a network that marks people on crops, with the one that finds them."""
    if model_path(options.detector) == model_path(options.model):
        raise DepthPersonError(
            f'the detector {options.detector} marks people on crops, and finds none; choose '
            f'{DEFAULT_MODEL}')
    # What the user says of pixels is said of the model.
    finder = replace(
        options, model=options.detector, pixel_order=AUTO, pixel_values=AUTO)
    return TopDown(open_network(finder), marker, options)


def open_movenet(options: PoseOptions) -> MoveNet:
    """Return the MoveNet of a model; raise DepthPersonError when it is none."""
    return MoveNet(
        model_path(options.model), input_size=options.input_size, min_score=options.min_score,
        max_people=options.max_people, threads=options.threads, provider=options.provider)
