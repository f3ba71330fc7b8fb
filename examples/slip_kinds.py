"""One sample of every kind of slip: how far the object turns and slides in the hand, and how much friction is in use.

python examples/slip_kinds.py docs/figures/slip_kinds.png
"""

import argparse
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

import evslip
from evslip.config.sections.slip import SLIP_KINDS
from evslip.physics.motion.phases import hanging_phases, phase_bounds_s

TURN, SLIDE, USED, EPISODE = "#c44e00", "#1f77b4", "#888888", "#ffe08a"


def main(out: str) -> None:
    figure = Figure(figsize=(12.5, 11), layout="constrained")
    axes = figure.subplots(4, 2)
    for axis, kind in zip(axes.flat, SLIP_KINDS[1:], strict=True):
        params = evslip.draw(evslip.load_config("complex", {"slip.kind": kind}), 0)
        _draw(axis, params, evslip.measure(evslip.simulate(params)))
    key = [Line2D([], [], color=color) for color in (TURN, SLIDE, USED)] + [Patch(color=EPISODE)]
    names = ["spin in the hand", "slide in the hand", "friction in use (dashed: all)", "slip episode"]
    figure.legend(key, names, loc="outside lower center", ncols=4)
    Path(out).parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(out, dpi=90)


def _draw(axis: Any, params: evslip.Params, truth: evslip.Truth) -> None:
    assert truth.pad_utilisation is not None  # what has just been simulated has it
    seconds, held = truth.t_us / 1e6, truth.held
    begin = int(np.flatnonzero(held)[0])
    spin = np.where(held, truth.spin_deg - truth.spin_deg[begin], np.nan)
    slide = np.where(held, 1e3 * np.linalg.norm(truth.slide_m - truth.slide_m[begin], axis=1), np.nan)
    used = np.where(held, truth.pad_utilisation.max(axis=1), np.nan)
    for episode in truth.episodes:
        axis.axvspan(episode.start_us / 1e6, episode.end_us / 1e6, color=EPISODE, lw=0)
    share, way = axis.twinx(), axis.twinx()
    share.axhline(1, color=USED, lw=0.6, ls="--")
    share.plot(seconds, used, color=USED, lw=1.0)
    share.set(ylim=(0, 4), yticks=[])
    way.plot(seconds, slide, color=SLIDE, lw=1.8)
    way.set_ylabel("slide (mm)", color=SLIDE)
    way.set_ylim(0, max(1.0, 1.25 * np.nanmax(slide)))
    axis.plot(seconds, spin, color=TURN, lw=1.8)
    axis.set_ylabel("spin (°)", color=TURN)
    low, high = np.nanmin(spin), np.nanmax(spin)
    room = max(0.6, 0.15 * (high - low))
    axis.set_ylim(low - room, high + room)
    bounds = phase_bounds_s(params)
    for name in hanging_phases(params):
        start, end = bounds[name]
        axis.axvline(start, color="0.7", lw=0.6, ls=":")
        axis.text((start + end) / 2, 1.01, name, transform=axis.get_xaxis_transform(), ha="center", size=8, color="0.4")
    axis.set_xlim(bounds["lift"][0], bounds["placement"][1])
    slip = params.slip
    axis.set_title(f"{slip.kind}: {1e3 * params.object.mass_kg:.1f} g, {slip.multiple:.2f} x onset", pad=16, size=11)
    axis.set_xlabel("time (s)", labelpad=0)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", nargs="?", default="slip_kinds.png", help="picture to write (default: %(default)s)")
    main(parser.parse_args().out)
