"""Counterparts of figures 1 to 8 of the paper, from samples that are made here and now.

python examples/paper_figures.py docs/figures [--real recording.aedat4] [--data FOLDER] [--only 2 6]

Two samples of one scene, one of which slips, and eight drawn from the Complex Set; about four minutes on two cores. The
data set is made in --data, if given, and made only once. Figures 1 and 4 need the extra `photo` (the view of the whole
scene), figure 8 a real recording.
"""

import argparse
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch

import evslip
from evslip.data.record import Record
from evslip.data.record_file import read_recording
from evslip.events.frame import OBJECT
from evslip.events.overlay import OFF_COLOR, ON_COLOR, overlay
from evslip.physics.motion.phases import phase_times
from evslip.rendering import render_color
from evslip.rendering.camera import hand_camera
from evslip.rendering.poses import matrices
from evslip.view.pictures.figures import HOLD_COLOR, SLIP_COLOR
from evslip.windows.cutting import label_of, movements
from evslip.windows.label import Label
from evslip.windows.window_set import WindowSettings

PHASES = ("initial", "lift", "tilt", "back", "placement")
SHOWN_US = 15_000
ONE_SCENE = {
    "together": [],
    "object.width_m": 0.06,
    "object.height_m": 0.09,
    "object.mass_kg": [0.012, 0.06],
    "object.texture": "cardboard-0",
    "surface.texture": "wood-0",
    "background.texture": "brick-1",
    "grip.offset": 0.6,
    "grip.depth_m": 0.015,
    "light.azimuth_deg": 60.0,
}
"""A configuration that varies the mass alone: the lesser one never slips, the greater one does."""
WINDOW_COLORS = {"hold": HOLD_COLOR, "slip": SLIP_COLOR, "between": "0.8"}


def one_scene(folder: Path) -> tuple[Record, Record]:
    """A sample that slips and one that holds, otherwise equal."""
    evslip.generate(evslip.load_config("simple", ONE_SCENE), folder, 2)
    records = {record.label: record for record in evslip.open_dataset(folder)}
    return records["slip"], records["hold"]


def middles(record: Record) -> list[int]:
    """The middle of each phase, as far as it is recorded, in microseconds."""
    assert record.params is not None and record.truth is not None
    first, last = record.truth.span_us
    times = phase_times(record.params)
    return [(max(first, times[name][0]) + min(last, times[name][1])) // 2 for name in PHASES]


def seen(record: Record, t_us: int) -> np.ndarray:
    """The frame at a time."""
    assert record.trajectory is not None
    return render_color(record.trajectory, t_us)


def with_events(record: Record, t_us: int, shown_us: int = SHOWN_US) -> np.ndarray:
    """The frame at a time, in grey, with the events before it."""
    return overlay(seen(record, t_us), record.events.between(t_us - shown_us, t_us))


def panel(axis: Any, picture: np.ndarray, title: str = "") -> None:
    axis.imshow(picture)
    axis.set_title(title, size=9)
    axis.set_axis_off()


def boxes(axis: Any, texts: Sequence[tuple[float, float, str]], width: float, height: float, color: str) -> None:
    """Boxes with text about the given places."""
    for x, y, text in texts:
        corner = (x - width / 2, y - height / 2)
        style = FancyBboxPatch(corner, width, height, boxstyle="round,pad=0.02,rounding_size=0.06", fc=color, ec="0.3")
        axis.add_patch(style)
        axis.text(x, y, text, ha="center", va="center", size=8.5)


def arrow(axis: Any, start: tuple[float, float], end: tuple[float, float]) -> None:
    axis.add_patch(FancyArrowPatch(start, end, arrowstyle="-|>", mutation_scale=11, color="0.25", lw=1.2))


def windows_of(record: Record) -> Iterator[tuple[float, float, str]]:
    """Start and end of every window in seconds, and its label."""
    assert record.truth is not None
    settings = WindowSettings()
    for movement in movements(record.truth, settings):
        label = label_of(movement, settings)
        start = movement.start_us / 1e6
        yield start, start + settings.length_s, "between" if label == Label.UNCERTAIN else label.name.lower()


def overview(slip: Record, hold: Record) -> Figure:
    """Figure 1: simulation, events with labels, and what the networks are given."""
    assert slip.trajectory is not None and slip.truth is not None and slip.onset_us is not None
    figure = Figure(figsize=(12, 4.6), layout="constrained")
    left, middle, right = figure.subfigures(1, 3, width_ratios=[1.05, 1.25, 1])
    left.suptitle("simulation", size=11)
    t_us = slip.onset_us + 200_000
    for axis, picture in zip(left.subplots(2, 1), (scene_view(slip, t_us), seen(slip, t_us)), strict=True):
        panel(axis, picture)
    middle.suptitle("events and labels", size=11)
    axes = middle.subplot_mosaic([["slip", "hold"], ["angle", "angle"]])
    for name, record in (("slip", slip), ("hold", hold)):
        panel(axes[name], with_events(record, t_us), f"{name}, {t_us / 1e6:.2f} s")
    for start, end, label in windows_of(slip):
        axes["angle"].axvspan(start, end, color=WINDOW_COLORS[label], alpha=0.35, lw=0)
    for record, color in ((slip, SLIP_COLOR), (hold, HOLD_COLOR)):
        assert record.truth is not None
        inside = (record.truth.t_us >= record.truth.span_us[0]) & (record.truth.t_us <= record.truth.span_us[1])
        axes["angle"].plot(record.truth.t_us[inside] / 1e6, record.truth.theta_deg[inside], color=color, lw=1.5)
    axes["angle"].set(xlabel="time in s", ylabel="angular difference in °")
    axes["angle"].set_title("windows of 0.16 s of the one that slips: slip, hold, between", size=9)
    right.suptitle("detection", size=11)
    volume(right.add_subplot(2, 1, 1, projection="3d"), slip, slip.onset_us + 100_000)
    axis = right.add_subplot(2, 1, 2)
    axis.set(xlim=(0, 3), ylim=(0.2, 1.8))
    axis.set_axis_off()
    boxes(axis, [(0.5, 1, "0.16 s of events\n200 x 250 pixels\n150 or 350 bins")], 0.95, 0.9, "#e8eef5")
    boxes(axis, [(1.72, 1, "MLP\nSNN\n3D-CNN ...")], 0.7, 0.9, "#f3ecd9")
    boxes(axis, [(2.7, 1.35, "slip")], 0.45, 0.3, SLIP_COLOR + "66")
    boxes(axis, [(2.7, 0.65, "hold")], 0.45, 0.3, HOLD_COLOR + "66")
    for start, end in (((1.0, 1), (1.33, 1)), ((2.1, 1.1), (2.44, 1.3)), ((2.1, 0.9), (2.44, 0.7))):
        arrow(axis, start, end)
    return figure


def volume(axis: Any, record: Record, start_us: int, length_us: int = 160_000, object_alone: bool = False) -> None:
    """Events in space and time: others grey, the object's in colour."""
    events = record.events.between(start_us, start_us + length_us)
    assert events.body is not None
    rng = np.random.default_rng(0)
    for of_object, most in ((False, 0 if object_alone else 6000), (True, 6000)):
        part = events.select((events.body == OBJECT) == of_object)
        part = part.select(np.sort(rng.choice(part.count, min(most, part.count), replace=False)))
        on = np.array([to_rgb(np.array(color) / 255) for color in (OFF_COLOR, ON_COLOR)])[part.p.astype(int)]
        colors = on if of_object else "0.7"
        axis.scatter((part.t_us - start_us) / 1e3, part.x, part.y, s=0.9 if of_object else 0.35, c=colors, lw=0)
    width, height = record.size
    axis.set(xlim=(0, length_us / 1e3), ylim=(0, width), zlim=(height, 0))
    for name, title in (("x", "ms"), ("y", "column"), ("z", "row")):
        getattr(axis, f"set_{name}label")(title, labelpad=-7, size=8)
    axis.set(yticks=[0, 100, 200, 300], zticks=[0, 100, 200])
    axis.tick_params(labelsize=7, pad=-2)
    axis.set_box_aspect((2.2, 1.2, 1.2 * height / width), zoom=1.45)
    axis.view_init(elev=18, azim=-62)


def two_samples(slip: Record, hold: Record) -> Figure:
    """Figure 2: frames with events over time, and events in space and time, with and without slip."""
    assert slip.onset_us is not None
    figure = Figure(figsize=(12, 8.6), layout="constrained")
    for part, record, name in zip(figure.subfigures(2, 1), (slip, hold), ("slip", "no slip"), strict=True):
        part.suptitle(name, size=11)
        top, bottom = part.subfigures(2, 1, height_ratios=[1, 1.35])
        times = np.linspace(slip.onset_us - 50_000, slip.onset_us + 400_000, 5).astype(int)
        for axis, t_us in zip(top.subplots(1, 5), times.tolist(), strict=True):
            panel(axis, with_events(record, t_us, 5_000), f"{t_us / 1e6:.2f} s")
        for place, alone in enumerate((False, True)):
            axis = bottom.add_subplot(1, 2, place + 1, projection="3d")
            volume(axis, record, int(times[0]), 450_000, alone)
            axis.set_title("events of the object alone" if alone else "all events, the object's in colour", size=9)
    return figure


def flow_chart() -> Figure:
    """Figure 3: the pipeline, its stages and the commands that run them."""
    figure = Figure(figsize=(12, 3.6), layout="constrained")
    axis = figure.subplots()
    axis.set(xlim=(0, 12.2), ylim=(0, 3.4))
    axis.set_axis_off()
    for x, width, title, color in (
        (0.1, 6.5, "data generation: evslip generate", "#eef3f8"),
        (6.75, 5.35, "slip detection", "#faf5e8"),
    ):
        axis.add_patch(FancyBboxPatch((x, 0.1), width, 3.1, boxstyle="round,pad=0.02", fc=color, ec="none"))
        axis.text(x + width / 2, 2.98, title, ha="center", size=10)
    making = [
        (0.95, 1.9, "parameters\ngrid or random,\ntrain and test apart"),
        (2.65, 1.9, "physics\nMuJoCo, 1 kHz:\nposes, contact forces"),
        (4.35, 2.35, "frames\nray caster,\nadaptive times"),
        (4.35, 1.05, "ground truth\nangular difference,\nslide, onset"),
        (5.95, 2.35, "event camera\npixel by pixel,\nmicroseconds"),
    ]
    learning = [
        (7.6, 1.9, "windows of 0.16 s\nlabels, crop,\nbalance, bins"),
        (9.3, 1.9, "training\nMLP, SNN,\n3D-CNN ... sweep"),
        (11.1, 2.35, "evaluation\nscores, latency,\nfalse alarms"),
        (11.1, 1.05, "detection\nstreams, live,\n5 ms a step"),
    ]
    boxes(axis, making, 1.35, 0.85, "white")
    boxes(axis, learning, 1.4, 0.85, "white")
    boxes(axis, [(7.6, 0.6, "real recordings, labelled\nby a person")], 1.5, 0.5, "#e9f4ec")
    ways = [
        ((1.65, 1.9), (1.95, 1.9)),
        ((3.35, 2.05), (3.65, 2.3)),
        ((3.35, 1.7), (3.65, 1.2)),
        ((5.05, 2.35), (5.25, 2.35)),
        ((6.65, 2.3), (6.87, 2.05)),
        ((5.05, 1.05), (6.87, 1.65)),
        ((8.33, 1.9), (8.57, 1.9)),
        ((10.03, 2.0), (10.37, 2.3)),
        ((10.03, 1.75), (10.37, 1.2)),
        ((7.6, 0.88), (7.6, 1.45)),
    ]
    for start, end in ways:
        arrow(axis, start, end)
    return figure


def scene_view(record: Record, t_us: int) -> np.ndarray:
    """The scene from beside the table, path-traced."""
    assert record.trajectory is not None
    return render_color(record.trajectory, t_us, view="scene", size=(480, 360), renderer="pathtrace")


def scene(slip: Record, hold: Record) -> Figure:
    """Figure 4: the scene, and the view of the camera on the hand, from the beginning to the end."""
    figure = Figure(figsize=(7.4, 8.2), layout="constrained")
    times = middles(hold)
    for row, place in zip(figure.subplots(3, 2), (0, 2, 4), strict=True):
        panel(row[0], scene_view(hold, times[place]), f"scene, {PHASES[place]}, {times[place] / 1e6:.1f} s")
        panel(row[1], seen(hold, times[place]), "camera on the hand")
    return figure


def frames_of_reference(slip: Record, hold: Record) -> Figure:
    """Figure 5: the axes of the gripper (red) and of the object (blue), before the slip and half a second into it."""
    assert slip.onset_us is not None and slip.truth is not None
    figure = Figure(figsize=(9.4, 3.9), layout="constrained")
    start = slip.truth.span_us[0] + 50_000
    first = axes_in_hand(slip, start)[1]
    for axis, t_us in zip(figure.subplots(1, 2), (start, slip.onset_us + 500_000), strict=True):
        angle = float(np.interp(t_us, slip.truth.t_us, slip.truth.theta_deg))
        panel(axis, seen(slip, t_us), f"{t_us / 1e6:.2f} s, angular difference {angle:.1f}°")
        place, turned = axes_in_hand(slip, t_us)
        for turn, length_m, color, name in (
            (np.eye(3), 0.04, "#e5231b", "gripper"),
            (turned @ first.T, 0.03, "#1a5fff", "object"),
        ):
            draw_axes(axis, slip, place, length_m * turn, color, name)
        axis.set(xlim=(0, slip.size[0]), ylim=(slip.size[1], 0))
        axis.legend(loc="lower left", fontsize=8, framealpha=0.85)
    return figure


def axes_in_hand(record: Record, t_us: int) -> tuple[np.ndarray, np.ndarray]:
    """The object's centre in the hand's frame, (3,), and its orientation there, (3, 3)."""
    traj = record.trajectory
    assert traj is not None
    i = int(np.searchsorted(traj.t_us, t_us))
    hand, body = matrices(traj.gripper_pose[i, 3:]), matrices(traj.object_pose[i, 3:])
    return hand.T @ (traj.object_pose[i, :3] - traj.gripper_pose[i, :3]), hand.T @ body


def draw_axes(axis: Any, record: Record, place: np.ndarray, axes_m: np.ndarray, color: str, name: str) -> None:
    """Axes, as columns, about a place in the hand's frame, as its camera sees them."""
    assert record.params is not None
    camera = hand_camera(record.params)
    ends = place + np.vstack([np.zeros(3), axes_m.T])
    points = camera.project((ends - camera.position) @ camera.rotation)[:, :2]
    for number, (x, y) in enumerate(points[1:]):
        if np.hypot(x - points[0, 0], y - points[0, 1]) > 4:  # the third one points at the camera
            axis.annotate("", (x, y), points[0], arrowprops={"arrowstyle": "-|>", "color": color, "lw": 2.2})
            axis.text(x + 4, y, "xyz"[number], color=color, size=10, weight="bold")
    axis.plot([], [], color=color, lw=2.2, label=name)


def five_phases(slip: Record, hold: Record) -> Figure:
    """Figure 6: five phases of two samples, frames above, with events below."""
    figure = Figure(figsize=(12, 8.4), layout="constrained")
    for part, record, name in zip(figure.subfigures(2, 1), (hold, slip), ("no slip", "slip"), strict=True):
        part.suptitle(name, size=11)
        axes = part.subplots(2, 5)
        for column, (phase, t_us) in enumerate(zip(PHASES, middles(record), strict=True)):
            panel(axes[0, column], seen(record, t_us), phase)
            panel(axes[1, column], with_events(record, t_us))
    return figure


def variety() -> Figure:
    """Figure 7: frames of eight samples of the Complex Set."""
    figure = Figure(figsize=(12, 4.7), layout="constrained")
    config = evslip.load_config("complex")
    for index, axis in enumerate(figure.subplots(2, 4).ravel()):
        trajectory = evslip.simulate(evslip.draw(config, index))
        held = evslip.measure(trajectory)
        panel(axis, render_color(trajectory, sum(held.span_us) // 2))
    return figure


def real(recording: Record) -> Figure:
    """Figure 8: frames, if there are any, and events of a real recording, with its labels."""
    events = recording.events
    start, end = int(events.t_us[0]), int(events.t_us[-1])
    figure = Figure(figsize=(12, 4.4), layout="constrained")
    axes = figure.subplot_mosaic([["0", "1", "2", "3"], ["rate"] * 4], height_ratios=[2.4, 1])
    for k in range(4):
        t_us = start + (2 * k + 1) * (end - start) // 8
        frame = np.full((recording.size[1], recording.size[0], 3), 255, np.uint8)
        if recording.footage is not None:
            frame = recording.footage.at(t_us)
        panel(axes[str(k)], overlay(frame, events.between(t_us - 10_000, t_us)), f"{(t_us - start) / 1e6:.2f} s")
    edges = np.linspace(start, end, 200)
    for sign, color in ((True, ON_COLOR), (False, OFF_COLOR)):
        rate = np.histogram(events.t_us[events.p == sign], edges)[0] / np.diff(edges) * 1e3
        axes["rate"].plot(
            (edges[:-1] - start) / 1e6, rate, color=np.array(color) / 255, lw=1, label="ON" if sign else "OFF"
        )
    top = 1.3 * np.quantile(np.histogram(events.t_us, edges)[0] / np.diff(edges) * 1e3, 0.98)
    for interval in recording.intervals:
        color = WINDOW_COLORS[interval.label]
        axes["rate"].axvspan((interval.start_us - start) / 1e6, (interval.end_us - start) / 1e6, color=color, alpha=0.3)
    axes["rate"].set(xlabel="time in s", ylabel="1000 events/s", xlim=(0, (end - start) / 1e6), ylim=(0, top))
    axes["rate"].legend(loc="upper right", frameon=False, ncols=2)
    return figure


OF_ONE_SCENE: dict[int, tuple[str, Callable[[Record, Record], Figure]]] = {
    1: ("overview", overview),
    2: ("two_samples", two_samples),
    4: ("scene", scene),
    5: ("angular_difference", frames_of_reference),
    6: ("five_phases", five_phases),
}
OTHERS: dict[int, tuple[str, Callable[[], Figure]]] = {3: ("flow_chart", flow_chart), 7: ("variety", variety)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--real", type=Path)
    parser.add_argument("--data", type=Path)
    parser.add_argument("--only", type=int, nargs="*", default=[*range(1, 9)])
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)

    def save(number: int, name: str, figure: Figure) -> None:
        path = options.out / f"paper_{number}_{name}.jpg"
        figure.savefig(path, dpi=100, pil_kwargs={"quality": 85, "optimize": True})
        print(f"{path}: {path.stat().st_size / 1e3:.0f} kB")

    if wanted := [number for number in OF_ONE_SCENE if number in options.only]:
        with tempfile.TemporaryDirectory() as folder:
            slip, hold = one_scene(options.data or Path(folder) / "data")
        for number in wanted:
            name, draw = OF_ONE_SCENE[number]
            save(number, name, draw(slip, hold))
    for number, (name, make) in OTHERS.items():
        if number in options.only:
            save(number, name, make())
    if options.real and 8 in options.only:
        save(8, "real", real(read_recording(options.real)))


if __name__ == "__main__":
    main()
