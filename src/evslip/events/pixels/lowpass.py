"""Photoreceptor: one-pole low-pass of log intensity whose corner rises with intensity.

Between two frames the logarithm L of the photocurrent Y is taken as linear in time, as every event simulator without
rendered sub-frames does. The filter obeys

    d lp / dt = k(t) (L(t) - lp),    k(t) = base + gain * Y(t),    Y = exp(L),

whose solution over an interval of length dt, with x = L1 - L0, is

    lp1 = L1 + exp(-K) (lp0 - L0) - x j,    K = integral of k,    j = 1/dt * integral of exp(-K(t, t1)) dt.

K is exact: base dt + gain dt (Y1 - Y0) / x. j has no elementary form where k changes. With k written as a series about
the interval's middle it is

    j = j0 + C (-D/2 + D^2/40 - G K/120),    j0 = (1 - exp(-K)) / K,
    C = integral from 0 to 1 of exp(-K r) r (1 - r) dr,
    D = gain dt (Y1 - Y0) (1 - x^2/60 + x^4/2520),    G = gain dt (Y1 - Y0) x,

which leaves less than 2e-7 of error in lp while K |x| <= 0.16 and |x| <= 0.8 (tested against numerical integration).

Longer intervals are halved until that holds. So the result is that of the differential equation, and does not depend on
how a ramp is cut into frames.

Where the light changes slowly against the filter, |x| <= STEADY k at both ends, the lag q = lp - L, which obeys
q' = -k q - x, settles on the series that follows from q = -(x + q') / k put into itself,

    q_s = -x/k (1 + u - v2 + 3 u^2 + v3 - 10 u v2 + 15 u^3),    u = k'/k^2,  v2 = k''/k^3,  v3 = k'''/k^4,

within 1e-7, and what differs from it decays as exp(-K): lp1 = L1 + q_s(1) + exp(-K) (q0 - q_s(0)), however long the
interval is.
"""

import math

from evslip.utils.jit import compiled

MAX_CHANGE, MAX_PRODUCT = 0.8, 0.16
"""Limits of |x| and K |x| for one application of `advance`."""
STEADY = 0.02
"""Limit of |x| / k for the series of the lag."""
BENT = 2.0
"""Limit of |x|^9 / k, about the eighth derivative of the lag, for changes above MAX_CHANGE: `pixel.septic` needs it."""
LEAST_HALVINGS = 3
"""Intervals that are halved less often are computed so, whatever their change."""


@compiled(error_model="numpy", forceinline=True, _nrt=False)
def exponent(log_0: float, log_1: float, current_0: float, current_1: float, base: float, gain: float) -> float:
    """K of an interval; base and gain already multiplied by its length."""
    x = log_1 - log_0
    small = abs(x) < 1e-3
    slope = (current_1 - current_0) / (1.0 if small else x)
    # The logarithmic mean of two nearly equal numbers, without dividing zero by zero.
    middle = 0.5 * (current_0 + current_1) * (1.0 - x * x * (1.0 / 12.0))
    return base + gain * (middle if small else slope)


@compiled(error_model="numpy", forceinline=True, _nrt=False)
def weights(exponent: float) -> tuple[float, float, float]:
    """1 - exp(-K), j0 and C for any K."""
    lost = -math.expm1(-exponent)
    inverse = 1.0 / max(exponent, 1e-12)
    far = (exponent * (2.0 - lost) - 2.0 * lost) * inverse * inverse * inverse
    near = 1 / 6 - exponent * (1 / 12 - exponent * (1 / 40 - exponent * (1 / 180 - exponent * (1 / 1008))))
    return lost, lost * inverse if exponent > 1e-12 else 1.0, far if exponent > 0.03 else near


@compiled(error_model="numpy", forceinline=True, _nrt=False)
def advance(
    log_0: float, log_1: float, current_0: float, current_1: float, filtered: float, gain: float, exponent: float
) -> float:
    """lp at the end of an interval, from the `exponent` K of that interval; gain already multiplied by its length."""
    lost, j0, c = weights(exponent)
    x, rise = log_1 - log_0, gain * (current_1 - current_0)
    x2 = x * x
    spread = rise * (1.0 - x2 * (1 / 60 - x2 / 2520))
    share = j0 + c * (spread * (spread * 0.025 - 0.5) - rise * x * exponent * (1 / 120))
    return log_1 + (1.0 - lost) * (filtered - log_0) - x * share


@compiled(error_model="numpy", _nrt=False)
def halvings(change: float, exponent: float) -> int:
    """Number of times that an interval must be halved until `advance` holds for each part; exponent: K, or more."""
    change = abs(change)
    count = 0
    while count < 16 and (change > MAX_CHANGE or change * exponent > MAX_PRODUCT):
        change *= 0.5
        exponent *= 0.5
        count += 1
    return count


@compiled(error_model="numpy", forceinline=True, _nrt=False)
def steady_lag(change: float, current: float, base: float, gain: float) -> float:
    """q_s at an end of an interval; base and gain already multiplied by its length."""
    rise = gain * current
    inverse = 1.0 / (base + rise)
    x = change * inverse
    u = x * rise * inverse
    v2 = u * x
    return -x * (1.0 + u - v2 + 3.0 * u * u + v2 * x - 10.0 * u * v2 + 15.0 * u * u * u)


@compiled(error_model="numpy", forceinline=True, _nrt=False)
def is_steady(change: float, current_0: float, current_1: float, base: float, gain: float) -> bool:
    """Whether `steady_lag` holds in an interval; base and gain already multiplied by its length."""
    change, least = abs(change), base + gain * min(current_0, current_1)
    cube = change * change * change
    return bool(change <= STEADY * least and (change <= MAX_CHANGE or cube * cube * cube <= BENT * least))


@compiled(error_model="numpy", forceinline=True, _nrt=False)
def advance_steady(change: float, current_0: float, current_1: float, lag: float, base: float, gain: float) -> float:
    """q at the end of an interval in which `is_steady`, from that at its start; base and gain already multiplied by its
    length."""
    kept = math.exp(-exponent(0.0, change, current_0, current_1, base, gain))
    unsettled = lag - steady_lag(change, current_0, base, gain)
    return steady_lag(change, current_1, base, gain) + kept * unsettled


@compiled(error_model="numpy", _nrt=False)
def advance_far(
    log_0: float, log_1: float, current_0: float, current_1: float, filtered: float, base: float, gain: float
) -> float:
    """lp at the end of an interval of any size; base and gain already multiplied by its length."""
    change, steepest = log_1 - log_0, base + gain * max(current_0, current_1)
    times = halvings(change, steepest)
    if times >= LEAST_HALVINGS and is_steady(change, current_0, current_1, base, gain):
        return log_1 + advance_steady(change, current_0, current_1, filtered - log_0, base, gain)
    count = 1 << times
    change /= count
    ratio = math.exp(change) if count > 1 else 1.0
    base, gain = base / count, gain / count
    log, current = log_0, current_0
    for part in range(count):
        last = part == count - 1
        next_log = log_1 if last else log_0 + change * (part + 1)
        next_current = current_1 if last else current * ratio
        k = exponent(log, next_log, current, next_current, base, gain)
        filtered = advance(log, next_log, current, next_current, filtered, gain, k)
        log, current = next_log, next_current
    return filtered
