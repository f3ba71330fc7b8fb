"""The last step of a frame: the lens's slight blur, and the exposure."""

import numpy as np

from evslip.rendering.lanes import kernel

SPREAD = np.float32(0.125)
"""Weight of each of two neighbours: with the pixel's own square aperture, a point spread of about 0.58 px standard
deviation, as of a good lens. It also rounds off the kinks that a bare box filter makes at strong edges."""


@kernel
def expose(image, scale, spread, row_blur, out):
    """out = scale x (image blurred along rows and columns with weights spread, 1 - 2 spread, spread).

    row_blur (height, width): scratch.
    """
    height, width = image.shape
    centre = np.float32(1) - np.float32(2) * spread
    for row in range(height):
        source, target = image[row], row_blur[row]
        for x in range(1, width - 1):
            target[x] = centre * source[x] + spread * (source[x - 1] + source[x + 1])
        target[0] = source[0] + spread * (source[1] - source[0])
        target[width - 1] = source[width - 1] + spread * (source[width - 2] - source[width - 1])
    for row in range(height):
        above, below = row_blur[max(row - 1, 0)], row_blur[min(row + 1, height - 1)]
        here, target = row_blur[row], out[row]
        for x in range(width):
            target[x] = scale * (centre * here[x] + spread * (above[x] + below[x]))
