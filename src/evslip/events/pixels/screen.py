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

from evslip.utils.jit import compiled

F = np.float32

TILE = 2048
"""Pixels a tile. Of most tiles few pixels have anything to do, and their numbers fit into the nearest cache."""
CURRENT_0, CURRENT_1, CHANGE, EXPONENT, LOG, LAG_0, LAG, RESIDUE, HIGH, LOW, SLOPE, DUE = range(0, 12 * TILE, TILE)
VALUES = 12 * TILE
"""Places of a tile's numbers in `Scratch.values`. In one array at fixed distances, so that the compiler knows that what
a loop writes is not what it reads."""
MAX_CHANGE, MAX_PRODUCT = F(0.25), F(0.16)
"""Largest |x| and K |x| for single precision."""
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
_SHRINK, _MOST = F(1 / 64), F(40)
_LN_2 = F(math.log(2))
_ONE_BITS, _ROOT_BITS = np.int32(0x3F800000), np.int32(0x3F3504F3)
_MANTISSA, _SHIFT = np.int32(0x007FFFFF), np.int32(23)


@compiled(error_model="numpy", inline="always")
def change_and_exponent(current_0: F, current_1: F, base: F, gain: F) -> tuple[F, F]:
    """x and K of an interval; base and gain already multiplied by its length. All float32."""
    both = current_0 + current_1
    ratio = (current_1 - current_0) / both
    square = ratio * ratio
    change = (ratio + ratio) * (_ONE + square * (_A3 + square * (_A5 + square * _A7)))
    mean = _HALF * both * (_ONE - square * (_M2 + square * (_M4 + square * _M6)))
    return change, base + gain * mean


@compiled(error_model="numpy", inline="always")
def _weights_brief(exponent: F) -> tuple[F, F, F]:
    """1 - exp(-K), j0 and C of `lowpass`, for K up to SERIES_LIMIT."""
    k = exponent
    j0 = _ONE - k * (_J1 - k * (_J2 - k * (_J3 - k * (_J4 - k * (_J5 - k * _J6)))))
    c = _C0 - k * (_C1 - k * (_C2 - k * (_C3 - k * (_C4 - k * _C5))))
    return k * j0, j0, c


@compiled(error_model="numpy", inline="always")
def _weights_long(exponent: F) -> tuple[F, F, F]:
    """1 - exp(-K), j0 and C of `lowpass`, for K from SERIES_LIMIT."""
    k = max(exponent, SERIES_LIMIT)
    r = min(k, _MOST) * _SHRINK
    lost = r * (_ONE - r * (_J1 - r * (_J2 - r * (_J3 - r * (_J4 - r * _J5)))))
    for _ in range(6):
        # 1 - exp(-2 r) = e (2 - e), six times: 2^6 = 64.
        lost = lost * (_TWO - lost)
    inverse = _ONE / k
    return lost, lost * inverse, (k * (_TWO - lost) - _TWO * lost) * inverse * inverse * inverse


@compiled(error_model="numpy", inline="always")
def lag_step(change: F, rise: F, exponent: F, lag: F, lost: F, j0: F, c: F) -> F:
    """Addition of an interval to the lag; rise = gain dt (Y1 - Y0)."""
    spread = rise * (_ONE - change * change * _S2)
    share = j0 + c * (spread * (spread * _D2 - _HALF) - rise * change * exponent * _G)
    return -(lost * lag + change * share)


@compiled(error_model="numpy", inline="always")
def is_wide(change: F, exponent: F) -> bool:
    """Whether an interval is too much for single precision."""
    return bool((abs(change) > MAX_CHANGE) | (abs(change) * exponent > MAX_PRODUCT))


@compiled(error_model="numpy", inline="always")
def whole_step(current_0: F, current_1: F, base: F, gain: F, lag: F) -> tuple[F, F, F]:
    """x, K and step of the lag for an interval of one pixel; base and gain already multiplied by its length."""
    change, exponent = change_and_exponent(current_0, current_1, base, gain)
    lost, j0, c = _weights_long(exponent) if exponent > SERIES_LIMIT else _weights_brief(exponent)
    return change, exponent, lag_step(change, gain * (current_1 - current_0), exponent, lag, lost, j0, c)


@compiled(error_model="numpy")
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


@compiled(error_model="numpy")
def logarithms(currents: np.ndarray, out: np.ndarray) -> None:
    """ln of float32 numbers, with an error below 1e-6 for photocurrents of 1e-6 to 1e6."""
    bits, out_bits = currents.view(np.int32), out.view(np.int32)
    for i in range(len(bits)):
        out_bits[i] = ((bits[i] + (_ONE_BITS - _ROOT_BITS)) & _MANTISSA) + _ROOT_BITS
    for i in range(len(bits)):
        # The mantissa lies in [sqrt(1/2), sqrt(2)).
        power = F(((bits[i] + (_ONE_BITS - _ROOT_BITS)) >> _SHIFT) - np.int32(127))
        s = (out[i] - _ONE) / (out[i] + _ONE)
        q = s * s
        out[i] = power * _LN_2 + (s + s) * (_ONE + q * (_A3 + q * (_A5 + q * (_A7 + q * F(1 / 9)))))


@compiled(error_model="numpy", inline="always")
def added(lag: F, residue: F, step: F) -> tuple[F, F]:
    """Lag and residue, whose sum is the exact lag, after a step."""
    step = step + residue
    total = lag + step
    total = total if abs(total) > LEAST_LAG else F(0)
    return total, step - (total - lag)


@compiled(error_model="numpy", inline="always")
def marked(log_0: F, change: F, exponent: F, lag_0: F, lag_1: F, high: F, low: F) -> int:
    """1 for a pixel that may leave (low, high) on the way; 2 for one that needs double precision; 3 for both.

    lp turns only where it meets L, so before that it moves by less than K times its lag.
    """
    lp_0, lp_1 = log_0 + lag_0, log_0 + change + lag_1
    reach = exponent * abs(lag_0) if lag_0 * lag_1 < F(0) else F(0)
    stays = (max(lp_0 + reach, lp_1) < high) & (min(lp_0 - reach, lp_1) > low)
    return (0 if stays else 1) + (2 if is_wide(change, exponent) else 0)


@compiled(error_model="numpy")
def find_changes(values: np.ndarray, count: int, base: F, gain: F) -> bool:
    """First half of a screening: x and K of the first pixels. Returns whether any K is more than SERIES_LIMIT."""
    long = False
    for i in range(count):
        change, exponent = change_and_exponent(values[CURRENT_0 + i], values[CURRENT_1 + i], base, gain)
        values[CHANGE + i], values[EXPONENT + i] = change, exponent
        long |= exponent > SERIES_LIMIT
    return long


@compiled(error_model="numpy", inline="always")
def _advance(values: np.ndarray, i: int, gain: F, end_us: F, lost: F, j0: F, c: F) -> int:
    """Move current, log and lag of a pixel. Returns its mark."""
    current_0, current_1, change, k = (
        values[CURRENT_0 + i],
        values[CURRENT_1 + i],
        values[CHANGE + i],
        values[EXPONENT + i],
    )
    log, lag, high, low = (
        values[LOG + i],
        values[LAG + i],
        values[HIGH + i] - values[SLOPE + i] * end_us,
        values[LOW + i],
    )
    step = lag_step(change, gain * (current_1 - current_0), k, lag, lost, j0, c)
    lag_1, residue = added(lag, values[RESIDUE + i], step)
    values[LAG_0 + i], values[LAG + i], values[RESIDUE + i] = lag, lag_1, residue
    values[LOG + i], values[CURRENT_0 + i] = log + change, current_1
    return marked(log, change, k, lag, lag_1, high, low)


@compiled(error_model="numpy")
def advance_lowpass(values: np.ndarray, count: int, gain: F, end_us: F, marks: np.ndarray) -> None:
    """Second half of a screening, where no K is more than SERIES_LIMIT: moves current, log and lag, and marks.

    end_us: microseconds after the beginning of the epoch.
    """
    for i in range(count):
        lost, j0, c = _weights_brief(values[EXPONENT + i])
        marks[i] = _advance(values, i, gain, end_us, lost, j0, c)


@compiled(error_model="numpy")
def advance_lowpass_long(values: np.ndarray, count: int, gain: F, end_us: F, marks: np.ndarray) -> None:
    """`advance_lowpass` for any K: both weights are computed, which is vector code, and one of them is taken."""
    for i in range(count):
        k = values[EXPONENT + i]
        brief, long = _weights_brief(k), _weights_long(k)
        is_long = k > SERIES_LIMIT
        lost, j0, c = (
            long[0] if is_long else brief[0],
            long[1] if is_long else brief[1],
            long[2] if is_long else brief[2],
        )
        marks[i] = _advance(values, i, gain, end_us, lost, j0, c)


@compiled(error_model="numpy")
def mark_leaving(values: np.ndarray, count: int, end_us: F, marks: np.ndarray) -> None:
    """Screening without low-pass, where lp is L, known to lie within (low, high) at the start."""
    for i in range(count):
        log, high = values[LOG + i], values[HIGH + i] - values[SLOPE + i] * end_us
        marks[i] = 0 if (log < high) & (log > values[LOW + i]) else 1
        values[CURRENT_0 + i] = values[CURRENT_1 + i]


@compiled(error_model="numpy")
def mark_due(values: np.ndarray, count: int, end_us: F, marks: np.ndarray) -> None:
    """Add 1 to the mark of each pixel that has something to do by end_us anyway."""
    for i in range(count):
        marks[i] |= np.uint8(1) if values[DUE + i] <= end_us else np.uint8(0)
