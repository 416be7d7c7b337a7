"""The distance estimators by name."""
from __future__ import annotations

from collections.abc import Callable

from depth_person.distance.body_dimensions import BodyDimensionsEstimator
from depth_person.distance.estimator import Body, DistanceEstimator
from depth_person.distance.shoulder import ShoulderEstimator
from depth_person.distance.skeleton import SkeletonEstimator
from depth_person.errors import DepthPersonError

_MAKERS: dict[str, Callable[[Body], DistanceEstimator]] = {
    'skeleton': SkeletonEstimator,
    'shoulder': ShoulderEstimator,
    'body_dimensions': BodyDimensionsEstimator,
}

#: The names that make_estimator takes; the first is the default.
ESTIMATORS = tuple(_MAKERS)


def make_estimator(name: str, *, body: Body = Body()) -> DistanceEstimator:
    """
    Return the estimator of this name.

    :param body: what is known of the people in view.
    :raises DepthPersonError: when there is none of that name.
    """
    maker = _MAKERS.get(name)
    if maker is None:
        raise DepthPersonError(f'no estimator {name!r}; there are {", ".join(ESTIMATORS)}')
    return maker(body)
