"""ROS 2 parameter files, read without ROS."""
from __future__ import annotations

from collections.abc import Iterator, Mapping
import logging
from pathlib import Path
import re
from typing import Any, TypeVar

import yaml

from depth_person.errors import DepthPersonError
from depth_person.settings.parameter import ParameterValue, specs
from depth_person.settings.table import unknown_parameter

LOG = logging.getLogger(__name__)
_PARAMETERS = 'ros__parameters'
#: What YAML 1.1 calls a truth value, in the spellings that rcl accepts.
_TRUTH = {
    word: value
    for value, words in ((True, ('y', 'yes', 'true', 'on')), (False, ('n', 'no', 'false', 'off')))
    for lower in words for word in (lower, lower.capitalize(), lower.upper())}
_INTEGER = re.compile(r'[+-]?(0[xX][0-9a-fA-F]+|0[0-7]*|[1-9][0-9]*)')
_DOUBLE = re.compile(
    r'[+-]?((\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|\.?(inf|Inf|INF|nan|NaN|NAN))')

Settings = TypeVar('Settings')


class ParameterFile:
    """
    The parameters that a file gives to nodes, by the rules of rcl.

    A section is named after a node (`pose_node`, `/front/pose_node`, or nested under a namespace),
    where `*` stands for one name and `**` for any number of them. Of several sections that fit,
    the later in the file has the last word.

    :raises DepthPersonError: when the file cannot be read, or is no parameter file.
    """

    def __init__(self, path: str | Path) -> None:
        self._path = Path(path)
        self._sections: dict[str, dict[str, Any]] = {}
        try:
            document = yaml.compose(self._path.read_text(encoding='utf-8'), yaml.SafeLoader)
        except OSError as error:
            raise DepthPersonError(
                f'parameter file {path} cannot be read: {error.strerror}') from error
        except (yaml.YAMLError, UnicodeDecodeError) as error:
            reason = ' '.join(str(error).split())
            raise DepthPersonError(f'parameter file {path} is not YAML: {reason}') from error
        if document is not None:
            self._add_sections(document, '')

    def parameters(self, node: str, *, namespace: str = '/') -> dict[str, Any]:
        """Return what the file gives to a node, by name; groups are joined by dots."""
        full_name = f'/{namespace.strip("/")}/{node}'.replace('//', '/')
        found: dict[str, Any] = {}
        for pattern, values in self._sections.items():
            if _fits(pattern, full_name):
                found.update(values)
        return found

    def _add_sections(self, node: yaml.Node, name: str) -> None:
        for key, value in self._entries(node, name or 'the file'):
            if key != _PARAMETERS:
                self._add_sections(value, f'{name}/{key.strip("/")}')
                continue
            if not name:
                raise self._fault(key, f'there is no node name above {_PARAMETERS}')
            section = self._sections.setdefault(name, {})
            section.update(self._values(value, ''))

    def _values(self, node: yaml.Node, prefix: str) -> Iterator[tuple[str, Any]]:
        for key, value in self._entries(node, prefix.rstrip('.') or _PARAMETERS):
            if isinstance(value, yaml.MappingNode):
                yield from self._values(value, f'{prefix}{key}.')
            elif isinstance(value, yaml.SequenceNode):
                yield f'{prefix}{key}', [_scalar(item) for item in value.value]
            elif value.value or value.style:
                yield f'{prefix}{key}', _scalar(value)
            else:
                raise self._fault(f'{prefix}{key}', 'has no value')

    def _entries(self, node: yaml.Node, name: str) -> Iterator[tuple[str, yaml.Node]]:
        if not isinstance(node, yaml.MappingNode):
            raise self._fault(
                name, f'holds no names; a parameter file reads NODE: {_PARAMETERS}: NAME: VALUE, '
                'where the node /** stands for all of them')
        for key, value in node.value:
            yield str(key.value), value

    def _fault(self, name: str, what: str) -> DepthPersonError:
        return DepthPersonError(f'parameter file {self._path}: {name} {what}')


def node_settings(
    node: str, settings: type[Settings], *, file: Path | None, namespace: str = '/',
    overrides: Mapping[str, ParameterValue] | None = None,
) -> Settings:
    """
    Return the settings of a node; what neither file nor overrides give has its default.

    :param settings: a dataclass of depth_person.settings.
    :param file: a ROS 2 parameter file; None for none.
    :param overrides: values that come before the file's.
    :raises DepthPersonError: when a value is of a wrong type or out of its range.
    """
    given = ParameterFile(file).parameters(node, namespace=namespace) if file else {}
    try:
        return make_settings(settings, {**given, **(overrides or {})})
    except DepthPersonError as error:
        raise DepthPersonError(f'{file or "parameters"}, {node}: {error}') from error


def make_settings(settings: type[Settings], given: Mapping[str, Any]) -> Settings:
    """
    Return checked settings; what is not given has its default, what is unknown gets a warning.

    :param settings: a dataclass of depth_person.settings.
    :raises DepthPersonError: when a value is of a wrong type or out of its range.
    """
    table = specs(settings)
    for name in given:
        if wrong := unknown_parameter(name, table):
            LOG.warning('%s', wrong)
    return settings(**{
        spec.name: spec.checked(given.get(spec.name, spec.default)) for spec in table})


def _fits(pattern: str, full_name: str) -> bool:
    """Return whether the name of a section stands for a node."""
    expression = re.sub(
        r'/\*\*?', lambda wildcard: r'(/\w+)*' if wildcard[0] == '/**' else r'/\w+', pattern)
    return re.fullmatch(expression, full_name) is not None


def _scalar(node: yaml.Node) -> bool | int | float | str:
    """Return the value of a scalar as rcl takes it, which is not quite as YAML does."""
    text = str(node.value)
    if node.style is not None:  # in quotes, or a block
        return text
    if text in _TRUTH:
        return _TRUTH[text]
    if _INTEGER.fullmatch(text):
        number = int(text, _base(text))
        return number if abs(number) < 2 ** 63 else float(number)
    if _DOUBLE.fullmatch(text):
        return float(re.sub(r'\.(?=[A-Za-z])', '', text))
    return text


def _base(digits: str) -> int:
    """Return the base of an integer as C writes them."""
    unsigned = digits.lstrip('+-')
    if unsigned[:2].lower() == '0x':
        return 16
    return 8 if unsigned[0] == '0' else 10
