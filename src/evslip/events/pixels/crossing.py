"""Places where lp first leaves a band: roots of polynomials, in steps without branches, which become vector code."""

from evslip.utils.jit import compiled, fused

Septic = tuple[float, float, float, float, float, float, float, float]
"""Coefficients of a polynomial of degree 7, of the constant first."""
CLOSE = 1e-7
"""Newton's steps square their error: after one as short as this, the next would be below 1e-14."""
MOST_STEPS = 60


@compiled(error_model="numpy", forceinline=True, _nrt=False)
def value(c: Septic, w: float) -> float:
    """Polynomial at w."""
    high = fused(w, fused(w, fused(w, c[7], c[6]), c[5]), c[4])
    return fused(w, fused(w, fused(w, fused(w, high, c[3]), c[2]), c[1]), c[0])


@compiled(error_model="numpy", forceinline=True, _nrt=False)
def slope(c: Septic, w: float) -> float:
    """Its derivative."""
    high = fused(w, fused(w, fused(w, 7.0 * c[7], 6.0 * c[6]), 5.0 * c[5]), 4.0 * c[4])
    return fused(w, fused(w, fused(w, high, 3.0 * c[3]), 2.0 * c[2]), c[1])


@compiled(error_model="numpy", forceinline=True, _nrt=False)
def _bend(c: Septic, w: float) -> float:
    high = fused(w, fused(w, fused(w, 42.0 * c[7], 30.0 * c[6]), 20.0 * c[5]), 12.0 * c[4])
    return fused(w, fused(w, high, 6.0 * c[3]), 2.0 * c[2])


@compiled(error_model="numpy", forceinline=True, _nrt=False)
def bracket(c: Septic, low: float, high: float, on: float, off: float) -> tuple[float, float, float, float]:
    """Stretch of [low, high] in which the polynomial, which turns there once at most, first reaches `on` or -`off`.

    Returns the stretch, a place in it to begin the search with, and the sign of the threshold; 0: it reaches none, and
    the place is `high`.
    """
    slope_low, slope_high = slope(c, low), slope(c, high)
    turn = low + (high - low) * (slope_low / (slope_low - slope_high))
    for _ in range(2):
        turn = min(max(turn - slope(c, turn) / _bend(c, turn), low), high)
    turn = turn if slope_low * slope_high < 0.0 else high
    at_turn, at_high = value(c, turn), value(c, high)
    by_turn = (at_turn >= on) | (at_turn <= -off)
    start, end, at_end = (low if by_turn else turn), (turn if by_turn else high), (at_turn if by_turn else at_high)
    start = low if start == high else start
    sign = 1.0 if at_end >= on else (-1.0 if at_end <= -off else 0.0)
    at_start = value(c, start)
    share = ((on if sign > 0.0 else -off) - at_start) / (at_end - at_start)
    place = start + (end - start) * (share if (share > 0.0) & (share < 1.0) else (0.0 if share <= 0.0 else 1.0))
    return start, end, place if sign != 0.0 else high, sign


@compiled(error_model="numpy", forceinline=True, _nrt=False)
def refine(c: Septic, start: float, end: float, place: float, sign: float) -> tuple[float, float, float]:
    """Stretch and place after a step towards the polynomial's zero: Newton's method, or halving where that leads out.

    sign: of the polynomial at the end; 0: there is nothing to search for.
    """
    at = value(c, place)
    beyond = at * sign >= 0.0
    start, end = (start if beyond else place), (place if beyond else end)
    following = place - at / slope(c, place)
    following = following if (following >= start) & (following <= end) else 0.5 * (start + end)
    return start, end, following if sign != 0.0 else place
