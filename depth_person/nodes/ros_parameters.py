"""Declares a node's parameters, refuses wrong values with a reason, commits right ones."""
from __future__ import annotations

from collections.abc import Callable, Mapping
import math
from typing import Any

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.node import Node
from rclpy.parameter import Parameter

from depth_person.errors import DepthPersonError
from depth_person.settings.parameter import ParameterSpec, ParameterValue

#: What rclpy declares itself, and has taken over already.
_DECLARED_BY_ROS = ('use_sim_time', 'start_type_description_service')


def given_parameters(node: Node) -> dict[str, Any]:
    """
    Return the parameters that files and the command line give to a node.

    rclpy shows them only by declaring them as they come; this takes that back.

    :param node: made with automatically_declare_parameters_from_overrides.
    """
    given = {
        name: value.value for name, value in node.get_parameters_by_prefix('').items()
        if name not in _DECLARED_BY_ROS}
    for name in given:
        node.undeclare_parameter(name)
    return given


def declare(
    node: Node, table: tuple[ParameterSpec, ...], given: Mapping[str, Any],
) -> dict[str, ParameterValue]:
    """
    Declare the parameters of a table; return their values, given or default.

    :raises DepthPersonError: when a given value is out of range or of a wrong type.
    """
    values = {spec.name: spec.checked(given.get(spec.name, spec.default)) for spec in table}
    node.declare_parameters(
        '', [(spec.name, values[spec.name], _descriptor(spec)) for spec in table],
        ignore_override=True)
    return values


def watch(
    node: Node, table: tuple[ParameterSpec, ...], *,
    try_out: Callable[[Mapping[str, ParameterValue]], object],
    commit: Callable[[Mapping[str, ParameterValue]], None],
) -> None:
    """
    Check whatever is set from now on.

    :param try_out: called with what is about to be changed, each value being right by itself;
        raises DepthPersonError when they do not go together.
    :param commit: called with what was changed once all of it has been accepted.
    """
    known = {spec.name: spec for spec in table}

    def convert(parameters: list[Parameter]) -> list[Parameter]:
        """Make doubles of integers: `param set` of 30 to a double is meant as 30.0."""
        return [
            Parameter(each.name, value=float(each.value))
            if type(each.value) is int and type(_default(known, each.name)) is float else each
            for each in parameters]

    def check(parameters: list[Parameter]) -> SetParametersResult:
        try:
            try_out({each.name: known[each.name].checked(each.value)
                     for each in parameters if each.name in known})
        except DepthPersonError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def post(parameters: list[Parameter]) -> None:
        changed = {each.name: each.value for each in parameters if each.name in known}
        if changed:
            commit(changed)

    node.add_pre_set_parameters_callback(convert)
    node.add_on_set_parameters_callback(check)
    node.add_post_set_parameters_callback(post)


def _default(known: Mapping[str, ParameterSpec], name: str) -> ParameterValue | None:
    return known[name].default if name in known else None


def _descriptor(spec: ParameterSpec) -> ParameterDescriptor:
    descriptor = ParameterDescriptor(
        description=spec.description, read_only=spec.read_only,
        additional_constraints=f'one of {", ".join(spec.choices)}' if spec.choices else '')
    if math.isfinite(spec.minimum) and type(spec.default) is int:
        descriptor.integer_range = [
            IntegerRange(from_value=int(spec.minimum), to_value=int(spec.maximum))]
    elif math.isfinite(spec.minimum):
        descriptor.floating_point_range = [
            FloatingPointRange(from_value=spec.minimum, to_value=spec.maximum)]
    return descriptor
