"""Training rows of the body dimensions models, from views of people of our own making."""
from __future__ import annotations

import numpy as np

from depth_person.distance.body_box import angle_boxes, pixel_boxes, usable
from depth_person.distance.conventions import CONVENTIONS
from depth_person.distance.training.body_fit import Rows
from depth_person.distance.training.body_views import BodyViews
from depth_person.distance.training.views import tilted

#: Part of the views that know their gravity.
GRAVITY_KNOWN = 0.5
#: Part of the adults that a camera sees which has been told of children; as many as there are
#: children.
AMONG_CHILDREN = 1 / 3


def normalised_rows(rng: np.random.Generator, views: BodyViews) -> Rows:
    """Return the views' boxes in angles, half of them with gravity."""
    n = len(views)
    gravity = tilted(rng, views.gravity)
    gravity[rng.random(n) >= GRAVITY_KNOWN] = np.nan
    boxes = angle_boxes(
        views.camera.undistort(views.people.keypoints[..., :2]), usable(views.people.keypoints),
        gravity=gravity, placement=CONVENTIONS[views.people.convention].placement,
        children=views.child | (rng.random(n) < AMONG_CHILDREN))
    return Rows('normalised', boxes.features, views.stature, views.range, views.person)


def paper_rows(views: BodyViews) -> Rows:
    """Return the views' boxes in pixels."""
    rows = Rows('paper', pixel_boxes(views.people.keypoints), views.stature, views.distance,
                views.person)
    return rows.take(np.flatnonzero(np.isfinite(rows.features).all(axis=1)))
