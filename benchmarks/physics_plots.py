"""Draws docs/figures/physics.png: python benchmarks/physics_plots.py [--out FILE]

Left: the limit surface of a pad for a vertical force and a torque, and of the six points that stand for it. Middle:
mass at which an object that hangs off its centre slips, predicted and simulated. Right: normal force of a pad while an
object slides out of the hand, with stiff pads and with the ones in use.
"""

import argparse
from pathlib import Path

import numpy as np
from fixed_hand import hang
from physics import OFFSETS_MM, STIFF
from physics_cases import CUBOID, bisected, gripped, hanging_onset_kg, params_of, weighing

from evslip.physics.grip import LEFT, grasp
from evslip.physics.limit_surface import LimitSurface
from evslip.physics.onset import pad_surface

PREDICTED, SIMULATED, OTHER = "#1f4e79", "#e07b00", "#9a9a9a"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("docs/figures/physics.png"))
    options = parser.parse_args()
    import matplotlib.pyplot as plt

    plt.rcParams |= {"font.size": 9, "axes.spines.top": False, "axes.spines.right": False, "lines.linewidth": 1.5}
    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(12, 3.8), layout="constrained")
    _limit_surface(left)
    _onset(middle)
    _chatter(right)
    figure.savefig(options.out, dpi=110)


def _limit_surface(axes) -> None:
    angles = np.linspace(0, np.pi / 2, 181)
    for depth_mm, style in ((12, "-"), (-4, "--")):
        params = params_of(0, 0, "panda", CUBOID | gripped(depth_mm, 0, 1, 1))
        points = grasp(params).pads[LEFT].contacts
        centre = points.mean(axis=0)
        surfaces = {"even pressure": pad_surface(params), "six points": LimitSurface.of(points, np.ones(len(points)))}
        for (name, surface), color in zip(surfaces.items(), (PREDICTED, SIMULATED), strict=True):
            lever = 0.0065
            force, torque = np.cos(angles), lever * np.sin(angles)
            wrench = np.stack([0 * angles, force, torque - centre[0] * force], axis=1)
            scale = 1 / surface.utilisation(wrench)
            part = "whole pad" if depth_mm == 12 else "4.5 of 17 mm"
            axes.plot(scale * force, 1e3 * scale * torque, style, color=color, label=f"{name}, {part}")
    axes.set(xlabel="vertical force / μN", ylabel="torque / μN, mm", title="What a pad carries", xlim=(0, 1.08), ylim=0)
    axes.legend(frameon=False, fontsize=8)


def _onset(axes) -> None:
    fine = np.linspace(0, 20, 41)
    for depth_mm, shade in ((12, 1.0), (4, 0.75), (-4, 0.5)):
        cases = [params_of(0, 0, "panda", CUBOID | gripped(depth_mm, offset, 1, 0.5)) for offset in fine]
        axes.plot(fine, [1e3 * hanging_onset_kg(case) for case in cases], color=PREDICTED, alpha=shade)
        for offset in OFFSETS_MM:
            params = params_of(0, 0, "panda", CUBOID | gripped(depth_mm, offset, 1, 0.5))
            simulated = 1e3 * bisected(params) * hanging_onset_kg(params)
            axes.plot(offset, simulated, "o", color=SIMULATED, markersize=5)
        end = 20, 1e3 * hanging_onset_kg(cases[-1])
        axes.annotate(f"{depth_mm} mm", end, (6, -3), textcoords="offset points", fontsize=8)
    axes.annotate("tool centre\nbelow the edge:", (20, 35), (0, 0), textcoords="offset points", fontsize=8)
    axes.plot([], [], color=PREDICTED, label="predicted")
    axes.plot([], [], "o", color=SIMULATED, label="simulated")
    axes.set(
        xlabel="grip off the centre of mass, mm", ylabel="onset mass, g", title="F = 1 N, μ = 0.5, at rest", ylim=0
    )
    axes.legend(frameon=False, fontsize=8)


def _chatter(axes) -> None:
    params = params_of(0, 0, "panda", CUBOID | gripped(12, 0, 1, 0.5))
    heavy = weighing(params, 1.3 * hanging_onset_kg(params))
    for name, constants, color in (("stiff pads", STIFF, OTHER), ("pads in use", {}, SIMULATED)):
        motion = hang(heavy, constants)
        way_mm = -1e3 * motion.position_m[:, 2]
        sliding = (way_mm > -1) & (way_mm < 6)
        start = motion.t_s[np.argmax(way_mm > 0.1)]
        axes.plot(1e3 * (motion.t_s[sliding] - start), motion.pads_n[sliding, 0], color=color, label=name)
    axes.set(xlabel="time since the slip began, ms", ylabel="normal force of a pad, N", xlim=(-60, None))
    axes.set_title("Sliding, 6 mm, up to 0.15 m/s")
    axes.legend(frameon=False, fontsize=8)


if __name__ == "__main__":
    main()
