"""Everything of one's own: mesh, photo, camera pose, sensor, motions, network, training on two data sets, live loop.

python examples/own_everything.py [OUT]

OUT (own_everything) gets a mesh and a photo, two configurations, their data sets, a windows file, a detector, and two
pictures: scene.png (a frame of each set with the events around it) and live.png (the detector beside the truth of a new
sample).
About a minute on two cores, once evslip is compiled. docs/tutorials/own-everything.md goes through it.
"""

import argparse
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import ClassVar, NamedTuple

import numpy as np
import torch
import trimesh
from matplotlib.figure import Figure
from PIL import Image
from scipy.ndimage import gaussian_filter
from torch import nn

import evslip
from evslip.events.overlay import overlay
from evslip.generation.sensor import camera_for
from evslip.learn import Detector, TrainResult, TrainSettings, train
from evslip.learn.networks.network import Geometry, Network
from evslip.windows.cutting import windows_of
from evslip.windows.mixture import Mixture
from evslip.windows.settings import WindowSettings
from evslip.windows.window_events import WindowEvents
from evslip.windows.window_set import Windows

COMMON = """
preset = "demo"
seed = 7
[camera]
width = 320
height = 240
mount = "custom"  # in the hand's frame: y along the closing axis, z where the fingers point
x_m = 0.06
y_m = 0.25
z_m = 0.06
pitch_deg = 4.0
fov_deg = 55.0
[sensor]
theta = 0.5  # half of the usual events
shot_rate_hz = 0.0
leak_rate_hz = 0.0
[robot]
kind = "cartesian"
[render]
max_motion_px = 4.0  # coarse, and quick
[motion]
kind = ["shake", "rotate", "hold"]
duration_s = 5.0
cycles = 1
hold_s = 1.0
[slip]
kind = ["hold", "rotation"]  # masses follow from when the object would begin to slip
"""
TINS = """
[object]
shape = "mesh"
mesh = "{mesh}"
mesh_fit = "height"  # scaled evenly to height_m
height_m = {{ min = 0.09, max = 0.11 }}
texture = "{photo}"
"""
SAMPLES = 6
"""Of each set."""


def make_mesh(path: Path) -> None:
    """A square tin with round edges, watertight, z up; of any size, since `mesh_fit` scales it."""
    outline = np.array([(0, 0), (0.028, 0), (0.03, 0.003), (0.03, 0.1), (0.028, 0.103), (0, 0.103)])
    tin = trimesh.creation.revolve(outline, sections=48)
    # From a circle towards a square: flat sides for the pads.
    around = np.abs(tin.vertices[:, :2])
    stretch = np.linalg.norm(around, axis=1) / np.maximum(around.max(axis=1), 1e-9)
    tin.vertices[:, :2] *= np.minimum(stretch, 1.2)[:, None]
    tin.export(path)


def make_photo(path: Path) -> None:
    """A label such as a phone would take it: bands, blobs, grain and a shade from left to right."""
    rng = np.random.default_rng(0)
    rows, columns = np.mgrid[:512, :512] / 512
    blobs = gaussian_filter(rng.normal(size=(512, 512, 3)), (14, 14, 0))
    picture = 0.55 + 2.5 * blobs + 0.03 * rng.normal(size=(512, 512, 1))
    bands = (np.sin(40 * rows + 4 * np.sin(9 * columns)) > 0.75)[..., None]
    picture = np.where(bands, [0.75, 0.12, 0.1], picture) * (0.7 + 0.3 * columns[..., None])
    Image.fromarray((255 * picture.clip(0, 1)).astype(np.uint8)).save(path)


def write_configs(folder: Path) -> dict[str, Path]:
    """A mesh, a photo, and the configurations of two sets: tins of both, and the boxes of the preset."""
    folder.mkdir(parents=True, exist_ok=True)
    mesh, photo = (folder / "tin.stl").resolve(), (folder / "label.png").resolve()
    make_mesh(mesh)
    make_photo(photo)
    texts = {"tins": COMMON + TINS.format(mesh=mesh, photo=photo), "boxes": COMMON}
    for name, text in texts.items():
        (folder / f"{name}.toml").write_text(text)
    return {name: folder / f"{name}.toml" for name in texts}


def mixed_windows(configs: dict[str, Path], folder: Path) -> Windows:
    """Samples of both sets, and windows of the whole sensor in one file."""
    for name, config in configs.items():
        evslip.generate(config, folder / name, count=SAMPLES)
    sets = [evslip.open_dataset(folder / name).split("train") for name in configs]
    windows = windows_of(Mixture(sets), WindowSettings(hop_s=0.04), whole_sensor=True)
    windows.save(folder / "windows.h5")
    return evslip.open_windows(folder / "windows.h5")


class OwnNetwork(Network):
    """Counts of events in 8 x 8 pixels and four parts of the window's time; two convolutions, and a linear layer."""

    recommended: ClassVar = {"lr": 3e-3, "epochs": 12}
    BINS, CELL = 4, 8

    def __init__(self, geometry: Geometry | None = None):
        super().__init__(geometry)
        self.rows, self.columns = -(-self.geometry.height // self.CELL), -(-self.geometry.width // self.CELL)
        self.layers = nn.Sequential(
            *(nn.Conv2d(2 * self.BINS, 16, 3, 2, 1), nn.BatchNorm2d(16), nn.ReLU()),
            *(nn.Conv2d(16, 16, 3, 2, 1), nn.BatchNorm2d(16), nn.ReLU()),
            *(nn.Flatten(), nn.Dropout(0.3), nn.Linear(16 * -(-self.rows // 4) * -(-self.columns // 4), 2)),
        )

    def prepare(self, events: WindowEvents) -> np.ndarray:
        """log(1 + number) of the events of each polarity, part of the time and cell."""
        part = np.minimum(events.t_us.astype(np.int64) * self.BINS // self.geometry.length_us, self.BINS - 1)
        place = (part * 2 + events.p) * self.rows * self.columns
        place += events.y // self.CELL * self.columns + events.x // self.CELL
        number = np.bincount(place, minlength=2 * self.BINS * self.rows * self.columns)
        return np.log1p(number, dtype=np.float32).reshape(2 * self.BINS, self.rows, self.columns)

    def forward(self, batch: Sequence[np.ndarray]) -> torch.Tensor:
        """Logits of a batch, hold and slip."""
        return self.layers(torch.from_numpy(np.stack(batch)).to(self.device))


def train_own(windows: Windows, out: Path) -> TrainResult:
    """A detector with the network above. It is named as Python finds it, here as later wherever the model is opened."""
    sys.path.insert(0, str(Path(__file__).parent))
    settings = TrainSettings(model="own_everything:OwnNetwork", **OwnNetwork.recommended, flip=False)
    return train(windows, out, settings, quiet=True)


class Answer(NamedTuple):
    """An answer of the live loop."""

    t_s: float
    p_slip: float


def live(params: evslip.Params, detector: Detector) -> tuple[evslip.Truth, Iterator[Answer]]:
    """The truth of a new sample, and the answers while its camera looks: frames, events, probability, one by one."""
    trajectory = evslip.simulate(params)
    camera = camera_for(params)  # or EventCamera("davis346", size=(320, 240)), or the driver of a real one

    def answers() -> Iterator[Answer]:
        for frame in evslip.render(trajectory):
            events = camera.step(frame.t_us, frame.luminance, frame.bodies)
            yield Answer(frame.t_us / 1e6, detector.push(events, until_us=int(frame.t_us)))

    return evslip.measure(trajectory), answers()


def scene_picture(configs: dict[str, Path]) -> Figure:
    """A frame of each set as its object slips, beside it the events of 80 ms: ON red, OFF blue."""
    figure = Figure(figsize=(11, 2.6), layout="constrained")
    for axis, (name, config) in zip(figure.subplots(1, 2), configs.items(), strict=True):
        params = evslip.draw(evslip.load_config(config), 2)
        trajectory = evslip.simulate(params)
        slip_us = evslip.measure(trajectory).onset_us or 0
        frames = list(evslip.render(trajectory, times_us=slip_us + 100_000 + 4000 * np.arange(21)))
        events = camera_for(params).run(frames)
        light = np.clip(frames[-1].luminance, 0, 1) ** (1 / 2.2)
        picture = np.repeat((255 * light).astype(np.uint8)[..., None], 3, axis=-1)
        axis.imshow(np.hstack([picture, overlay(picture, events)]))
        axis.set(title=f"{name}: {params.motion.kind}, {len(events):,} events in 80 ms", xticks=[], yticks=[])
    return figure


def live_picture(truth: evslip.Truth, answers: Sequence[Answer], threshold: float) -> Figure:
    """Probability of slip above how far the object has turned."""
    figure = Figure(figsize=(10, 4.5), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True)
    above.plot([a.t_s for a in answers], [a.p_slip for a in answers], lw=0.9, color="#c44e00")
    above.axhline(threshold, color="0.5", lw=0.8, ls="--")
    above.set(ylabel="slip probability", ylim=(-0.03, 1.03))
    held = np.flatnonzero(truth.held)
    below.plot(truth.t_us[held] / 1e6, truth.theta_deg[held], color="#1f77b4")
    below.set(ylabel="angle to the hand (°)", xlabel="time (s)")
    if truth.onset_us is not None:
        for axis in (above, below):
            axis.axvline(truth.onset_us / 1e6, color="k", lw=0.8, ls=":")
        above.text(truth.onset_us / 1e6, 1.06, "slip begins", ha="center", size=9)
    return figure


def main(out: Path) -> None:
    configs = write_configs(out)
    scene_picture(configs).savefig(out / "scene.png", dpi=110)
    windows = mixed_windows(configs, out)
    print(windows.summary())
    result = train_own(windows, out / "model")
    print(result.summary())
    detector = Detector(out / "model", hop_s=0.01)
    config = evslip.load_config(configs["tins"])
    new = (evslip.draw(config, index) for index in range(SAMPLES, 60))
    params = next(one for one in new if one.slip.kind == "rotation")
    truth, stream = live(params, detector)
    answers = list(stream)
    live_picture(truth, answers, result.threshold).savefig(out / "live.png", dpi=110)
    assert truth.onset_us is not None
    alarm = next((a.t_s for a in answers if a.t_s * 1e6 > truth.onset_us and a.p_slip >= result.threshold), None)
    said = "no alarm" if alarm is None else f"an alarm {1e3 * alarm - truth.onset_us / 1e3:.0f} ms later"
    print(f"a motion of kind {params.motion.kind}: slip begins at {truth.onset_us / 1e6:.3f} s, {said}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path, nargs="?", default=Path("own_everything"))
    main(parser.parse_args().out)
