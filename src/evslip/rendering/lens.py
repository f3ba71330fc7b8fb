"""The last step of a frame: what the lens does to the image, and the exposure."""

import numpy as np
from scipy.special import ive

from evslip.config.params import Params
from evslip.rendering.camera import Camera
from evslip.rendering.dirt import Dirt
from evslip.rendering.scratch import kernel

SPREAD = np.float32(0.125)
"""Weight of each of two neighbours: with the pixel's own square aperture, a point spread of about 0.58 px standard
deviation, as of a good lens. It also rounds off the kinks that a bare box filter makes at strong edges."""
TAIL = 1e-6
"""Share of the defocused light that may be cut off."""


class Lens:
    """Distortion, slight blur, defocus, vignetting, dirt. Each but the slight blur costs time only where the parameters
    ask for it."""

    def __init__(self, params: Params, camera: Camera):
        self.pinhole = camera.pinhole()
        """The camera whose undistorted image `form` and `bend_mask` expect."""
        settings, shape = params.camera, (camera.height, camera.width)
        self._shape, self._bent = shape, self.pinhole is not camera
        self._blur = np.zeros(shape, np.float32)
        if self._bent:
            self._taps, self._weights = bspline_taps(camera, self.pinhole)
        self._defocus = gaussian(settings.defocus_px * camera.width / settings.width)
        self._fall_off = fall_off(camera, settings.vignetting) if settings.vignetting else None
        self._dirt = Dirt(params, camera)

    def form(self, image: np.ndarray, scale: float, spread: np.float32) -> np.ndarray:
        """The luminance (height, width) that the sensor sees, times `scale`, from what the pinhole sees."""
        out = np.empty(self._shape, np.float32)
        if self._bent:
            bend(image.reshape(-1), image.shape[1], self._taps, self._weights, np.float32(scale), out)
        else:
            expose(image, np.float32(scale), spread, self._blur, out)
        if len(self._defocus) > 1:
            defocus(out, self._defocus, self._blur)
        if self._fall_off is not None:
            out *= self._fall_off
        self._dirt.darken(out)
        return out

    def bend_mask(self, bodies: np.ndarray) -> np.ndarray:
        """The body of each pixel, from what the pinhole sees: that of the pixel nearest to where it looks."""
        if not self._bent:
            return bodies
        return bodies.reshape(-1)[self._taps + bodies.shape[1] + 1]


def bspline_taps(camera: Camera, pinhole: Camera) -> tuple[np.ndarray, np.ndarray]:
    """Places of each pixel of `camera` in the image of `pinhole`: the flat index of the first of 3 x 3 pixels, of
    shape (height, width), and their weights by row and by column, float32 of shape (6, height, width).

    The weights are those of the quadratic B-spline. On a pixel's middle they are (SPREAD, 1 - 2 SPREAD, SPREAD), the
    lens's blur; between pixels the spread, variance 1/4 px^2, stays the same, and they change smoothly.
    """
    rays = camera.rays()
    column = pinhole.width / 2 - 0.5 + pinhole.focal_px * rays[..., 0]
    row = pinhole.height / 2 - 0.5 - pinhole.focal_px * rays[..., 1]
    i, j = np.rint(row).astype(np.int64), np.rint(column).astype(np.int64)
    weights = [w for t in (row - i, column - j) for w in (0.5 * (0.5 - t) ** 2, 0.75 - t**2, 0.5 * (0.5 + t) ** 2)]
    return (i - 1) * pinhole.width + j - 1, np.stack(weights).astype(np.float32)


def gaussian(sigma_px: float) -> np.ndarray:
    """One half of a blur, from its middle outwards, float32: e^-t I_n(t) with t = sigma^2, the Gaussian of discrete
    places, whose variance is t also where t is small (T. Lindeberg, Scale-space for discrete signals, IEEE Transactions
    on Pattern Analysis and Machine Intelligence 12 (1990)). Both halves sum to 1."""
    taps = ive(np.arange(int(8 * sigma_px) + 8), sigma_px**2)
    taps[1:] *= 2
    sums = np.cumsum(taps)
    taps = taps[: int(np.searchsorted(sums, 1 - TAIL)) + 1]
    taps /= taps.sum()
    taps[1:] /= 2
    return taps.astype(np.float32)


def fall_off(camera: Camera, vignetting: float) -> np.ndarray:
    """Share of the axis's illuminance that each pixel gets, float32: cos(angle)^(4 vignetting). The exponent 4 is the
    natural law of a lens without obstruction (M. Reiss, The cos^4 law of illumination, Journal of the Optical Society
    of America 35 (1945)); real lenses lose more at open aperture, and less if they are built for it. The angle is the
    ray's before distortion."""
    rays = camera.rays()
    return (np.sum(rays * rays, -1) ** (-2 * vignetting)).astype(np.float32)


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


@kernel
def bend(image, stride, taps, weights, scale, out):
    """out = scale x the flat image of rows `stride` wide at the taps of `bspline_taps`."""
    height, width = out.shape
    for row in range(height):
        for x in range(width):
            total = np.float32(0)
            for i in range(3):
                first = taps[row, x] + i * stride
                along = weights[3, row, x] * image[first]
                along += weights[4, row, x] * image[first + 1] + weights[5, row, x] * image[first + 2]
                total += weights[i, row, x] * along
            out[row, x] = scale * total


@kernel
def defocus(image, taps, scratch):
    """Blur in place along rows, then columns.

    taps (n,): from the middle outwards, see `gaussian`; scratch (height, width). The image is mirrored at its edges, so
    that no light is lost.
    """
    height, width = image.shape
    reach = len(taps) - 1
    padded = np.empty(width + 2 * reach, np.float32)
    for row in range(height):
        for x in range(-reach, width + reach):
            padded[x + reach] = image[row, _mirrored(x, width)]
        target = scratch[row]
        for x in range(width):
            target[x] = taps[0] * padded[x + reach]
        for k in range(1, reach + 1):
            for x in range(width):
                target[x] += taps[k] * (padded[x + reach - k] + padded[x + reach + k])
    for row in range(height):
        here, target = scratch[row], image[row]
        for x in range(width):
            target[x] = taps[0] * here[x]
        for k in range(1, reach + 1):
            above, below = scratch[_mirrored(row - k, height)], scratch[_mirrored(row + k, height)]
            for x in range(width):
                target[x] += taps[k] * (above[x] + below[x])


@kernel
def _mirrored(at, length):
    """Index of the pixel that stands at a place outside, with the edge's own pixel repeated."""
    at %= 2 * length
    return at if at < length else 2 * length - 1 - at
