"""What single precision says at a glance, against double precision."""

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from evslip.events import glance
from evslip.events.lowpass import advance_far

F = np.float32
logs = st.floats(-2.0, 5.5)
corners = st.tuples(st.floats(1e-4, 1.0), st.floats(1e-6, 0.02))


def tile(*values: float) -> list[np.ndarray]:
    return [np.full(1, value, F) for value in values]


def test_logarithms():
    values = np.exp(np.random.default_rng(0).uniform(-14.0, 14.0, 10_000)).astype(F)
    out = np.empty_like(values)
    glance.logarithms(values, out)
    np.testing.assert_allclose(out, np.log(values.astype(float)), atol=1.2e-6)


@settings(deadline=None)
@given(logs, st.floats(-0.25, 0.25), st.floats(-2.0, 2.0), corners)
def test_a_step_is_that_of_the_low_pass(log, change, lag, corner):
    base, gain = (F(number) for number in corner)
    current_0, current_1 = F(math.exp(log)), F(math.exp(log + change))
    x, exponent, step = glance.whole_step(current_0, current_1, base, gain, F(lag))
    log_0, log_1 = math.log(current_0), math.log(current_1)
    assert abs(x - (log_1 - log_0)) <= 3e-7 * abs(log_1 - log_0) + 1e-12
    if not glance.is_wide(x, exponent):
        exact = advance_far(log_0, log_1, float(current_0), float(current_1), log_0 + float(F(lag)), base, gain)
        moved = abs(float(F(lag))) * -math.expm1(-exponent) + abs(log_1 - log_0)
        assert abs((log_1 + float(F(lag)) + step) - exact) <= 2e-6 * moved + 3e-7
        arrays = [np.empty(1, F), np.empty(1, F), np.empty(1, F)]
        before, after, was = tile(current_0, current_1, lag)
        glance.changes(before, after, base, gain, *arrays[:2])
        glance.lag_steps(before, after, *arrays[:2], gain, was, arrays[2])
        assert (arrays[0][0], arrays[1][0], arrays[2][0]) == (x, exponent, step)


def test_many_tiny_steps_are_not_rounded_away():
    # A slow ramp seen through a slow filter: the lag settles at slope / rate although each step is far below its last
    # digit. Plain single precision stalls at 1e-4 of it.
    steps, rate, slope = 400_000, F(2e-5), 1e-6
    lag, rest = F(0.0), F(0.0)
    current, ratio = 100.0, math.exp(slope)
    for _ in range(steps):
        following = current
        _, _, step = glance.whole_step(F(following), F(following * ratio), rate, F(0.0), lag)
        lag, rest = glance.added(lag, rest, step)
    x, _, _ = glance.whole_step(F(current), F(current * ratio), rate, F(0.0), F(0.0))
    expected = -float(x) / float(rate) * -math.expm1(-float(rate) * steps)
    assert abs((float(lag) + float(rest)) / expected - 1.0) < 1e-6


@settings(deadline=None, max_examples=200)
@given(logs, st.floats(-0.25, 0.25), st.floats(-1.0, 1.0), corners, st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_a_pixel_that_is_let_off_stays_within_its_fences(log, change, lag, corner, above, below):
    base, gain = (F(number) for number in corner)
    current_0, current_1 = F(math.exp(log)), F(math.exp(log + change))
    x, exponent, step = glance.whole_step(current_0, current_1, base, gain, F(lag))
    if glance.is_wide(x, exponent):
        return
    high, low = log + lag + above, log + lag - below
    mark = np.empty(1, np.uint8)
    glance.might_fire(
        *tile(log, x, exponent, lag, lag + step, high - glance.MARGIN, low + glance.MARGIN), mark
    )  # fmt: skip
    if mark[0]:
        return
    for share in np.linspace(0.0, 1.0, 21)[1:]:
        current = math.exp(log + change * share)
        lp = advance_far(
            log, log + change * share, float(current_0), current, log + lag, float(base) * share, float(gain) * share
        )  # fmt: skip
        assert low < lp < high
