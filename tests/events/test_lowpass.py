import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from evslip.events.pixels.lowpass import advance, advance_far, exponent

changes = st.floats(-4.0, 4.0)
logs = st.floats(-2.0, 5.5)


def by_integration(log_0: float, change: float, filtered: float, base: float, gain: float) -> float:
    def rate(t: float, lp: np.ndarray) -> np.ndarray:
        log = log_0 + change * t
        return (base + gain * math.exp(log)) * (log - lp)

    # Of a lag of 1e-320 the integrator would work out a first step that is not a number.
    return solve_ivp(rate, (0.0, 1.0), [filtered], method="LSODA", rtol=1e-11, atol=1e-12, first_step=1e-6).y[0, -1]


@settings(max_examples=60)
@given(logs, changes, st.floats(-2.0, 2.0), st.floats(1e-4, 1.0), st.floats(1e-6, 0.02))
def test_any_interval_solves_the_differential_equation(log_0, change, lag, base, gain):
    current = math.exp(log_0)
    ours = advance_far(log_0, log_0 + change, current, current * math.exp(change), log_0 + lag, base, gain)
    assert ours == pytest.approx(by_integration(log_0, change, log_0 + lag, base, gain), abs=1e-6)


@settings(max_examples=60)
@given(logs, st.floats(-0.8, 0.8), st.floats(-2.0, 2.0), st.floats(0.01, 400.0), st.floats(0.001, 2.0))
@example(0.0, 0.0, 5e-324, 137.0, 1.0625)
def test_a_fast_filter_settles_behind_the_light(log_0, change, lag, base, gain):
    current = math.exp(log_0)
    ours = advance_far(log_0, log_0 + change, current, current * math.exp(change), log_0 + lag, base, gain)
    assert ours == pytest.approx(by_integration(log_0, change, log_0 + lag, base, gain), abs=3e-7)


@given(logs, changes, st.lists(st.floats(0.01, 0.99), max_size=30), st.floats(1e-4, 1.0), st.floats(1e-6, 0.02))
def test_a_ramp_may_be_cut_anywhere(log_0, change, cuts, base, gain):
    log_1 = log_0 + change
    whole = advance_far(log_0, log_1, math.exp(log_0), math.exp(log_1), log_0 - 0.5, base, gain)
    lp, before = log_0 - 0.5, 0.0
    for cut in [*sorted(set(cuts)), 1.0]:
        a, b, length = log_0 + change * before, log_0 + change * cut, cut - before
        lp = advance_far(a, b, math.exp(a), math.exp(b), lp, base * length, gain * length)
        before = cut
    assert lp == pytest.approx(whole, abs=1e-6)


@given(st.floats(0.0, 100.0), st.floats(-3.0, 3.0))
def test_a_step_decays_exponentially(k, lag):
    # Constant input: lp approaches it as exp(-K), whatever K is.
    assert exponent(1.0, 1.0, math.e, math.e, k, 0.0) == k
    assert advance(1.0, 1.0, math.e, math.e, 1.0 + lag, 0.0, k) == pytest.approx(1.0 + lag * math.exp(-k), abs=1e-12)
