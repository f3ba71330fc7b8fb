"""First crossings of polynomials, against a dense search."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from evslip.events.pixels import crossing
from evslip.events.pixels.lowpass import advance_far
from evslip.events.pixels.pixel import pieces, septic, tolerance

lags, changes = st.floats(-1.5, 1.5), st.floats(-1.0, 1.0)
rates = st.tuples(st.floats(1e-3, 0.5), st.floats(1e-5, 0.01))
PLACES = np.linspace(0.0, 1.0, 4001)


def piece(lag: float, change: float, rate: tuple[float, float]) -> tuple[tuple[float, ...], list[float]]:
    """lp on a piece that begins at L = 4: as a polynomial, and at 17 places exactly."""
    base, gain = rate
    current = np.exp(4.0)

    def lp(w: float) -> float:
        return advance_far(4.0, 4.0 + change * w, current, current * np.exp(change * w), 4.0 + lag, base * w, gain * w)

    lag_1 = lp(1.0) - 4.0 - change
    c = septic(4.0, change, current, current * np.exp(change), lag, lag_1, base, gain)
    return c, [lp(w) for w in np.linspace(0.0, 1.0, 17)]


@settings(max_examples=200)
@given(lags, changes, rates)
def test_one_polynomial_is_lp_within_the_tolerance(lag, change, rate):
    c, exact = piece(lag, change, rate)
    steepest = rate[0] + rate[1] * np.exp(4.0) * max(1.0, np.exp(change))
    lag_1 = exact[-1] - 4.0 - change
    if pieces(change, steepest, lag, lag_1, 1e9) > 1:
        return
    # The other side has an error of its own, see `lowpass`.
    found = [crossing.value(c, w) for w in np.linspace(0.0, 1.0, 17)]
    np.testing.assert_allclose(found, exact, atol=tolerance(exact[-1] - exact[0], 1e9) + 4e-7)


@settings(max_examples=300)
@given(lags, changes, rates, st.floats(0.0, 0.5), st.floats(0.01, 0.3), st.floats(0.01, 0.3))
def test_the_first_crossing_is_found(lag, change, rate, low, on, off):
    c, _ = piece(lag, change, rate)
    d = (c[0] - crossing.value(c, low), *c[1:])
    begin, end, place, sign = crossing.bracket(d, low, 1.0, on, off)
    level = {1.0: on, -1.0: -off, 0.0: 0.0}[sign]
    f = (d[0] - level, *d[1:])
    for _ in range(crossing.MOST_STEPS):
        before = place
        begin, end, place = crossing.refine(f, begin, end, before, sign)
        if abs(place - before) < crossing.CLOSE:
            break
    else:
        raise AssertionError("the search does not end")
    values = np.polynomial.Polynomial(d)(PLACES)
    beyond = (low <= PLACES) & ((values >= on) | (values <= -off))
    if sign == 0.0:
        # Only what the turn's place is wrong by may be missed.
        assert not np.any((low <= PLACES) & ((values >= on + 1e-6) | (values <= -off - 1e-6)))
        return
    assert abs(crossing.value(f, place)) < 1e-9
    assert np.any(beyond) or abs(values - level).min() < 1e-4
    if np.any(beyond):
        first = PLACES[np.argmax(beyond)]
        assert place <= first + 1e-9
        assert crossing.value(f, place) * sign >= -1e-9
