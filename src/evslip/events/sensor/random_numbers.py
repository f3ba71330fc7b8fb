"""Random numbers from counters, not from a stream: any draw can be made alone, in any order, by any thread.

Generator: Philox-4x32-10 (Salmon et al., Parallel random numbers: as easy as 1, 2, 3, SC 2011), which is numpy's Philox
in 32 bits. The key is the camera's seed, the counter is (pixel, purpose, number of the draw).
"""

import math

import numpy as np

from evslip.utils.jit import compiled

MISMATCH, LEAK, CANDIDATE, DEFECT, FRAME, PHOTO = np.arange(6)
"""Purposes of a draw: mismatch of the pixels, leak jitter, the noise process, hot and dead pixels, v2e's frames, the
photoreceptor's noise."""

_MULTIPLY_0, _MULTIPLY_1 = np.uint64(0xD2511F53), np.uint64(0xCD9E8D57)
_WEYL_0, _WEYL_1 = np.uint64(0x9E3779B9), np.uint64(0xBB67AE85)
_LOW, _SHIFT = np.uint64(0xFFFFFFFF), np.uint64(32)
_UNIT = 2.0**-32


@compiled(error_model="numpy", forceinline=True, _nrt=False)
def uniforms(seed: int, pixel: int, purpose: int, number: int) -> tuple[float, float, float, float]:
    """Four independent uniform numbers in the open interval (0, 1), with 32 bits each.

    seed: uint64; pixel, purpose, number: 32 bits each.
    """
    # All words live in uint64: numba promotes uint32 * uint32 to 64 bits anyway, so wrapping is done by hand.
    key_0, key_1 = np.uint64(seed) & _LOW, np.uint64(seed) >> _SHIFT
    a, b, c, d = np.uint64(pixel) & _LOW, np.uint64(purpose), np.uint64(number) & _LOW, np.uint64(0)
    for _ in range(10):
        first, second = a * _MULTIPLY_0, c * _MULTIPLY_1
        a, b, c, d = (second >> _SHIFT) ^ b ^ key_0, second & _LOW, (first >> _SHIFT) ^ d ^ key_1, first & _LOW
        key_0, key_1 = (key_0 + _WEYL_0) & _LOW, (key_1 + _WEYL_1) & _LOW
    return (
        (np.float64(a) + 0.5) * _UNIT,
        (np.float64(b) + 0.5) * _UNIT,
        (np.float64(c) + 0.5) * _UNIT,
        (np.float64(d) + 0.5) * _UNIT,
    )


@compiled(error_model="numpy")
def normals(u: float, v: float) -> tuple[float, float]:
    """Two independent standard normal numbers from two uniform ones (Box and Muller 1958)."""
    radius = math.sqrt(-2.0 * math.log(u))
    return radius * math.cos(2.0 * math.pi * v), radius * math.sin(2.0 * math.pi * v)


@compiled(error_model="numpy")
def normal_maps(seed: int, count: int) -> np.ndarray:
    """Standard normal numbers of shape (4, count): for theta_on, theta_off, the leak map and the shot noise."""
    maps = np.empty((4, count))
    for pixel in range(count):
        a, b, c, d = uniforms(seed, pixel, MISMATCH, 0)
        maps[0, pixel], maps[1, pixel] = normals(a, b)
        maps[2, pixel], maps[3, pixel] = normals(c, d)
    return maps


@compiled(error_model="numpy")
def uniform_maps(seed: int, count: int, purpose: int) -> np.ndarray:
    """Uniform numbers of shape (3, count)."""
    maps = np.empty((3, count))
    for pixel in range(count):
        maps[0, pixel], maps[1, pixel], maps[2, pixel], _ = uniforms(seed, pixel, purpose, 0)
    return maps
