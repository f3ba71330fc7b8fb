"""Noise of a camera at three light levels against measured noise: python benchmarks/noise_levels.py FOLDER

FOLDER holds iebcs_noise_pos_0.1lux.npy and the five files beside it, which come with IEBCS (Joubert, Marcireau, Ralph,
Jolley, van Schaik, Cohen, Event camera simulator improvements via characterized parameters, Frontiers in Neuroscience
2021): for each of 50 x 50 pixels the cumulative histogram of the frequency, 1 / interval, of successive noise events of
one polarity. The camera (--camera davis346-dim) sees an even, still scene at the same three levels, where white is
--white-lux, for as long; its events are counted in the same way. Prints Markdown.
"""

import argparse
from pathlib import Path
from typing import NamedTuple

import numpy as np

from evslip.events.camera import EventCamera

EDGES_HZ = np.array([step * 10.0**decade for decade in range(-3, 5) for step in range(1, 10)])
LEVELS = {"0.1": 0.1, "161": 161.0, "3k": 3000.0}
FREQUENT = 25
"""Pixels with more intervals fill nearly the whole recording with them: these tell how long it was."""
SIDE = 200
HEAD = ("light, lux", "", "ON, Hz", "OFF, Hz", "spread ON, OFF, decades", "ON, OFF: r", "without two ON, %", "OFF, %")


class Noise(NamedTuple):
    """Noise of the pixels in one recording."""

    seconds: float
    counts: np.ndarray
    """Intervals of ON and OFF events, of shape (2, pixels)."""


def measured(folder: Path, level: str) -> Noise:
    histograms = []
    for polarity in ("pos", "neg"):
        # The last column of the files is empty: 72 edges make 71 bins.
        cumulative = np.load(folder / f"iebcs_noise_{polarity}_{level}lux.npy").reshape(-1, len(EDGES_HZ))[:, :-1]
        histograms.append(np.diff(cumulative, axis=1, prepend=0.0))
    on = histograms[0]
    counts = np.stack([histogram.sum(1) for histogram in histograms])
    covered_s = (on * 0.5 * (1.0 / EDGES_HZ[:-1] + 1.0 / EDGES_HZ[1:])).sum(1)
    frequent = counts[0] > FREQUENT
    return Noise(float(np.median(covered_s[frequent] * (1.0 + 2.0 / counts[0, frequent]))), counts)


def simulated(preset: str, light: float, seconds: float, seed: int) -> Noise:
    camera = EventCamera(preset, size=(SIDE, SIDE), seed=seed)
    image = np.full((SIDE, SIDE), light)
    events = camera.run((1e6 * t, image) for t in np.append(np.arange(0.0, seconds, 0.1), seconds))
    pixel = events.y.astype(np.int64) * SIDE + events.x
    counts = np.stack([np.bincount(pixel[events.p == on], minlength=SIDE * SIDE) for on in (True, False)])
    return Noise(seconds, np.maximum(counts - 1, 0))


def row(title: str, which: str, noise: Noise) -> str:
    some = noise.counts > 0
    hz = np.where(some, noise.counts + 1, 0) / noise.seconds
    both = some.all(0)
    logs = np.log10(hz[:, both]) if both.mean() > 0.5 else np.full((2, 1), np.nan)
    spread, together = logs.std(1), np.corrcoef(logs)[0, 1] if logs.shape[1] > 1 else np.nan
    cells = (
        title,
        which,
        *(_quartiles(rates) for rates in hz),
        "" if np.isnan(together) else f"{spread[0]:.2f}, {spread[1]:.2f}",
        "" if np.isnan(together) else f"{together:.2f}",
        *(f"{100 * (1.0 - share):.1f}" for share in some.mean(1)),
    )
    return f"| {' | '.join(cells)} |"


def _quartiles(rates: np.ndarray) -> str:
    low, middle, high = np.percentile(rates, (25, 50, 75))
    return f"{middle:.2g} ({low:.2g} to {high:.2g}), mean {rates.mean():.2g}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--camera", nargs="+", default=["davis346-dim"], help="presets, or files of them")
    parser.add_argument("--white-lux", type=float, default=4.0)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    print(f"| {' | '.join(HEAD)} |\n{'|---' * len(HEAD)}|")
    for level, lux in LEVELS.items():
        real = measured(options.folder, level)
        print(row(f"{lux:g} ({real.seconds:.1f} s)", "measured", real))
        for preset in options.camera:
            noise = simulated(preset, lux / options.white_lux, real.seconds, options.seed)
            print(row("", preset, noise), flush=True)


if __name__ == "__main__":
    main()
