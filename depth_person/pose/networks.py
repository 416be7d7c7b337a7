"""Which network a model is, and how it is opened."""
from __future__ import annotations

from depth_person.pose.movenet import MoveNet
from depth_person.pose.network import PoseNetwork
from depth_person.pose.options import PoseOptions
from depth_person.pose.store import model_path


def open_network(options: PoseOptions) -> PoseNetwork:
    """
    Return the network of a model, ready to be called with images.

    :raises DepthPersonError: when it cannot be had, or is of no kind that is known here.
    """
    return MoveNet(
        model_path(options.model), input_size=options.input_size, min_score=options.min_score,
        max_people=options.max_people, threads=options.threads, provider=options.provider)
