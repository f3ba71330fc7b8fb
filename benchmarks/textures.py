"""Cost and statistics of the texture pool: python benchmarks/textures.py [PATTERN]

Photographs of nature have an amplitude spectrum of about 1 / f^a with a from 0.8 to 1.5 (Tolhurst, Tadmor and Chao
1992), and a root-mean-square contrast, standard deviation over mean of the luminance, of 0.2 to 0.9.
"""

import sys
import time
from itertools import pairwise

import numpy as np

from evslip.rendering.raycast.layers import LUMA_WEIGHTS
from evslip.scene.textures import library, patterns


def statistics(image: np.ndarray) -> tuple[float, float]:
    """(a, contrast) of linear RGB of shape (rows, columns, 3): its amplitude spectrum, the mean over the directions, is
    fitted by 1 / f^a from 4 to 128 cycles a side."""
    luma = image @ LUMA_WEIGHTS.astype(np.float32)
    rows, columns = luma.shape
    spectrum = np.abs(np.fft.fft2(luma - luma.mean()))
    frequency = np.hypot(np.fft.fftfreq(rows, 1 / rows)[:, None], np.fft.fftfreq(columns, 1 / columns))
    edges = np.geomspace(4, 128, 11)
    amplitude = [spectrum[(frequency >= a) & (frequency < b)].mean() for a, b in pairwise(edges)]
    slope = np.polyfit(np.log(np.sqrt(edges[:-1] * edges[1:])), np.log(amplitude), 1)[0]
    return -float(slope), float(luma.std() / luma.mean())


def main(pattern: str = "*") -> None:
    names = library.expand(pattern, is_background=True)
    rows = []
    for name in names if isinstance(names, tuple) else (pattern,):
        family, _, number = name.rpartition("-")
        start = time.process_time()
        image = patterns.make(family, int(number))
        spent = (time.process_time() - start) * 1e3
        upper = image[: len(image) // 2] if library.is_panorama(image) else image
        exponent, contrast = statistics(upper)
        rows.append((family, spent, exponent, contrast))
        print(f"{name:12} {spent:6.0f} ms  1/f^{exponent:.2f}  contrast {contrast:.2f}")
    print()
    for kind, families in (("materials", patterns.MATERIALS), ("panoramas", patterns.PANORAMAS)):
        chosen = np.array([row[1:] for row in rows if row[0] in families])
        if len(chosen):
            low, middle, high = np.quantile(chosen, (0.1, 0.5, 0.9), axis=0)
            print(
                f"{len(chosen)} {kind}: {chosen[:, 0].mean():.0f} ms on average; median and 10-90 %: exponent "
                f"{middle[1]:.2f} ({low[1]:.2f}-{high[1]:.2f}), contrast {middle[2]:.2f} ({low[2]:.2f}-{high[2]:.2f})"
            )


if __name__ == "__main__":
    main(*sys.argv[1:])
