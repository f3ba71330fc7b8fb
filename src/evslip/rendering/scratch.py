"""The scratch memory of the shading passes, and how they are compiled.

Every pass is a short loop over at most SLOT pixels that LLVM turns into vector instructions. All of them work in one
flat float32 array: slots at constant distances need no check for overlap, which separate arrays would. A loop that
also fetched texels would not vectorise, so fetching is a loop of its own.
"""

from typing import NamedTuple

import numpy as np

from evslip.rendering.slots import SCRATCH, SLOT
from evslip.utils.jit import compiled

BLOCK = 16
"""Pixels that one vector instruction handles. Passes are given whole blocks: the rest of a loop runs one by one."""
TILE_W, TILE_H = 64, 4
"""Tiles of the image for which shadow casters are culled; a tile's row is one chunk of the backdrop."""


class Scratch(NamedTuple):
    """Memory of one renderer's passes."""

    slots: np.ndarray
    """All slots, float32 of shape (72 SLOT,); `S` in the passes."""
    loaded: np.ndarray
    """Texture cells that were loaded for a slot of pixels, uint64 of shape (SLOT,)."""


def make_scratch() -> Scratch:
    """Scratch memory, all zeros."""
    return Scratch(np.zeros(SCRATCH, np.float32), np.zeros(SLOT, np.uint64))


_OPTIONS = {"fastmath": {"nnan", "ninf", "nsz"}, "error_model": "numpy"}
kernel = compiled(**_OPTIONS)
"""The compiler may assume ordinary numbers, which lets minima become vector instructions. It may not reorder or fuse
operations: how it would do so depends on where a function is inlined, and frames would differ in their last bits
between a process that compiles and one that loads the code from disk."""
formula = compiled(**_OPTIONS, forceinline=True)
"""A kernel that is always copied into its caller: what stands inside a loop that is to become vector instructions."""

f32 = np.float32
ZERO, HALF, ONE, TWO = f32(0), f32(0.5), f32(1), f32(2)
LEAST_ROOM = f32(1e-3)
"""Least value of ROOM, so that nothing is divided by zero."""


@formula
def clamped(n):
    """n, which is at most SLOT, but the compiler cannot know: where an index might overflow, a loop stays scalar."""
    return min(n, SLOT)


@formula
def slot(at):
    """A slot that is an argument, for the same reason."""
    return np.uint32(at)


@formula
def blocks(n):
    """n, or the next larger multiple of BLOCK."""
    return (n + BLOCK - 1) // BLOCK * BLOCK


@formula
def repeat_last(S, slot, n):
    """Fill up the last block of a slot of n pixels."""
    for i in range(n, blocks(n)):
        S[slot + i] = S[slot + n - 1]
