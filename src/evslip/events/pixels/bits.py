"""The place of a bit, by the machine's own instruction."""

from typing import Any

from numba.cpython.unsafe.numbers import trailing_zeros

lowest_bit: Any = trailing_zeros
"""Number of the lowest bit that is set, of an unsigned integer that is not 0."""
