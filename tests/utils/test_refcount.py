"""Arrays passed on without counting references, and reductions that become vector code."""

from collections import namedtuple

import numpy as np
from numba import njit

from evslip.rendering.geometry.simd_minmax import larger, smaller
from evslip.utils.refcount import without_refcount

Pair = namedtuple("Pair", "first rest")


@njit
def _sums(arrays):
    arrays = without_refcount(arrays)
    total = arrays.first.sum()
    for part in arrays.rest:
        total += part.sum()
    return total


def test_tuples_of_arrays_are_passed_on_whole():
    arrays = Pair(np.arange(5.0), (np.ones(3), np.full(4, 2.0)))
    assert [_sums(arrays) for _ in range(3)] == [21.0] * 3
    assert arrays.first[-1] == 4 and arrays.rest[1][0] == 2  # still theirs


@njit
def _extent(values):
    low, high = values[0], values[0]
    for i in range(len(values)):
        low, high = smaller(low, values[i]), larger(high, values[i])
    return low, high


def test_the_extent_of_numbers_of_any_count_and_kind():
    rng = np.random.default_rng(0)
    for kind in (np.float32, np.float64):
        for count in (1, 15, 16, 17, 1000):
            values = rng.normal(size=count).astype(kind)
            assert _extent(values) == (values.min(), values.max())
