"""The table of parameters holds together."""
from dataclasses import fields

import pytest

from depth_person.errors import DepthPersonError
from depth_person.pose.pipeline import PoseOptions
from depth_person.pose.runtime import PROVIDERS
from depth_person.settings.camera import CameraSettings
from depth_person.settings.depth import DepthSettings
from depth_person.settings.parameter import ParameterSpec, specs
from depth_person.settings.pose import PoseSettings
from depth_person.settings.table import PARAMETERS, unknown_parameter

EVERY = [(node, spec) for node, table in PARAMETERS.items() for spec in table]
CHECKED = [
    (ParameterSpec('p', 1.5, '', minimum=1.0, maximum=2.0), 2, 2.0),
    (ParameterSpec('p', 1.5, '', minimum=1.0, maximum=2.0), 1.0, 1.0),
    (ParameterSpec('p', 1.5, ''), 1e9, 1e9),
    (ParameterSpec('p', 3, '', minimum=1, maximum=9), 9, 9),
    (ParameterSpec('p', True, ''), False, False),
    (ParameterSpec('p', 'a', '', choices=('a', 'b')), 'b', 'b'),
]
REFUSED = [
    (ParameterSpec('p', 1.5, '', minimum=1.0, maximum=2.0), 3, 'p = 3 is out of range: 1 to 2'),
    (ParameterSpec('p', 1.5, ''), float('nan'), 'out of range'),
    (ParameterSpec('p', 1.5, ''), True, 'takes a double, not True'),
    (ParameterSpec('p', 3, ''), 3.0, 'takes a integer, not 3.0'),
    (ParameterSpec('p', True, ''), 1, 'takes a bool, not 1'),
    (ParameterSpec('p', 'a', ''), None, 'takes a string, not None'),
    (ParameterSpec('p', 'a', '', choices=('a', 'b')), 'c', "'c' is not one of a, b"),
]


@pytest.mark.parametrize(('spec', 'given', 'taken'), CHECKED)
def test_a_right_value_is_taken_and_an_integer_for_a_double(spec, given, taken):
    value = spec.checked(given)
    assert value == taken
    assert type(value) is type(taken)


@pytest.mark.parametrize(('spec', 'given', 'said'), REFUSED)
def test_a_wrong_value_is_refused_with_the_reason(spec, given, said):
    with pytest.raises(DepthPersonError, match=said):
        spec.checked(given)


@pytest.mark.parametrize(('node', 'spec'), EVERY)
def test_every_default_is_allowed_and_described(node, spec):
    assert spec.checked(spec.default) == spec.default
    assert spec.description.endswith('.')


def test_the_defaults_of_pose_node_are_those_of_the_pose_stage():
    ours = PoseSettings()
    theirs = PoseOptions()
    assert {field.name: getattr(ours, field.name) for field in fields(PoseOptions)} == vars(theirs)
    provider = next(spec for spec in specs(PoseSettings) if spec.name == 'provider')
    assert set(provider.choices) == set(PROVIDERS)


@pytest.mark.parametrize(('given', 'settings', 'said'), [
    ('source', CameraSettings, ''),
    ('shoulder_width', CameraSettings, ''),  # from a section for all nodes
    ('use_sim_time', DepthSettings, ''),
    ('qos_overrides./image_raw.publisher.depth', CameraSettings, ''),
    ('shoulderwidth', DepthSettings, 'did you mean shoulder_width?'),
    ('xyz', PoseSettings, 'it takes autostart, model'),
])
def test_a_name_that_no_node_knows_is_called_out(given, settings, said):
    wrong = unknown_parameter(given, specs(settings))
    assert said in wrong
    assert bool(wrong) == bool(said)
