"""Order of a grid's combinations: each once, and any few in a row a mixture of all values."""

import math
from collections.abc import Sequence
from functools import lru_cache

GOLDEN = (math.sqrt(5) - 1) / 2
"""Steps of this share of a circle spread evenly over it, however many are made."""


def places(index: int, sizes: Sequence[int]) -> list[int]:
    """Place in each list, of the given lengths that combination `index` has. All combinations come once before the
    first comes again; index 0 has every list's first entry."""
    remaining = index * _stride(tuple(sizes))
    found = []
    for size in reversed(sizes):
        remaining, place = divmod(remaining, size)
        found.append(place)
    return found[::-1]


@lru_cache(maxsize=64)
def _stride(sizes: tuple[int, ...]) -> int:
    """From one combination to the next, counted with the last list fastest.

    It has no divisor in common with their number, so it meets every one. The place in list k follows from the count
    modulo the combinations of list k and those behind it, so for every k a step is about the golden share of these.
    """
    stride, combinations = 1, 1
    for size in reversed(sizes):
        wider = combinations * size
        choices = [s for s in range(stride, wider + 1, combinations) if math.gcd(s, wider) == 1]
        stride = min(choices, key=lambda s: abs(s / wider - GOLDEN))
        combinations = wider
    return stride
