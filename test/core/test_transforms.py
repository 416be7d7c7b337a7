"""Frames looked up at one time: chains worked by hand, and what cannot be told."""
import math

import numpy as np
import pytest

from depth_person.distance.attitude import rotation_from
from depth_person.mounting.history import NotKnown, Pose, Taken
from depth_person.mounting.transforms import TransformBuffer

MILLISECOND = 1_000_000
HALF = math.sqrt(0.5)
LEFT = rotation_from((0, 0, HALF, HALF))  # a quarter turn to the left, seen from above
LEVEL = np.eye(3)


def buffer():
    """Return map -> base (moves ahead by 1 m a second, and turns) -> gimbal -> camera."""
    result = TransformBuffer()
    for milliseconds in (0, 100):
        result.add(parent='map', child='base', stamp_ns=milliseconds * MILLISECOND,
                   pose=Pose(LEFT, np.array([milliseconds / 1000, 0.0, 2.0])))
        result.add(parent='base', child='gimbal', stamp_ns=milliseconds * MILLISECOND,
                   pose=Pose(LEVEL, np.array([0.0, 0.0, -0.1])))
    result.add(parent='gimbal', child='camera', stamp_ns=0, static=True,
               pose=Pose(LEVEL, np.array([0.2, 0.0, 0.0])))
    result.add(parent='map', child='home', stamp_ns=0, static=True,
               pose=Pose(LEVEL, np.array([5.0, 0.0, 0.0])))
    return result


@pytest.mark.parametrize(('target', 'source', 'at_ms', 'position', 'rotation'), [
    ('map', 'camera', 50, (0.05, 0.2, 1.9), LEFT),  # ahead of the vehicle is the map's y
    ('map', 'camera', 120, (0.12, 0.2, 1.9), LEFT),  # goes on for a little while
    ('camera', 'map', 50, (-0.2 - 0.0, 0.05, -1.9), LEFT.T),
    ('home', 'base', 0, (-5.0, 0.0, 2.0), LEFT),  # up one branch, down another
    ('base', 'camera', 0, (0.2, 0.0, -0.1), LEVEL),
    ('gimbal', 'camera', 10**9, (0.2, 0.0, 0.0), LEVEL),  # static: true at any time
    ('map', 'map', 77, (0.0, 0.0, 0.0), LEVEL),
])
def test_a_frame_as_seen_from_another(target, source, at_ms, position, rotation):
    found = buffer().lookup(target=target, source=source, stamp_ns=at_ms * MILLISECOND)
    assert found.value.position == pytest.approx(position, abs=1e-9)
    assert found.value.rotation == pytest.approx(rotation, abs=1e-9)
    assert found.beyond_s == pytest.approx(0.02 if at_ms == 120 else 0.0)


@pytest.mark.parametrize(('target', 'source', 'at_ms', 'said'), [
    ('map', 'eye', 50, "frame 'eye' is unknown to TF, which has base, camera"),
    ('world', 'camera', 50, "frame 'world' is unknown"),
    ('map', 'camera', 400, "from 'gimbal' to 'base', the nearest is 0.30 s before"),
    ('island', 'camera', 50, "does not connect 'camera' with 'island'"),
])
def test_what_cannot_be_told_names_the_frames(target, source, at_ms, said):
    frames = buffer()
    frames.add(parent='island', child='palm', stamp_ns=0, pose=Pose(LEVEL, np.zeros(3)))
    with pytest.raises(NotKnown, match=said):
        frames.lookup(target=target, source=source, stamp_ns=at_ms * MILLISECOND)


def test_an_empty_buffer_knows_nothing():
    with pytest.raises(NotKnown, match='which has none'):
        TransformBuffer().lookup(target='map', source='camera', stamp_ns=0)


def test_frames_in_a_circle_end():
    frames = TransformBuffer()
    for parent, child in (('a', 'b'), ('b', 'c'), ('c', 'a')):
        frames.add(parent=parent, child=child, stamp_ns=0, pose=Pose(LEVEL, np.ones(3)))
    frames.add(parent='map', child='base', stamp_ns=0, pose=Pose(LEVEL, np.zeros(3)))
    with pytest.raises(NotKnown, match='does not connect'):
        frames.lookup(target='map', source='b', stamp_ns=0)


def test_a_new_parent_takes_the_place_of_the_old_one_and_a_jump_is_told():
    frames = buffer()
    pose = Pose(LEVEL, np.array([0.0, 0.0, 7.0]))
    assert frames.add(parent='odom', child='base', stamp_ns=0, pose=pose) is Taken.ADDED
    assert frames.lookup(target='odom', source='base', stamp_ns=0).value.position[2] == 7.0
    assert frames.add(
        parent='odom', child='base', stamp_ns=-(10**12), pose=pose) is Taken.JUMPED
