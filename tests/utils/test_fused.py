from fractions import Fraction

import numba
import numpy as np
import pytest

from evslip.utils.fused import fused


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_the_sum_is_rounded_once(kind):
    compute = numba.njit(lambda a, b, c: fused(a, b, c))
    numbers = np.random.default_rng(0).normal(size=(50, 2)).astype(kind)
    for a, b in numbers:
        product = Fraction(float(a)) * Fraction(float(b))
        # What is left of a product after rounding it: nothing, if the product were rounded first.
        c = -kind(float(product))
        assert compute(a, b, c) == float(product + Fraction(float(c)))
