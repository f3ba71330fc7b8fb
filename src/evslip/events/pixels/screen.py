"""Screening of many pixels at once: how far their low-pass moves, and which of them might fire.

Nearly all never need more than this. Everything here is single precision and written as short loops over a tile of
pixels, which become vector code. Its results are either certain to err on the safe side (`marked`) or exact enough to
be the pixel's state: the low-pass is kept as its lag, lp - L, which is small, and as the sum of two numbers, so that
steps far smaller than the lag are not rounded away (Kahan 1965). The lag's own step is that of `lowpass` in terms of

    r = (Y1 - Y0) / (Y1 + Y0) = tanh(x / 2),    x = L1 - L0,

which single precision holds to full relative accuracy however small the change, and in which both x and the mean
current are short series. They are short because changes are small: a pixel with |x| > MAX_CHANGE is computed by
`lowpass`.
"""

import math

import numpy as np

from evslip.utils.jit import compiled, fused

F = np.float32

TILE = 2048
"""Pixels a tile. Of most tiles few pixels have anything to do, and their numbers fit into the nearest cache."""
_STRIDE = TILE + 16
"""Not a power of two, or all rows would fall into the same lines of the cache."""
CURRENT_0, CURRENT_1, LAG_0, LAG, RESIDUE, OFFSET, HALF, MIDDLE, HIGH, LOW, SLOPE, DUE = range(0, 12 * _STRIDE, _STRIDE)
VALUES = 12 * _STRIDE
"""Places of a tile's numbers in `Scratch.values`. In one array at fixed distances, so that the compiler knows that what
a loop writes is not what it reads. Frame by frame only the first seven are used: photocurrents and lags at both ends of
an interval; what the lag was rounded by; middle of the bounds less L, and half their distance, see `centre`."""
MAX_CHANGE, MAX_PRODUCT = F(0.25), F(0.16)
"""Largest |x| for single precision, and largest K |x| unless `lowpass.steady_lag` holds."""
STEADY = F(0.02)
"""Largest |x| / k for that; K is then at least ..."""
STEADY_LIMIT = F(2.8)
"""... this where it is needed."""
SERIES_LIMIT = F(0.5)
"""Largest K for which the weights are taken from their series."""
MARGIN = 1.5e-5
"""More than the logarithms of a screening may be wrong by after a chunk of frames, in ln units."""
LEAST_LAG = F(1e-12)
"""Smaller lags are none: numbers that decay for ever become slow ones."""

_CURRENT_1 = np.uint64(CURRENT_1)
_ONE, _TWO, _HALF = F(1), F(2), F(0.5)
_A3, _A5, _A7 = F(1 / 3), F(1 / 5), F(1 / 7)
_M2, _M4, _M6 = F(1 / 3), F(4 / 45), F(44 / 945)
_J1, _J2, _J3, _J4, _J5, _J6 = (F(1 / math.factorial(n)) for n in range(2, 8))
_C0, _C1, _C2, _C3, _C4, _C5 = (F(1 / n) for n in (6, 12, 40, 180, 1008, 6720))
_S2, _D2, _G = F(1 / 60), F(1 / 40), F(1 / 120)
_THREE, _TEN, _FIFTEEN = F(3), F(10), F(15)
_SHRINK, _MOST = F(1 / 64), F(40)
_LN_2 = F(math.log(2))
_ONE_BITS, _ROOT_BITS = np.int32(0x3F800000), np.int32(0x3F3504F3)
_INFINITE = F(np.inf)
_MANTISSA, _SHIFT = np.int32(0x007FFFFF), np.int32(23)


@compiled(error_model="numpy", inline="always", _nrt=False)
def change_and_exponent(current_0: F, current_1: F, base: F, gain: F) -> tuple[F, F]:
    """x and K of an interval; base and gain already multiplied by its length. All float32."""
    both = current_0 + current_1
    ratio = (current_1 - current_0) / both
    square = ratio * ratio
    change = (ratio + ratio) * fused(square, fused(square, fused(square, _A7, _A5), _A3), _ONE)
    mean = _HALF * both * fused(-square, fused(square, fused(square, _M6, _M4), _M2), _ONE)
    return change, fused(gain, mean, base)


@compiled(error_model="numpy", inline="always", _nrt=False)
def _weights_brief(exponent: F) -> tuple[F, F, F]:
    """1 - exp(-K), j0 and C of `lowpass`, for K up to SERIES_LIMIT."""
    k = exponent
    j0 = fused(-k, fused(-k, fused(-k, fused(-k, fused(-k, fused(-k, _J6, _J5), _J4), _J3), _J2), _J1), _ONE)
    c = fused(-k, fused(-k, fused(-k, fused(-k, fused(-k, _C5, _C4), _C3), _C2), _C1), _C0)
    return k * j0, j0, c


@compiled(error_model="numpy", inline="always", _nrt=False)
def _weights_long(exponent: F) -> tuple[F, F, F]:
    """1 - exp(-K), j0 and C of `lowpass`, for K from SERIES_LIMIT."""
    k = max(exponent, SERIES_LIMIT)
    r = min(k, _MOST) * _SHRINK
    lost = r * fused(-r, fused(-r, fused(-r, fused(-r, fused(-r, _J5, _J4), _J3), _J2), _J1), _ONE)
    for _ in range(6):
        # 1 - exp(-2 r) = e (2 - e), six times: 2^6 = 64.
        lost = lost * (_TWO - lost)
    inverse = _ONE / k
    return lost, lost * inverse, (k * (_TWO - lost) - _TWO * lost) * inverse * inverse * inverse


@compiled(error_model="numpy", inline="always", _nrt=False)
def lag_step(change: F, rise: F, exponent: F, lag: F, lost: F, j0: F, c: F) -> F:
    """Addition of an interval to the lag; rise = gain dt (Y1 - Y0)."""
    spread = rise * fused(-change * change, _S2, _ONE)
    bend = fused(-rise * change, exponent * _G, spread * fused(spread, _D2, -_HALF))
    return -fused(lost, lag, change * fused(c, bend, j0))


@compiled(error_model="numpy", inline="always", _nrt=False)
def steady_lag(change: F, current: F, base: F, gain: F) -> F:
    """`lowpass.steady_lag` in single precision."""
    rise = gain * current
    inverse = _ONE / (base + rise)
    x = change * inverse
    u = x * rise * inverse
    v2 = u * x
    return -x * fused(u, fused(u, fused(u, _FIFTEEN, _THREE), fused(-v2, _TEN, _ONE)), fused(v2, x, _ONE - v2))


@compiled(error_model="numpy", inline="always", _nrt=False)
def steady_step(current_0: F, current_1: F, change: F, base: F, gain: F, lag: F, lost: F) -> F:
    """Addition of an interval to the lag where `steady_lag` holds."""
    settled = steady_lag(change, current_0, base, gain)
    return fused(_ONE - lost, lag - settled, steady_lag(change, current_1, base, gain)) - lag


@compiled(error_model="numpy", inline="always", _nrt=False)
def is_bent(change: F, exponent: F) -> bool:
    """Whether an interval is too much for `lag_step`."""
    return bool(abs(change) * exponent > MAX_PRODUCT)


@compiled(error_model="numpy", inline="always", _nrt=False)
def is_wide(change: F, exponent: F, least: F) -> bool:
    """Whether an interval is too much for single precision; least: smallest k in it."""
    return bool((abs(change) > MAX_CHANGE) | (is_bent(change, exponent) & (abs(change) > STEADY * least)))


@compiled(error_model="numpy", inline="always", _nrt=False)
def whole_step(current_0: F, current_1: F, base: F, gain: F, lag: F) -> tuple[F, F, F, bool]:
    """x, K and step of the lag for an interval of one pixel, and whether that is too much for single precision; base
    and gain already multiplied by its length."""
    change, exponent = change_and_exponent(current_0, current_1, base, gain)
    lost, j0, c = _weights_long(exponent) if exponent > SERIES_LIMIT else _weights_brief(exponent)
    wide = is_wide(change, exponent, fused(gain, min(current_0, current_1), base))
    if is_bent(change, exponent):
        return change, exponent, steady_step(current_0, current_1, change, base, gain, lag, lost), wide
    return change, exponent, lag_step(change, gain * (current_1 - current_0), exponent, lag, lost, j0, c), wide


@compiled(error_model="numpy", _nrt=False)
def photocurrents(
    image: np.ndarray, runs: np.ndarray, found: int, table: np.ndarray, factor: F, offset: F, values: np.ndarray
) -> None:
    """Photocurrents of all active pixels, see `Response`; runs: see `Scratch`."""
    for run in range(found):
        pixel, at, length = runs[run, 0], _CURRENT_1 + runs[run, 1], runs[run + 1, 1] - runs[run, 1]
        if factor == 0.0:
            for i in range(length):
                values[at + i] = table[np.uint8(image[pixel + i])]
        else:
            for i in range(length):
                values[at + i] = image[pixel + i] * factor + offset


@compiled(error_model="numpy", _nrt=False)
def greatest(values: np.ndarray) -> F:
    """Greatest of some numbers, none of which is negative: then their bits are in the same order."""
    bits = values.view(np.int32)
    most = np.int32(0)
    for i in range(len(bits)):
        most = bits[i] if bits[i] > most else most
    return np.int32(most).view(np.float32)


@compiled(error_model="numpy", inline="always", _nrt=False)
def single_ln(current: F) -> F:
    """ln in single precision, with an error below 1e-6 for photocurrents of 1e-6 to 1e6."""
    bits = np.float32(current).view(np.int32) + np.int32(_ONE_BITS - _ROOT_BITS)
    # The mantissa lies in [sqrt(1/2), sqrt(2)).
    mantissa = np.int32((bits & _MANTISSA) + _ROOT_BITS).view(np.float32)
    s = (mantissa - _ONE) / (mantissa + _ONE)
    q = s * s
    power = F(np.int32(bits >> _SHIFT) - np.int32(127))
    return power * _LN_2 + (s + s) * (_ONE + q * (_A3 + q * (_A5 + q * (_A7 + q * F(1 / 9)))))


@compiled(error_model="numpy", inline="always", _nrt=False)
def middle_and_half(high: F, low: F, slope: F, last_us: F) -> tuple[F, F]:
    """Middle of a pixel's bounds and half their distance, where they are closest: at the end of the frames."""
    high -= slope * last_us
    half = _HALF * (high - low)
    return F(0) if half == _INFINITE else _HALF * (high + low), half


@compiled(error_model="numpy", _nrt=False)
def centre(values: np.ndarray, count: int, last_us: F) -> None:
    """Set MIDDLE, HALF and OFFSET from the bounds and CURRENT_0; last_us: end of the frames, counted from the
    epoch's start."""
    for i in range(count):
        middle, half = middle_and_half(values[HIGH + i], values[LOW + i], values[SLOPE + i], last_us)
        values[MIDDLE + i], values[HALF + i] = middle, half
        values[OFFSET + i] = middle - single_ln(values[CURRENT_0 + i])


@compiled(error_model="numpy", inline="always", _nrt=False)
def added(lag: F, residue: F, step: F) -> tuple[F, F]:
    """Lag and residue, whose sum is the exact lag, after a step."""
    step = step + residue
    total = lag + step
    total = total if abs(total) > LEAST_LAG else F(0)
    return total, step - (total - lag)


@compiled(error_model="numpy", inline="always", _nrt=False)
def marked(change: F, exponent: F, lag_0: F, lag_1: F, offset: F, half: F, wide: bool) -> int:
    """1 for a pixel that may leave its bounds on the way; 2 for one that needs double precision, if `wide`; 3 for both.

    offset: at the start. lp turns only where it meets L, so before that it moves by less than K times its lag, and no
    farther than L does.
    """
    reach = min(exponent * abs(lag_0), abs(lag_0) + abs(change)) if lag_0 * lag_1 < F(0) else F(0)
    stays = (abs(lag_0 - offset) + reach < half) & (abs(lag_1 - (offset - change)) < half)
    return (0 if stays else 1) + (2 if wide else 0)


@compiled(error_model="numpy", inline="always", _nrt=False)
def _advance(values: np.ndarray, i: int, change: F, exponent: F, step: F, wide: bool) -> int:
    """Move current, offset and lag of a pixel. Returns its mark."""
    lag, offset = values[LAG + i], values[OFFSET + i]
    lag_1, residue = added(lag, values[RESIDUE + i], step)
    values[LAG_0 + i], values[LAG + i], values[RESIDUE + i] = lag, lag_1, residue
    values[OFFSET + i], values[CURRENT_0 + i] = offset - change, values[CURRENT_1 + i]
    return marked(change, exponent, lag, lag_1, offset, values[HALF + i], wide)


@compiled(error_model="numpy", inline="always", _nrt=False)
def _any_weights(exponent: F) -> tuple[F, F, F]:
    """1 - exp(-K), j0 and C for any K: both kinds are computed, which is vector code, and one of them is taken."""
    brief, long = _weights_brief(exponent), _weights_long(exponent)
    is_long = exponent > SERIES_LIMIT
    return (
        long[0] if is_long else brief[0],
        long[1] if is_long else brief[1],
        long[2] if is_long else brief[2],
    )


@compiled(error_model="numpy", _nrt=False)
def advance_lowpass(values: np.ndarray, count: int, base: F, gain: F, marks: np.ndarray) -> None:
    """Screening of an interval where no K is more than SERIES_LIMIT: moves current, offset and lag, and marks.

    base and gain: already multiplied by its length.
    """
    for i in range(count):
        current_0, current_1, lag = values[CURRENT_0 + i], values[CURRENT_1 + i], values[LAG + i]
        change, k = change_and_exponent(current_0, current_1, base, gain)
        lost, j0, c = _weights_brief(k)
        step = lag_step(change, gain * (current_1 - current_0), k, lag, lost, j0, c)
        marks[i] = _advance(values, i, change, k, step, (abs(change) > MAX_CHANGE) | is_bent(change, k))


@compiled(error_model="numpy", _nrt=False)
def advance_lowpass_long(values: np.ndarray, count: int, base: F, gain: F, marks: np.ndarray) -> None:
    """`advance_lowpass` where no K is more than STEADY_LIMIT."""
    for i in range(count):
        current_0, current_1, lag = values[CURRENT_0 + i], values[CURRENT_1 + i], values[LAG + i]
        change, k = change_and_exponent(current_0, current_1, base, gain)
        lost, j0, c = _any_weights(k)
        step = lag_step(change, gain * (current_1 - current_0), k, lag, lost, j0, c)
        marks[i] = _advance(values, i, change, k, step, (abs(change) > MAX_CHANGE) | is_bent(change, k))


@compiled(error_model="numpy", _nrt=False)
def advance_lowpass_steady(values: np.ndarray, count: int, base: F, gain: F, marks: np.ndarray) -> None:
    """`advance_lowpass` for any K."""
    for i in range(count):
        current_0, current_1, lag = values[CURRENT_0 + i], values[CURRENT_1 + i], values[LAG + i]
        change, k = change_and_exponent(current_0, current_1, base, gain)
        lost, j0, c = _any_weights(k)
        bent = lag_step(change, gain * (current_1 - current_0), k, lag, lost, j0, c)
        steady = steady_step(current_0, current_1, change, base, gain, lag, lost)
        wide = is_wide(change, k, fused(gain, min(current_0, current_1), base))
        marks[i] = _advance(values, i, change, k, steady if is_bent(change, k) else bent, wide)


@compiled(error_model="numpy", _nrt=False)
def mark_leaving(values: np.ndarray, count: int, marks: np.ndarray) -> None:
    """Screening without low-pass, where lp is L, known to lie within the bounds at the start."""
    for i in range(count):
        offset = values[MIDDLE + i] - single_ln(values[CURRENT_1 + i])
        marks[i] = 0 if abs(offset) < values[HALF + i] else 1
        values[OFFSET + i], values[CURRENT_0 + i] = offset, values[CURRENT_1 + i]


@compiled(error_model="numpy", _nrt=False)
def any_due(values: np.ndarray, count: int, end_us: F) -> bool:
    """Whether any pixel has something to do by end_us, in microseconds after the epoch's start."""
    due = False
    for i in range(count):
        due |= values[DUE + i] <= end_us
    return due


@compiled(error_model="numpy", _nrt=False)
def mark_due(values: np.ndarray, count: int, end_us: F, marks: np.ndarray) -> None:
    """Add 1 to the mark of each pixel that has something to do by end_us anyway."""
    for i in range(count):
        marks[i] |= np.uint8(1) if values[DUE + i] <= end_us else np.uint8(0)
