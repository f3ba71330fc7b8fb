"""The README's picture: a held and a slipping object through the five phases, with the events of 20 ms each.

python examples/slip_and_hold.py docs/figures/slip_and_hold.png
"""

import argparse
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import evslip
from evslip.events.overlay import overlay
from evslip.generation.sensor import camera_for
from evslip.physics.motion.phases import phase_times
from evslip.rendering import render_color

PHASES = ("initial", "lift", "tilt", "back", "placement")
SHOWN_US = 20_000


def main(out: str) -> None:
    figure = Figure(figsize=(12.5, 4.5), layout="constrained")
    axes = figure.subplots(2, len(PHASES))
    for row, (index, verdict) in enumerate(((4, "held"), (23, "slips"))):
        params = evslip.draw(evslip.load_config("demo"), index)
        trajectory = evslip.simulate(params)
        truth = evslip.measure(trajectory)
        events = camera_for(params).run(evslip.render(trajectory))
        for axis, phase in zip(axes[row], PHASES, strict=True):
            start, end = phase_times(params)[phase]
            t_us = (max(start, truth.span_us[0]) + end) // 2
            recent = events.between(t_us - SHOWN_US, t_us)
            axis.imshow(overlay(render_color(trajectory, t_us), recent))
            angle = np.interp(t_us, truth.t_us, truth.theta_deg)
            axis.set_title(f"{verdict}, {phase}: θ = {angle:.1f}°" if angle > 0.05 else f"{verdict}, {phase}", size=10)
            axis.set_axis_off()
    Path(out).parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(out, dpi=110)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", nargs="?", default="slip_and_hold.png", help="picture to write (default: %(default)s)")
    main(parser.parse_args().out)
