"""The scratch memory of the shading passes, and how they are compiled.

Every pass is a short loop over at most LANES pixels that LLVM turns into vector instructions. All of them work in one
flat float32 array: slots at constant distances need no check for overlap, which separate arrays would. A loop that
also fetched texels would not vectorise, so fetching is a loop of its own.
"""

import numpy as np
from numba import njit

LANES = 64
"""Length of a slot; the most pixels that a pass handles."""
TILE_W, TILE_H = 32, 8
"""Tiles of the image for which shadow casters are culled; a tile's row is one chunk of the backdrop."""

(
    RAY_X, RAY_Y,  # ray through the pixel: (RAY_X, RAY_Y, -1) in camera axes
    U, V, W,  # receiver point, in the frame of its pass
    MAJOR_U, MAJOR_V, MINOR,  # footprint of one probe: its long axis, and the ratio short : long
    TEXELS,  # width of a probe in texels of the finest level
    LIT, GLOSS, SEEN, SEEN_NOW,  # lamp's diffuse and specular part; share of the lamp not hidden, so far and by one group
    TEX, WHERE, FRAC_X, FRAC_Y, WEIGHT,  # texture value; cell, place in it and weight of one probe
    GROUND,  # share of the pixel below the horizon
    RESULT,
) = (slot * LANES for slot in range(20))  # fmt: skip
SCRATCH = 20 * LANES

FAST = {"nnan", "ninf", "nsz", "arcp", "contract", "afn", "reassoc"}
kernel = njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
"""Compile on first call, keep the machine code on disk, run without the interpreter's lock."""

f32 = np.float32
ZERO, HALF, ONE, TWO = f32(0), f32(0.5), f32(1), f32(2)
