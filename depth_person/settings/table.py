"""The parameters of every node: what nodes declare, and the README lists."""
from __future__ import annotations

from collections.abc import Mapping
import difflib
from types import MappingProxyType

from depth_person.settings.camera import CameraSettings
from depth_person.settings.depth import DepthSettings
from depth_person.settings.mavlink import MavlinkSettings
from depth_person.settings.parameter import ParameterSpec, specs
from depth_person.settings.pose import PoseSettings

#: Names that ROS 2 itself declares on every node.
_FOREIGN = ('use_sim_time', 'start_type_description_service')

#: Node name -> its parameters, in the order in which the README lists them.
PARAMETERS: Mapping[str, tuple[ParameterSpec, ...]] = MappingProxyType({
    'camera_node': specs(CameraSettings),
    'pose_node': specs(PoseSettings),
    'depth_node': specs(DepthSettings),
    'mavlink_node': specs(MavlinkSettings),
})


def unknown_parameter(given: str, own: tuple[ParameterSpec, ...]) -> str:
    """
    Return what is wrong with the name of a parameter given to a node; nothing if it is fine.

    A file may give one parameter to all nodes (`/**:`), so what any node knows is let through.
    """
    known = {spec.name for table in PARAMETERS.values() for spec in table}
    if given in known or given in _FOREIGN or given.startswith('qos_overrides.'):
        return ''
    names = [spec.name for spec in own]
    close = difflib.get_close_matches(given, names, n=1)
    meant = f'did you mean {close[0]}?' if close else f'it takes {", ".join(names)}'
    return f'there is no parameter {given!r}; {meant}'
