"""Counts of how late messages were."""
import tracemalloc

import numpy as np
import pytest

from depth_person.nodes.lateness import Lateness


@pytest.mark.parametrize('values_s', [
    [0.0], [0.25], [0.1, 0.3], [0.0, 0.0, 7.5], [2.0, 3.0],
    np.random.default_rng(1).lognormal(-7.0, 1.5, 5000)])
def test_the_shares_are_those_of_all_values_to_what_is_printed(values_s):
    lateness = Lateness()
    for value_s in values_s:
        lateness.add(float(value_s))

    assert lateness.count == len(values_s)
    assert lateness.most_s == max(values_s)
    for share in (0.5, 0.99, 1.0):
        exact_s = np.percentile(values_s, 100 * share, method='inverted_cdf')
        expected_s = exact_s if exact_s < 1 else max(values_s)
        assert lateness.within_s(share) == pytest.approx(expected_s, abs=0.51e-5)


def test_the_memory_does_not_grow_with_the_messages():
    lateness = Lateness()
    tracemalloc.start()
    try:
        for index in range(20_000):
            lateness.add(index * 1e-4)
        kept, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()

    assert kept < 10_000
