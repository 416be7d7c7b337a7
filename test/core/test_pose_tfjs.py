"""TensorFlow.js graph models are read as they were written, or refused."""
from __future__ import annotations

import json

import numpy as np
import pytest
from tfjs_graphs import node, write_graph

from depth_person.errors import DepthPersonError
from depth_person.pose.tfjs import read_graph_model

KERNEL = np.array([[0.5, -2.0], [65504.0, 6.1035156e-05]])


@pytest.fixture
def graph_file(tmp_path):
    nodes = [
        node('input', 'Placeholder'),
        node('net/scope_0/first', 'Relu', ['input', '^input']),
        node('net/scope_0/second', 'Conv', ['net/scope_0/first:0', 'kernel'],
             strides=[1, 2, 2, 1], padding='SAME', fused_ops=['BiasAdd', 'Relu'], flag=True,
             nothing=[]),
        node('out', 'Identity', ['net/scope_0/second'])]
    weights = {'kernel': KERNEL, 'size': np.array([2, 3]), 'scalar': np.array(7)}
    return write_graph(tmp_path / 'net.json', nodes, weights)


def test_half_precision_weights_come_back_as_float32(graph_file):
    kernel = read_graph_model(graph_file).weights['kernel']
    assert kernel.dtype == np.float32
    np.testing.assert_array_equal(kernel, KERNEL.astype(np.float32))


def test_each_weight_is_read_from_its_own_place(graph_file):
    weights = read_graph_model(graph_file).weights
    np.testing.assert_array_equal(weights['size'], [2, 3])
    assert weights['scalar'] == 7


def test_weights_may_be_spread_over_files(graph_file):
    whole = graph_file.with_suffix('.bin').read_bytes()
    for name, part in (('a.bin', whole[:5]), ('b.bin', whole[5:])):
        graph_file.with_name(name).write_bytes(part)
    document = json.loads(graph_file.read_text())
    document['weightsManifest'][0]['paths'] = ['a.bin', 'b.bin']
    graph_file.write_text(json.dumps(document))
    np.testing.assert_array_equal(
        read_graph_model(graph_file).weights['kernel'], KERNEL.astype(np.float32))


def test_attributes_become_plain_values(graph_file):
    found = read_graph_model(graph_file).nodes['net/scope_0/second']
    assert found.attributes == {
        'strides': [1, 2, 2, 1], 'padding': 'SAME', 'fused_ops': ['BiasAdd', 'Relu'],
        'flag': True, 'nothing': []}


def test_inputs_leave_out_output_numbers_and_control_edges(graph_file):
    nodes = read_graph_model(graph_file).nodes
    assert nodes['net/scope_0/first'].inputs == ('input',)
    assert nodes['net/scope_0/second'].inputs == ('net/scope_0/first', 'kernel')


def test_a_scope_ends_where_the_rest_of_the_graph_reads_it(graph_file):
    assert read_graph_model(graph_file).scope_end('scope_0') == 'net/scope_0/second'


def test_a_scope_that_is_not_there_is_named(graph_file):
    with pytest.raises(DepthPersonError, match='0 outputs named center_0'):
        read_graph_model(graph_file).scope_end('center_0')


@pytest.mark.parametrize('lost', [1, 5, 20])
def test_a_weight_file_cut_short_is_refused(graph_file, lost):
    binary = graph_file.with_suffix('.bin')
    binary.write_bytes(binary.read_bytes()[:-lost])
    with pytest.raises(DepthPersonError, match=r'net\.bin is cut short'):
        read_graph_model(graph_file)


def test_a_weight_file_too_long_is_refused(graph_file):
    with graph_file.with_suffix('.bin').open('ab') as binary:
        binary.write(b'\0')
    with pytest.raises(DepthPersonError, match='has 21 bytes where the graph needs 20'):
        read_graph_model(graph_file)


@pytest.mark.parametrize('content', [
    '', '{', '[]', '{"modelTopology": 3}', '{"modelTopology": {"node": []}}',
    '{"modelTopology": {"node": [{}]}, "weightsManifest": []}'])
def test_what_is_no_graph_model_is_refused(tmp_path, content):
    path = tmp_path / 'net.json'
    path.write_text(content)
    with pytest.raises(DepthPersonError, match='not a TensorFlow'):
        read_graph_model(path)


@pytest.mark.parametrize('suffix', ['.json', '.bin'])
def test_a_missing_file_is_named(graph_file, suffix):
    graph_file.with_suffix(suffix).unlink()
    with pytest.raises(DepthPersonError, match=f'net{suffix}'):
        read_graph_model(graph_file)
