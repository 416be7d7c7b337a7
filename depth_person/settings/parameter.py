"""What a parameter is: a field of a settings dataclass with its type, range and meaning."""
from __future__ import annotations

from dataclasses import dataclass, field, fields
import math
from typing import TypeVar

from depth_person.errors import DepthPersonError

#: What a parameter of this package can hold.
ParameterValue = bool | int | float | str

_Value = TypeVar('_Value', bound=ParameterValue)
_TYPE_NAMES = {bool: 'bool', int: 'integer', float: 'double', str: 'string'}


@dataclass(frozen=True)
class ParameterSpec:
    """
    One parameter; the default decides its type.

    :ivar minimum: the lowest value allowed, for numbers.
    :ivar maximum: the highest value allowed, for numbers.
    :ivar choices: the only texts allowed; empty for any.
    :ivar read_only: whether it can only be given at the start.
    """

    name: str
    default: ParameterValue
    description: str
    minimum: float = -math.inf
    maximum: float = math.inf
    choices: tuple[str, ...] = ()
    read_only: bool = True

    @property
    def type_name(self) -> str:
        """The type's name in ROS 2."""
        return _TYPE_NAMES[type(self.default)]

    def checked(self, value: object) -> ParameterValue:
        """
        Return the value, an integer given for a double made one.

        :raises DepthPersonError: when it is of another type or out of range; says why.
        """
        kind = type(self.default)
        if kind is float and type(value) is int:
            value = float(value)
        if type(value) is not kind:
            raise DepthPersonError(f'{self.name} takes a {self.type_name}, not {value!r}')
        assert isinstance(value, (bool, int, float, str))
        if not isinstance(value, str) and not self.minimum <= value <= self.maximum:
            raise DepthPersonError(
                f'{self.name} = {value:g} is out of range: {self.minimum:g} to {self.maximum:g}')
        if self.choices and value not in self.choices:
            raise DepthPersonError(
                f'{self.name} = {value!r} is not one of {", ".join(self.choices)}')
        return value


def parameter(
    default: _Value, description: str, *, minimum: float = -math.inf, maximum: float = math.inf,
    choices: tuple[str, ...] = (), read_only: bool = True,
) -> _Value:
    """Return the field of a dataclass that is the parameter of the same name."""
    return field(default=default, metadata={
        'description': description, 'minimum': minimum, 'maximum': maximum, 'choices': choices,
        'read_only': read_only})


def specs(settings: type) -> tuple[ParameterSpec, ...]:
    """Return the parameters that a dataclass of them holds, in order."""
    return tuple(
        ParameterSpec(each.name, getattr(settings, each.name), **each.metadata)
        for each in fields(settings))
