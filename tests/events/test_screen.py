"""Screening in single precision, against double precision."""

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from evslip.events.pixels import screen
from evslip.events.pixels.lowpass import advance_far

F = np.float32
logs = st.floats(-2.0, 5.5)
corners = st.tuples(st.floats(1e-4, 1.0), st.floats(1e-6, 0.02)) | st.tuples(
    st.floats(0.5, 200.0), st.floats(0.01, 1.0)
)
"""Of slow pixels, and of fast ones."""


def singles(numbers: tuple[float, ...]) -> tuple[np.float32, ...]:
    """Compiled functions hand float32 back as Python's float; passed on as it is, it would be computed in double."""
    return tuple(F(number) for number in numbers)


def test_logarithms():
    values = np.exp(np.random.default_rng(0).uniform(-14.0, 14.0, 10 * screen.TILE)).astype(F)
    numbers = np.ones(screen.VALUES, F)
    numbers[screen.HIGH :] = 0
    for part in values.reshape(-1, screen.TILE // 2):
        numbers[screen.CURRENT_0 : screen.CURRENT_0 + len(part)] = part
        screen.centre(numbers, len(part), F(0))
        found = -numbers[screen.OFFSET : screen.OFFSET + len(part)]
        np.testing.assert_allclose(found, np.log(part.astype(float)), atol=1.2e-6)


def test_the_greatest_of_some_numbers():
    values = np.random.default_rng(1).uniform(0, 300, 999).astype(F)
    assert screen.greatest(values) == values.max()


@given(logs, st.floats(-0.25, 0.25), st.floats(-2.0, 2.0), corners)
def test_a_step_is_that_of_the_low_pass(log, change, lag, corner):
    base, gain = (F(number) for number in corner)
    current_0, current_1 = F(math.exp(log)), F(math.exp(log + change))
    *numbers, wide = screen.whole_step(current_0, current_1, base, gain, F(lag))
    x, exponent, step = singles(numbers)
    log_0, log_1 = math.log(current_0), math.log(current_1)
    assert abs(float(x) - (log_1 - log_0)) <= 3e-7 * abs(log_1 - log_0) + 1e-12
    if not wide:
        exact = advance_far(log_0, log_1, float(current_0), float(current_1), log_0 + float(F(lag)), base, gain)
        moved = abs(float(F(lag))) * -math.expm1(-exponent) + abs(log_1 - log_0)
        assert abs((log_1 + float(F(lag)) + float(step)) - exact) <= 2e-6 * moved + 3e-7
        values, marks = np.ones(screen.VALUES, F), np.empty(screen.TILE, np.uint8)
        values[screen.CURRENT_0], values[screen.CURRENT_1] = current_0, current_1
        values[screen.LAG], values[screen.RESIDUE], values[screen.OFFSET] = lag, 0, 2.0
        steps = screen.advance_lowpass, screen.advance_lowpass_long, screen.advance_lowpass_steady
        steps[int(exponent > screen.SERIES_LIMIT) + int(exponent > screen.STEADY_LIMIT)](values, 16, base, gain, marks)
        assert (values[screen.LAG], values[screen.RESIDUE]) == singles(screen.added(F(lag), F(0.0), step))
        assert (values[screen.LAG_0], values[screen.CURRENT_0]) == (F(lag), current_1)
        assert values[screen.OFFSET] == F(2.0) - x


def test_many_tiny_steps_are_not_rounded_away():
    # A slow ramp seen through a slow filter: the lag settles at slope / rate although each step is far below its last
    # digit. Plain single precision ends 0.15 % short of it.
    steps, rate, slope = 400_000, F(2e-5), 1e-6
    lag, rest = F(0.0), F(0.0)
    before, after = F(100.0), F(100.0 * math.exp(slope))
    for _ in range(steps):
        step = F(screen.whole_step(before, after, rate, F(0.0), lag)[2])
        lag, rest = singles(screen.added(lag, rest, step))
    x, *_ = screen.whole_step(before, after, rate, F(0.0), F(0.0))
    expected = -float(x) / float(rate) * -math.expm1(-float(rate) * steps)
    assert abs((float(lag) + float(rest)) / expected - 1.0) < 1e-6


@settings(max_examples=200)
@given(logs, st.floats(-0.25, 0.25), st.floats(-1.0, 1.0), corners, st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_an_unmarked_pixel_stays_within_its_bounds(log, change, lag, corner, above, below):
    base, gain = (F(number) for number in corner)
    current_0, current_1 = F(math.exp(log)), F(math.exp(log + change))
    *numbers, wide = screen.whole_step(current_0, current_1, base, gain, F(lag))
    x, exponent, step = singles(numbers)
    if wide:
        return
    high, low = log + lag + above, log + lag - below
    bounds = F(high - screen.MARGIN), F(low + screen.MARGIN)
    middle, half = singles(screen.middle_and_half(*bounds, F(0.0), F(0.0)))
    if screen.marked(x, exponent, F(lag), F(lag) + step, middle - F(log), half, False):
        return
    for share in np.linspace(0.0, 1.0, 21)[1:]:
        log_1, rates = log + change * share, (float(base) * share, float(gain) * share)
        lp = advance_far(log, log_1, float(current_0), math.exp(log_1), log + lag, *rates)
        assert low < lp < high
