"""Slots of the scratch memory: where in it each value of the pixels at hand is, SLOT floats apart."""

SLOT = 64
"""Length of a slot; the most pixels that a pass handles."""
(
    RAY_X, RAY_Y,  # ray through the pixel: (RAY_X, RAY_Y, -1) in camera axes
    U, V, W,  # receiver point, in the frame of its pass
    MAJOR_U, MAJOR_V, MINOR_U, MINOR_V,  # footprint of the pixel: both sides of a parallelogram
    TEXELS, HELD,  # variance in squares of the finest texels: what is wanted, what the levels have
    LEVEL, CELL, COLUMNS, ROWS,  # the texture's level, its first cell and its size
    LIT, GLOSS, SEEN,  # lamp's diffuse and specular part; share of the lamp seen
    TEX, WHERE, FRAC_X, FRAC_Y, FADED,  # texture value; cell, place in it, weight of a probe
    GROUND,  # share of the pixel below the horizon
    RESULT,
    NORMAL_X, NORMAL_Y, NORMAL_Z,  # where they differ from pixel to pixel
    LAMP_X, LAMP_Y, LAMP_Z, HIDDEN,  # receiver point in the lamp's frame; what an outline hides
    ROOM,  # share of the pixel that the point stands for, over which shadows are blurred
    PER_DEPTH, BLUR, STRETCH,  # 1 / way to the lamp; a pixel's blur across and how much longer shadows' blur is along
    PART, OPEN,  # number of the body that the point belongs to; share of the light from all around that reaches it
    MORE,  # the first of many that `occlusion` takes
) = (slot * SLOT for slot in range(39))  # fmt: skip
SCRATCH = 72 * SLOT
