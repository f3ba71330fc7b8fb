"""Photoreceptor noise of a tile of pixels: drawn on a time grid, linear in between."""

import math

import numpy as np

from evslip.events.pixels.pixel import next_noise
from evslip.utils.jit import compiled


@compiled(error_model="numpy", _nrt=False)
def narrow_by_noise(bound: np.ndarray, noise: np.ndarray, sign: float, out: np.ndarray) -> None:
    """Bounds of lp where the noise, of shape (2, n), comes on top of it; sign: 1 for ON, -1 for OFF."""
    for i in range(len(out)):
        out[i] = bound[i] - np.float32(sign * max(sign * noise[0, i], sign * noise[1, i]))


@compiled(error_model="numpy", _nrt=False)
def _noise_at(grid: np.ndarray, first: int, time_us: float, step_us: float, out: np.ndarray) -> None:
    """Noise of a tile at a time between two points of its time grid."""
    share = time_us / step_us - math.floor(time_us / step_us)
    for i in range(len(out)):
        a, b = grid[0, first + i], grid[1, first + i]
        out[i] = a + share * (b - a)


@compiled(error_model="numpy", _nrt=False)
def cut_by_noise(grid, first, start_us, end_us, current_0, current_1, params, noise) -> float:
    """End an interval of a tile where the photoreceptor's noise is drawn anew, if that comes first.

    grid: `Pixels.photoreceptor_noise`; first: first pixel of the tile; params: `Parameters`. Moves current_1, float32
    of shape (n,), to the new end and fills noise, of shape (2, n), at both ends. Returns the new end.
    """
    step_us = params.noise_step_us
    point = int(np.floor(start_us / step_us)) + 1
    cut_us = min(point * step_us, end_us)
    share = (cut_us - start_us) / (end_us - start_us)
    if cut_us < end_us:
        for i in range(len(current_1)):
            # Double: an interval may be cut a thousand times, and each cut begins where the last one ended.
            log_0, log_1 = math.log(np.float64(current_0[i])), math.log(np.float64(current_1[i]))
            current_1[i] = np.float32(math.exp(log_0 + (log_1 - log_0) * share))
    _noise_at(grid, first, start_us, step_us, noise[0])
    if cut_us < point * step_us:
        _noise_at(grid, first, cut_us, step_us, noise[1])
        return cut_us
    for i in range(len(current_1)):
        pixel = first + i
        noise[1, i] = grid[0, pixel] = grid[1, pixel]
        grid[1, pixel] = next_noise(params, noise[1, i], current_1[i], pixel, point + 1)
    return cut_us
