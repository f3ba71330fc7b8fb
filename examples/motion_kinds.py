"""Every kind of motion: the way of the tool centre and its tilt.

python examples/motion_kinds.py docs/figures/motion_kinds.png
"""

import argparse
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

import evslip
from evslip.physics.motion.phases import phase_bounds_s
from evslip.physics.motion.servo_plan import duration_s, tool_path
from evslip.scene.motions import KINDS

WAY = [{"y_m": -0.1, "z_m": 0.05, "tilt_deg": 20.0, "time_s": 1.5}, {"x_m": 0.04, "y_m": -0.2, "z_m": 0.02}]
COLORS = ("#9467bd", "#2ca02c", "#1f77b4")
TILT = "#c44e00"


def main(out: str) -> None:
    figure = Figure(figsize=(12.5, 8), layout="constrained")
    axes = figure.subplots(3, 2).ravel()
    for axis, kind in zip(axes[: len(KINDS)], KINDS, strict=True):
        own = {"motion.waypoints": WAY} if kind == "waypoints" else {}
        _draw(axis, evslip.draw(evslip.load_config("demo", {"motion.kind": kind, **own}), 0))
    names = ["tool centre, x", "y", "z", "tilt about the closing axis"]
    key = [Line2D([], [], color=color) for color in COLORS] + [Line2D([], [], color=TILT, ls="--")]
    axes[-1].legend(key, names, loc="center", fontsize=12)
    axes[-1].set_axis_off()
    Path(out).parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(out, dpi=80)


def _draw(axis: Any, params: evslip.Params) -> None:
    t_s = np.linspace(0, duration_s(params), 2000)
    tool, tilt = tool_path(params, t_s)
    for k in range(3):
        axis.plot(t_s, 1e3 * (tool[:, k] - tool[0, k]), color=COLORS[k])
    angle = axis.twinx()
    angle.plot(t_s, np.degrees(tilt), color=TILT, ls="--")
    angle.set(ylabel="tilt (°)", ylim=(-65, 65))
    for name, (start, end) in phase_bounds_s(params).items():
        axis.axvline(start, color="0.7", lw=0.6, ls=":")
        if end - start > 0.1 * t_s[-1]:
            axis.text(
                (start + end) / 2, 1.01, name, transform=axis.get_xaxis_transform(), ha="center", size=8, color="0.4"
            )
    axis.set(xlabel="time (s)", ylabel="way (mm)", xlim=(0, t_s[-1]))
    axis.set_title(params.motion.kind, pad=14, size=11)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", nargs="?", default="motion_kinds.png", help="picture to write (default: %(default)s)")
    main(parser.parse_args().out)
