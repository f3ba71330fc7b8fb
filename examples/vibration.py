"""Vibration of camera, object and arm: what it does to an object that is held, and to the events.

python examples/vibration.py docs/figures/scenes/vibration.png
"""

import argparse
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from scipy.spatial.transform import Rotation

import evslip
from evslip.physics.robots.description import TCP_M
from evslip.physics.trajectory import Trajectory
from evslip.rendering import render_span

SPAN_S = 2.0, 2.6
BEFORE_S = 0.3
"""The pixels see this much before, so that their first events are not those of their start."""
COMMON = {
    "motion.kind": "hold",
    "motion.duration_s": 6.0,
    "object.mass_kg": 0.012,
    "sensor.preset": "prophesee-like",
}
KINDS: dict[str, dict[str, float]] = {
    "none": {},
    "camera: 40 Hz, 0.3 mm": {"vibration.mount_hz": 40.0, "vibration.mount_m": 0.0003},
    "object: 30 Hz, 0.4 mm, 0.3°": {
        "vibration.object_hz": 30.0, "vibration.object_m": 0.0004, "vibration.object_deg": 0.3,
    },
    "arm: 8 Hz, 0.03°": {"vibration.tremor_hz": 8.0, "vibration.tremor_deg": 0.03},
}  # fmt: skip
BIN_US = 2000


def main(out: str) -> None:
    figure = Figure(figsize=(13, 5.5), layout="constrained")
    rows = figure.subplots(2, len(KINDS), sharex=True, sharey="row")
    for column, (name, changes) in enumerate(KINDS.items()):
        trajectory = evslip.simulate(evslip.draw(evslip.load_config("simple", {**COMMON, **changes}), 0))
        rows[0, column].set_title(name, size=11)
        draw_way(rows[0, column], trajectory)
        draw_events(rows[1, column], trajectory)
    rows[0, 0].set(ylabel="object in the hand (mm, °)", ylim=(-1.3, 1.3), xlim=SPAN_S)
    rows[1, 0].set(ylabel="events / ms")
    for row in rows:
        row[0].legend(fontsize=9, loc="upper left")
    for axis in rows[1]:
        axis.set_xlabel("time (s)")
    Path(out).parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(out, dpi=80)


def draw_way(axis: Any, trajectory: Trajectory) -> None:
    """The gripped point along the hand's x and the turn about the closing axis, from the poses and from the truth."""
    t_s, truth = trajectory.t_us / 1e6, evslip.measure(trajectory)
    shown = (t_s >= SPAN_S[0]) & (t_s <= SPAN_S[1])
    hand, body = (
        Rotation.from_quat(pose[shown, 3:], scalar_first=True)
        for pose in (trajectory.gripper_pose, trajectory.object_pose)
    )
    turn = hand.inv() * body
    centre = hand.inv().apply(trajectory.object_pose[shown, :3] - trajectory.gripper_pose[shown, :3])
    point = centre + (turn * turn[0].inv()).apply(TCP_M - centre[0])
    axis.plot(t_s[shown], 1e3 * (point[:, 0] - point[:, 0].mean()), lw=0.9, label="x, poses")
    angle = np.degrees((turn * turn[0].inv()).as_rotvec()[:, 1])
    axis.plot(t_s[shown], angle - angle.mean(), lw=0.9, label="turn, poses")
    slid = 1e3 * truth.slide_m[shown, 0]
    axis.plot(t_s[shown], slid - slid[0], "k--", lw=1.2, label="x, truth")


def draw_events(axis: Any, trajectory: Trajectory) -> None:
    """Rates of the events on the object and elsewhere."""
    params, part = trajectory.params, (round(1e6 * (SPAN_S[0] - BEFORE_S)), round(1e6 * SPAN_S[1]))
    camera = evslip.EventCamera(params.sensor.preset, size=(params.camera.width, params.camera.height), seed=0)
    events = camera.run(render_span(trajectory, evslip.measure(trajectory).span_us, part))
    bins = np.arange(round(1e6 * SPAN_S[0]), part[1] + 1, BIN_US)
    bodies = events.body
    assert bodies is not None
    for name, chosen in (("elsewhere", bodies != 2), ("on the object", bodies == 2)):
        rate = np.histogram(events.t_us[chosen], bins)[0] * 1000 / BIN_US
        axis.plot(bins[:-1] / 1e6, rate, lw=0.9, label=name)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", nargs="?", default="vibration.png", help="picture to write (default: %(default)s)")
    main(parser.parse_args().out)
