"""Logarithm and exponential in plain arithmetic, against the library's."""

import numpy as np

from evslip.events.sensor.exponential import exp, logarithms


def test_the_logarithm_is_that_of_the_library_but_for_its_last_bit():
    values = np.exp(np.random.default_rng(0).uniform(-80.0, 80.0, 20_000))
    expected = np.log(values)
    np.testing.assert_array_less(np.abs(logarithms(values) - expected), 1.01 * np.spacing(np.abs(expected)) + 1e-300)
    assert logarithms(np.ones(1))[0] == 0.0


def test_the_exponential_is_exact_to_1e_14():
    for value in np.random.default_rng(1).uniform(-300.0, 300.0, 2000):
        np.testing.assert_allclose(exp(value), np.exp(value), rtol=1e-13 if abs(value) > 10 else 2e-14)
    assert exp(-1e6) < 1e-300
    assert np.isfinite(exp(1e6))
