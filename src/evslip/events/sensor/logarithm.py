"""Natural logarithm in plain arithmetic, which becomes vector code where a library's function does not."""

import numpy as np

from evslip.utils.jit import compiled

_LN_2, _LN_2_REST = 6.93147180369123816490e-01, 1.90821492927058770002e-10
_S2, _S4, _S6, _S8 = (
    6.666666666666735130e-01,
    3.999999999940941908e-01,
    2.857142874366239149e-01,
    2.222219843214978396e-01,
)
_S10, _S12, _S14 = 1.818357216161805012e-01, 1.531383769920937332e-01, 1.479819860511658591e-01
_ROOT_BITS, _MANTISSA, _SHIFT = np.int64(0x3FE6A09E667F3BCD), np.int64(0x000FFFFFFFFFFFFF), np.int64(52)
"""Bits of sqrt(1/2) and of a mantissa, which lies in [sqrt(1/2), sqrt(2))."""


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


@compiled(error_model="numpy")
def logarithms(values: np.ndarray) -> np.ndarray:
    """ln as the pixels compute it: numpy's may differ in the last bit."""
    out = np.empty_like(values)
    for i in range(len(values)):
        out[i] = ln(values[i])
    return out
