"""Parameter files as ROS reads them, without ROS; the values of each case are what rclpy gave."""
import math

import pytest

from depth_person.errors import DepthPersonError
from depth_person.settings.depth import DepthSettings
from depth_person.settings.files import node_settings, ParameterFile
from depth_person.settings.pose import PoseSettings


@pytest.fixture
def file(tmp_path):
    """Return a function that writes a parameter file."""
    def write_file(text):
        path = tmp_path / 'params.yaml'
        path.write_text(text)
        return path
    return write_file


@pytest.mark.parametrize(('pattern', 'fitting'), [
    ('/**', ['/', '/x', '/x/y']),
    ('/*', ['/']),
    ('/**/pose_node', ['/', '/x', '/x/y']),
    ('/*/pose_node', ['/x']),
    ('/x/**', ['/x', '/x/y']),
    ('/x/*', ['/x']),
    ('/x/*/pose_node', ['/x/y']),
    ('/x/**/pose_node', ['/x', '/x/y']),
    ('/*/*', ['/x']),
    ('/**/x/**', ['/x', '/x/y']),
    ('pose_node', ['/']),
    ('x/pose_node', ['/x']),
    ('/x/y/pose_node', ['/x/y']),
    ('/**/depth_node', []),
])
def test_a_section_is_for_the_nodes_that_its_name_stands_for(file, pattern, fitting):
    parameters = ParameterFile(file(f'{pattern}:\n  ros__parameters: {{a: 1}}\n'))

    assert [namespace for namespace in ('/', '/x', '/x/y')
            if parameters.parameters('pose_node', namespace=namespace)] == fitting


def test_the_later_of_two_sections_has_the_last_word(file):
    text = '{}:\n  ros__parameters: {{a: 1, b: 1}}\n{}:\n  ros__parameters: {{a: 2}}\n'

    for sections in (('/**', 'pose_node'), ('pose_node', '/**')):
        assert ParameterFile(file(text.format(*sections))).parameters('pose_node') == {
            'a': 2, 'b': 1}


def test_namespaces_may_be_nested_and_groups_are_joined_by_dots(file):
    parameters = ParameterFile(file(
        '/x:\n  pose_node:\n    ros__parameters:\n      qos: {deep: {depth: 3}}\n'))

    assert parameters.parameters('pose_node', namespace='/x/') == {'qos.deep.depth': 3}


@pytest.mark.parametrize(('text', 'value'), [
    ('yes', True), ('On', True), ('FALSE', False), ('n', False), ('yES', 'yES'),
    ('"yes"', 'yes'), ("'1'", '1'), ('012', 10), ('-012', -10), ('0x1F', 31), ('+5', 5),
    ('09', 9.0), ('1.', 1.0), ('.5', 0.5), ('1e3', 1000.0), ('.inf', math.inf),
    ('-.Inf', -math.inf), ('inf', math.inf), ('1_000', '1_000'), ('1:30', '1:30'), ('~', '~'),
    ('null', 'null'), ('2001-01-01', '2001-01-01'), ('0b11', '0b11'), ('[1, 2]', [1, 2]),
    ('9223372036854775808', 9223372036854775808.0),
])
def test_values_have_the_types_that_rcl_gives_them(file, text, value):
    found = ParameterFile(file(f'/**:\n  ros__parameters:\n    a: {text}\n'))

    result = found.parameters('pose_node')['a']
    assert result == value
    assert type(result) is type(value)


@pytest.mark.parametrize(('text', 'fault'), [
    ('pose_node: {a: 1}', r'/pose_node/a holds no names; .* NODE: ros__parameters'),
    ('ros__parameters: {a: 1}', 'there is no node name above ros__parameters'),
    ('[1, 2]', 'the file holds no names'),
    ('pose_node: {ros__parameters: 3}', 'ros__parameters holds no names'),
    ('pose_node: {ros__parameters: {a: }}', 'a has no value'),
    ('x: {', 'is not YAML'),
])
def test_what_is_no_parameter_file_is_refused_with_the_reason(file, text, fault):
    with pytest.raises(DepthPersonError, match=fault):
        ParameterFile(file(text))


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(DepthPersonError, match=r'params\.yaml cannot be read: No such file'):
        ParameterFile(tmp_path / 'params.yaml')


def test_settings_come_from_overrides_the_file_and_defaults_in_this_order(file):
    path = file('/**:\n  ros__parameters: {stature: 2, children: true, model: other}\n')

    settings = node_settings(
        'depth_node', DepthSettings, file=path, overrides={'children': False})

    assert (settings.stature, settings.children) == (2.0, False)
    assert settings.max_range == DepthSettings.max_range
    assert node_settings('pose_node', PoseSettings, file=None) == PoseSettings()


@pytest.mark.parametrize(('text', 'fault'), [
    ('stature: 9', 'params.yaml, depth_node: stature = 9 is out of range'),
    ('stature: tall', "stature takes a double, not 'tall'"),
])
def test_wrong_values_are_refused_with_the_file_and_the_node(file, text, fault):
    with pytest.raises(DepthPersonError, match=fault):
        node_settings('depth_node', DepthSettings,
                      file=file(f'/**:\n  ros__parameters: {{{text}}}\n'))


def test_unknown_names_are_told_with_what_was_meant(file, caplog):
    node_settings('depth_node', DepthSettings,
                  file=file('/**:\n  ros__parameters: {estimater: skeleton}\n'))

    assert "no parameter 'estimater'; did you mean estimator?" in caplog.text
