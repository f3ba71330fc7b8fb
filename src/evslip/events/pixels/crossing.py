"""Places where a cubic first leaves a band."""

import math

from evslip.utils.jit import compiled


@compiled(error_model="numpy")
def _root(c0: float, c1: float, c2: float, c3: float, low: float, high: float) -> float:
    """Zero of the cubic between two points where its signs differ: Newton's method, kept in the bracket."""
    at_low = c0 + low * (c1 + low * (c2 + low * c3))
    at_high = c0 + high * (c1 + high * (c2 + high * c3))
    if at_low * at_high >= 0.0:
        return low if abs(at_low) < abs(at_high) else high
    w = low + (high - low) * at_low / (at_low - at_high)
    if c2 == 0.0 and c3 == 0.0:
        return w
    for _ in range(60):
        value = c0 + w * (c1 + w * (c2 + w * c3))
        if (value > 0.0) == (at_high > 0.0):
            high = w
        else:
            low = w
        slope = c1 + w * (2.0 * c2 + w * 3.0 * c3)
        following = w - value / slope if slope != 0.0 else low
        if not low < following < high:
            following = 0.5 * (low + high)
        # Newton's steps square their error: the next one would be below 1e-14.
        if abs(following - w) < 1e-7:
            return following
        w = following
    return w


@compiled(error_model="numpy", inline="always")
def straight_crossing(c0: float, c1: float, low: float, high: float, on: float, off: float) -> tuple[float, int]:
    """`crossing` of the line c0 + c1 w."""
    at_low, at_high = c0 + low * c1, c0 + high * c1
    if at_low >= on or at_low <= -off:
        return low, 1 if at_low >= on else -1
    if at_high >= on or at_high <= -off:
        sign = 1 if at_high >= on else -1
        place = ((on if sign > 0 else -off) - c0) / c1
        return min(max(place, low), high), sign
    return high, 0


@compiled(error_model="numpy")
def crossing(
    c0: float, c1: float, c2: float, c3: float, low: float, high: float, on: float, off: float
) -> tuple[float, int]:
    """First place in [low, high] where the cubic is at or above `on` (+1) or at or below -`off` (-1); 0: nowhere."""
    if c2 == 0.0 and c3 == 0.0:
        return straight_crossing(c0, c1, low, high, on, off)
    turn_1 = turn_2 = high
    # Where the cubic turns; the form of the quadratic's roots that loses no digits when c3 is small.
    discriminant = c2 * c2 - 3.0 * c3 * c1
    if discriminant > 0.0:
        q = -(c2 + math.copysign(math.sqrt(discriminant), c2))
        a = c1 / q if q != 0.0 else high
        b = q / (3.0 * c3) if c3 != 0.0 else high
        turn_1, turn_2 = min(a, b), max(a, b)
    start = low
    for part in range(3):
        end = turn_1 if part == 0 else (turn_2 if part == 1 else high)
        end = min(max(end, start), high)
        value = c0 + end * (c1 + end * (c2 + end * c3))
        if value >= on:
            return _root(c0 - on, c1, c2, c3, start, end), 1
        if value <= -off:
            return _root(c0 + off, c1, c2, c3, start, end), -1
        if end == high:
            break
        start = end
    return high, 0
