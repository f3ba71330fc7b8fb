"""Natural logarithm and its inverse in plain arithmetic, which becomes vector code where a library's does not."""

import math

import numpy as np

from evslip.utils.jit import compiled

_LN_2, _LN_2_REST = 6.93147180369123816490e-01, 1.90821492927058770002e-10
_S2, _S4 = 6.666666666666735130e-01, 3.999999999940941908e-01
_S6, _S8 = 2.857142874366239149e-01, 2.222219843214978396e-01
_S10, _S12, _S14 = 1.818357216161805012e-01, 1.531383769920937332e-01, 1.479819860511658591e-01
_ROOT_BITS, _MANTISSA, _SHIFT = np.int64(0x3FE6A09E667F3BCD), np.int64(0x000FFFFFFFFFFFFF), np.int64(52)
"""Bits of sqrt(1/2) and of a mantissa, which lies in [sqrt(1/2), sqrt(2))."""
_LOG2_E, _BIAS, _LARGEST = 1.0 / math.log(2.0), np.int64(1023), 700.0
_E2, _E3, _E4, _E5, _E6, _E7, _E8, _E9, _E10, _E11 = (1.0 / math.factorial(n) for n in range(2, 12))


@compiled(error_model="numpy", forceinline=True)
def ln(value: float) -> float:
    """ln of a normal positive float64, to 0.8 of the last digit: the polynomial of fdlibm's `e_log.c` (Sun, 1993)."""
    bits = np.float64(value).view(np.int64) - _ROOT_BITS
    power = np.float64(bits >> _SHIFT)
    f = np.int64((bits & _MANTISSA) + _ROOT_BITS).view(np.float64) - 1.0
    s = f / (2.0 + f)
    z = s * s
    w = z * z
    rest = w * (_S4 + w * (_S8 + w * _S12)) + z * (_S2 + w * (_S6 + w * (_S10 + w * _S14)))
    half = 0.5 * f * f
    return power * _LN_2 - ((half - (s * (half + rest) + power * _LN_2_REST)) - f)


@compiled(error_model="numpy", forceinline=True)
def exp(value: float) -> float:
    """e to the power of a number, to 1e-14 of it; beyond 700 as at 700."""
    value = min(max(value, -_LARGEST), _LARGEST)
    power = np.floor(value * _LOG2_E + 0.5)
    r = (value - power * _LN_2) - power * _LN_2_REST
    high = _E6 + r * (_E7 + r * (_E8 + r * (_E9 + r * (_E10 + r * _E11))))
    mantissa = 1.0 + r * (1.0 + r * (_E2 + r * (_E3 + r * (_E4 + r * (_E5 + r * high)))))
    return mantissa * np.int64((np.int64(power) + _BIAS) << _SHIFT).view(np.float64)


@compiled(error_model="numpy")
def logarithms(values: np.ndarray) -> np.ndarray:
    """ln as the pixels compute it: numpy's may differ in the last bit."""
    out = np.empty_like(values)
    for i in range(len(values)):
        out[i] = ln(values[i])
    return out
