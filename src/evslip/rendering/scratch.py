"""The scratch memory of the shading passes, and how they are compiled.

Every pass is a short loop over at most SLOT pixels that LLVM turns into vector instructions. All of them work in one
flat float32 array: slots at constant distances need no check for overlap, which separate arrays would. A loop that
also fetched texels would not vectorise, so fetching is a loop of its own.
"""

from typing import NamedTuple

import numpy as np

from evslip.utils.jit import compiled

SLOT = 64
"""Length of a slot; the most pixels that a pass handles."""
BLOCK = 16
"""Pixels that one vector instruction handles. Passes are given whole blocks: the rest of a loop runs one by one."""
TILE_W, TILE_H = 64, 4
"""Tiles of the image for which shadow casters are culled; a tile's row is one chunk of the backdrop."""

(
    RAY_X, RAY_Y,  # ray through the pixel: (RAY_X, RAY_Y, -1) in camera axes
    U, V, W,  # receiver point, in the frame of its pass
    MAJOR_U, MAJOR_V, MINOR_U, MINOR_V,  # footprint of the pixel: both sides of a parallelogram
    TEXELS, HELD,  # variance in squares of the finest texels: what is wanted, what the levels have
    LIT, GLOSS, SEEN, SEEN_NOW,  # lamp's diffuse and specular part; share of the lamp seen, so far and past one group
    TEX, WHERE, FRAC_X, FRAC_Y, WEIGHT, FADED,  # texture value; cell, place in it, weights of one level and one probe
    GROUND,  # share of the pixel below the horizon
    RESULT,
    NORMAL_X, NORMAL_Y, NORMAL_Z, AMBIENT,  # where they differ from pixel to pixel
    LAMP_X, LAMP_Y, LAMP_Z, HIDDEN,  # receiver point in the lamp's frame; what an outline hides
    ROOM,  # share of the pixel that the point stands for, over which shadows are blurred
    PER_DEPTH, BLUR, STRETCH,  # 1 / way to the lamp; a pixel's blur across and how much longer shadows' blur is along
    SUM_HIDDEN, SUM_OUTLINED,  # what all casters of a group hide, each alone, and of it what outlines do
    PART, OPEN,  # number of the body that the point belongs to; share of the light from all around that reaches it
    MORE,  # the first of many that `union` and `occlusion` share
) = (slot * SLOT for slot in range(40))  # fmt: skip
SCRATCH = 142 * SLOT


class Scratch(NamedTuple):
    """Memory of one renderer's passes."""

    slots: np.ndarray
    """All slots, float32 of shape (142 SLOT,); `S` in the passes."""
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
"""Of ROOM, so that nothing is divided by zero."""


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
