import json

import onnx

from depth_person.distance.lifter import MODEL_PATH

METRICS = json.loads(MODEL_PATH.with_suffix('.json').read_text(encoding='utf-8'))


def test_the_network_is_small_and_valid():
    assert MODEL_PATH.stat().st_size <= 2_000_000
    onnx.checker.check_model(onnx.load(MODEL_PATH), full_check=True)


def test_sigma_was_true_on_held_out_bodies_in_every_group():
    for name, figures in METRICS['held_out'].items():
        assert figures['n'] > 500, name
        assert 0.63 <= figures['within_1_sigma'] <= 0.73, name
        assert 0.92 <= figures['within_2_sigma'] <= 0.98, name


def test_the_metrics_say_how_to_repeat_the_training():
    assert set(METRICS['options']) >= {'bodies', 'epochs', 'seed'}
    assert set(METRICS['versions']) >= {'anny', 'torch'}
