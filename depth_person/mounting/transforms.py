"""How frames lie to each other at one time: what TF tells, free of ROS."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from depth_person.mounting.history import blend_poses, Found, History, NotKnown, Pose, Taken

#: How long a transform goes on after its newest sample, seconds.
_REACH_S = 0.1
_NAMED = 8
_IDENTITY = Pose(np.eye(3), np.zeros(3))


@dataclass(eq=False)
class _Edge:
    parent: str
    history: History[Pose]
    static: Pose | None = None


class TransformBuffer:
    """
    A forest of frames, each of which is seen from its parent.

    Whoever asks names the time; there is no `latest`.
    """

    def __init__(self) -> None:
        self._edges: dict[str, _Edge] = {}

    def add(
        self, *, parent: str, child: str, stamp_ns: int, pose: Pose, static: bool = False,
    ) -> Taken:
        """Add where a child is in its parent's frame; a new parent takes the old one's place."""
        edge = self._edges.get(child)
        if edge is None or edge.parent != parent:
            edge = self._edges[child] = _Edge(parent, History(blend_poses, reach_s=_REACH_S))
        if static:
            edge.static = pose
            return Taken.ADDED
        return edge.history.add(stamp_ns, pose)

    def lookup(self, *, target: str, source: str, stamp_ns: int) -> Found[Pose]:
        """
        Return the source frame as seen from the target frame at this time.

        :raises NotKnown: when a frame is unknown, when the two are not connected, or when a
            transform between them has no sample near this time; names the frames.
        """
        for frame in (target, source):
            if not self._knows(frame):
                known = sorted({*self._edges, *(edge.parent for edge in self._edges.values())})
                told = ', '.join(known[:_NAMED]) + (', ...' if len(known) > _NAMED else '')
                raise NotKnown(f'frame {frame!r} is unknown to TF, which has {told or "none"}')
        up, down = self._ancestors(source), self._ancestors(target)
        common = next((frame for frame in up if frame in down), None)
        if common is None:
            raise NotKnown(f'TF does not connect {source!r} with {target!r}')
        from_source = self._climb(up[:up.index(common)], stamp_ns)
        from_target = self._climb(down[:down.index(common)], stamp_ns)
        return Found(
            from_source.value.then(from_target.value.inverted()),
            max(from_source.beyond_s, from_target.beyond_s))

    def _knows(self, frame: str) -> bool:
        return frame in self._edges or any(
            edge.parent == frame for edge in self._edges.values())

    def _ancestors(self, frame: str) -> list[str]:
        result = [frame]
        while (edge := self._edges.get(result[-1])) is not None and edge.parent not in result:
            result.append(edge.parent)
        return result

    def _climb(self, frames: list[str], stamp_ns: int) -> Found[Pose]:
        """Return the first of these frames as seen from the parent of the last."""
        pose, beyond_s = _IDENTITY, 0.0
        for frame in frames:
            edge = self._edges[frame]
            if edge.static is not None:
                pose = pose.then(edge.static)
                continue
            try:
                found = edge.history.at(stamp_ns)
            except NotKnown as reason:
                raise NotKnown(f'of TF from {frame!r} to {edge.parent!r}, {reason}') from reason
            pose, beyond_s = pose.then(found.value), max(beyond_s, found.beyond_s)
        return Found(pose, beyond_s)
