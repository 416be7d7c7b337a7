"""A network for one person gives by itself the keypoints of who is drawn into its heads."""
from __future__ import annotations

from drawn_heads import DrawnHeads
from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
from onnx import helper, numpy_helper, TensorProto
import onnxruntime
import pytest

from depth_person.pose.movenet import FITTED, HEADS, MARKED
from depth_person.pose.movenet_keypoints import with_keypoints

SIDE = 48
CHANNELS = dict(zip(HEADS, (1, 34, 17, 34), strict=True))


def value(name, *shape):
    return helper.make_tensor_value_info(name, TensorProto.FLOAT, ['n', *shape])


def model_of(nodes, inputs, weights=None):
    """Return a model that gives HEADS."""
    graph = helper.make_graph(
        nodes, 'heads', inputs, [value(name, CHANNELS[name], SIDE, SIDE) for name in HEADS],
        [numpy_helper.from_array(each, name) for name, each in (weights or {}).items()])
    return helper.make_model(
        graph, opset_imports=[helper.make_opsetid('', 18)], ir_version=9)


@pytest.fixture(scope='module')
def keypoints_of():
    """Return a function that gives the keypoints in drawn heads, marked and fitted."""
    inputs = [value(f'{name}_is', CHANNELS[name], SIDE, SIDE) for name in HEADS]
    nodes = [helper.make_node('Identity', [f'{name}_is'], [name]) for name in HEADS]
    model = with_keypoints(model_of(nodes, inputs), side=SIDE)
    session = onnxruntime.InferenceSession(model.SerializeToString())

    def keypoints(*people):
        stacked = (np.stack(head) for head in zip(*(each.single for each in people), strict=True))
        return session.run([MARKED, FITTED], {
            f'{name}_is': head for name, head in zip(HEADS, stacked, strict=True)})
    return keypoints


@pytest.mark.parametrize('other_score', [0.85, 0.95])
def test_the_single_person_is_the_one_nearest_the_middle(keypoints_of, other_score):
    heads = DrawnHeads(SIDE, SIDE)
    heads.draw(8.5, 22.5, score=other_score)
    drawn = heads.draw(23.5, 23.5, score=0.9)
    (person,), _ = keypoints_of(heads)
    np.testing.assert_allclose(person[:, :2], drawn, atol=1e-4)
    np.testing.assert_allclose(person[:, 2], 0.9, atol=1e-6)


def test_the_single_person_may_be_off_the_middle(keypoints_of):
    heads = DrawnHeads(SIDE, SIDE)
    drawn = heads.draw(12.25, 18.75)
    (person,), _ = keypoints_of(heads)
    np.testing.assert_allclose(person[:, :2], drawn, atol=1e-4)


def test_of_two_marks_the_one_nearer_to_the_regressed_place_counts(keypoints_of):
    heads = DrawnHeads(SIDE, SIDE)
    nose = heads.draw(24.5, 24.5, score=0.6)[0]
    heads.mark(0, nose[0] + 12, nose[1], 0.9)
    (person,), _ = keypoints_of(heads)
    np.testing.assert_allclose(person[0], [*nose, 0.6], atol=1e-4)


def drawn_gaussian(x, y, *, offset_error=0.0):
    """Return the heads of one crop whose heat is centred between cells, and their keypoints."""
    heads = DrawnHeads(SIDE, SIDE)
    keypoints = heads.draw(x, y)
    rows, columns = np.indices((SIDE, SIDE))
    for index, (u, v) in enumerate(keypoints):
        heads.heatmap[index] = 0.9 * np.exp(
            -((columns + 0.5 - u) ** 2 + (rows + 0.5 - v) ** 2) / 2)
        heads.offset[2 * index:2 * index + 2] = (v - rows, u - columns)
    heads.offset += np.float32(offset_error)
    return heads, keypoints


@settings(max_examples=10)
@given(x=st.floats(15, 33), y=st.floats(15, 33))
def test_a_fitted_peak_is_where_heat_and_offset_agree(keypoints_of, x, y):
    heads, keypoints = drawn_gaussian(x, y)
    _, (found,) = keypoints_of(heads)
    np.testing.assert_allclose(found[:, :2], keypoints, atol=0.1)  # heat is cut off at 2 cells


def test_a_fitted_peak_halves_the_error_of_the_offset(keypoints_of):
    heads, keypoints = drawn_gaussian(24.5, 24.5, offset_error=0.5)
    (marked,), (fitted,) = keypoints_of(heads)
    np.testing.assert_allclose(marked[:, :2] - keypoints, 0.5, atol=1e-3)
    np.testing.assert_allclose(fitted[:, :2] - keypoints, 0.25, atol=0.1)


def test_crops_are_marked_each_by_itself(keypoints_of):
    alone = [drawn_gaussian(*place)[0] for place in ((20.5, 20.5), (30.25, 26.75))]
    together = keypoints_of(*alone)
    for index, heads in enumerate(alone):
        for all_of_them, each in zip(together, keypoints_of(heads), strict=True):
            np.testing.assert_allclose(all_of_them[index], each[0], atol=1e-5)


def test_a_peak_at_the_rim_is_fitted_from_what_there_is(keypoints_of):
    heads = DrawnHeads(SIDE, SIDE)
    drawn = heads.draw(30.0, 9.8)  # the eyes are in the first row
    _, (found,) = keypoints_of(heads)
    np.testing.assert_allclose(found[:, :2], drawn, atol=0.5)
    heat = heads.heatmap[1][:3, 28:33]  # the row before the first, and the one before that, lack
    centre = (heat.sum(1) @ (np.arange(3) + 0.5)) / heat.sum()
    np.testing.assert_allclose(found[1, 1], (drawn[1, 1] + centre) / 2, atol=1e-4)


def layers(head, rng):
    """Return the nodes and weights with which networks make a head of six features."""
    hidden, given = 8, CHANNELS[head]
    weights = {
        f'{head}/spread': rng.normal(size=(6, 1, 3, 3)), f'{head}/join': rng.normal(
            size=(hidden, 6, 1, 1)), f'{head}/join_bias': rng.normal(size=hidden),
        f'{head}/last': rng.normal(size=(given, hidden, 1, 1)),
        f'{head}/last_bias': rng.normal(size=given)}
    nodes = [
        helper.make_node(
            'Conv', ['features', f'{head}/spread'], [f'{head}/around'], group=6,
            auto_pad='SAME_UPPER', kernel_shape=[3, 3]),
        helper.make_node(
            'Conv', [f'{head}/around', f'{head}/join', f'{head}/join_bias'], [f'{head}/joined'],
            kernel_shape=[1, 1]),
        helper.make_node('Relu', [f'{head}/joined'], [f'{head}/relu']),
        helper.make_node(
            'Conv', [f'{head}/relu', f'{head}/last', f'{head}/last_bias'], [f'{head}/logit'],
            kernel_shape=[1, 1]),
        helper.make_node(
            'Sigmoid' if head in ('center', 'keypoint_heatmap') else 'Identity',
            [f'{head}/logit'], [head])]
    return nodes, {name: values.astype(np.float32) for name, values in weights.items()}


def test_layers_worked_out_at_keypoints_alone_give_what_they_give_everywhere(keypoints_of):
    rng = np.random.default_rng(5)
    nodes, weights = [], {}
    for head in HEADS:
        more, values = layers(head, rng)
        nodes += more
        weights |= values
    model = model_of(nodes, [value('features', 6, SIDE, SIDE)], weights)
    marked = with_keypoints(model, side=SIDE)
    features = rng.normal(size=(3, 6, SIDE, SIDE)).astype(np.float32)
    every, alone = (
        onnxruntime.InferenceSession(each.SerializeToString()).run(None, {'features': features})
        for each in (model, marked))
    drawn = []
    for heads in zip(*every, strict=True):
        drawn.append(DrawnHeads(SIDE, SIDE))
        drawn[-1].center, drawn[-1].regression, drawn[-1].heatmap, drawn[-1].offset = heads
    for keypoints, expected in zip(alone, keypoints_of(*drawn), strict=True):
        np.testing.assert_allclose(keypoints, expected, atol=1e-4)
    everywhere = {node.output[0] for node in marked.graph.node if node.op_type == 'Conv'}
    assert everywhere == {
        'keypoint_regression/around', 'keypoint_offset/around', *(
            f'{head}/{layer}' for head in ('center', 'keypoint_heatmap')
            for layer in ('around', 'joined', 'logit'))}
