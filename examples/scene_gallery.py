"""The pictures of docs/reference/scenes.md: what every option of a scene does to it.

python examples/scene_gallery.py docs/figures/scenes [--only shape light ...]
"""

import argparse
import tempfile
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import trimesh
from matplotlib.figure import Figure

import evslip
from evslip.physics.vibration.displacement import seen_from
from evslip.rendering import render_color

CUP = "cup.stl"
"""Stands for the path of the mesh that this script makes."""
LIFTED_S, TILTED_S, SLIPPING_S = 1.85, 3.4, 1.3
COMMON = {
    "object.width_m": 0.05,
    "object.height_m": 0.09,
    "object.mass_kg": 0.012,
    "object.texture": "cardboard-4",
    "grip.offset": 0.0,
    "grip.depth_m": 0.012,
    "surface.texture": "wood-0",
    "background.texture": "room-0",
    "background.luminance_cd_m2": 3000.0,
    "light.azimuth_deg": 240.0,
    "together": [],
}


TWO = {
    "camera.left.mount": "finger",
    "camera.right.mount": "front",
    "object.mass_kg": 0.05,
    "object.com_x_m": 0.01,
}
CAN = {
    "object__shape": "cylinder",
    "object__texture": "paper-2",
    "light__polar_deg": 84.0,
    "light__azimuth_deg": 300.0,
}
"""Shows the lamp's highlights; keys with "__" for the dot."""


class Picture(NamedTuple):
    caption: str
    changes: dict[str, Any]
    """From COMMON, which itself differs from the preset "simple"."""
    t_s: float = LIFTED_S
    camera: str = ""
    """Of two."""


def of(key: str, *values: Any, t_s: float = LIFTED_S, **others: Any) -> list[Picture]:
    """One picture for every value of a key; `others` are keys with "__" for the dot, the same in all."""
    same = {name.replace("__", "."): value for name, value in others.items()}
    return [Picture(f"{key.partition('.')[2]} = {value}", {key: value, **same}, t_s) for value in values]


def mesh(caption: str, **values: Any) -> Picture:
    changes = {name.replace("__", "."): value for name, value in values.items()}
    return Picture(caption, {"object.shape": "mesh", "object.mesh": CUP, "object.texture": "tile-4", **changes})


STRIPS: dict[str, list[Picture]] = {
    "shape": [
        *of("object.shape", "cuboid"),
        *of("object.shape", "cylinder", object__texture="paper-2"),
        mesh('shape = "mesh": a cup', object__width_m=0.05, grip__depth_m=0.02),
    ],
    "mesh_fit": [
        mesh("stretch: 0.03 x 0.06 x 0.09 m", object__width_m=0.03, object__depth_m=0.06, grip__depth_m=0.02),
        mesh("height: evenly, to 0.06 m", object__mesh_fit="height", object__height_m=0.06, grip__depth_m=0.02),
        mesh("own: the file's metres", object__mesh_fit="own", grip__depth_m=0.02),
    ],
    "width": of("object.width_m", 0.03, 0.05, 0.07),
    "height": of("object.height_m", 0.06, 0.09, 0.11),
    "depth": of("object.depth_m", 0.03, 0.05, 0.07, camera__mount="front"),
    "mass": of("object.mass_kg", 0.01, 0.045, 0.06, t_s=TILTED_S),
    "density": of("object.density_kg_m3", 50.0, 200.0, 270.0, t_s=TILTED_S),
    "centre_of_mass": of("object.com_x_m", -0.02, 0.0, 0.02, t_s=2.3, object__mass_kg=0.045),
    "centre_of_mass_height": of("object.com_z_m", -0.03, 0.0, 0.03, t_s=TILTED_S, object__mass_kg=0.035),
    "texture": of("object.texture", "wood-3", "brick-2", "plastic-1", "metal-3"),
    "finish": of("object.finish", "texture", "matt", "plastic", "film", "metal", **CAN),
    "offset": of("grip.offset", -0.8, 0.0, 0.8),
    "grip_depth": of("grip.depth_m", -0.0045, 0.012, 0.03),
    "force": of("grip.force_n", 1.0, 1.2, 3.0, t_s=TILTED_S, object__mass_kg=0.05),
    "friction": of("grip.friction", 0.5, 0.6, 1.0, t_s=TILTED_S, object__mass_kg=0.05),
    "error_x": of("grip.error_x_m", -0.01, 0.0, 0.01),
    "error_y": [
        *of("grip.error_y_m", -0.004, 0.004, t_s=0.5, camera__mount="front"),
        Picture("0.004, once the fingers have closed", {"grip.error_y_m": 0.004, "camera.mount": "front"}, 0.94),
    ],
    "error_yaw": [
        *of("grip.error_yaw_deg", 12.0, t_s=0.5),
        Picture("closed, friction = 0.5", {"grip.error_yaw_deg": 12.0}, 0.94),
        Picture("closed, friction = 0.2", {"grip.error_yaw_deg": 12.0, "grip.friction": 0.2}, 0.94),
    ],
    "surface": of("surface.texture", "stone-3", "weave-2", "tile-0"),
    "tile": of("surface.tile_m", 0.1, 0.5, 1.5, surface__texture="tile-0"),
    "background": of("background.texture", "room-1", "outdoors-0", "noise-1"),
    "background_luminance": of("background.luminance_cd_m2", 150.0, 3000.0, 15000.0),
    "background_tile": of("background.tile_deg", 20.0, 45.0, 120.0, background__texture="brick-1"),
    "light_azimuth": of("light.azimuth_deg", 60.0, 150.0, 240.0, 330.0, t_s=1.1),
    "light_polar": of("light.polar_deg", 5.0, 40.0, 80.0, t_s=1.1),
    "light_luminance": of("light.luminance_cd_m2", 0.0, 1e6, 5.5e6, t_s=1.1),
    "light_radius": of("light.radius_m", 0.2, 1.0, 5.0, t_s=1.1),
    "light_distance": of("light.distance_m", 20.0, 30.0, 40.0, t_s=1.1),
    "mount": [
        *of("camera.mount", "side", "front", "finger"),
        Picture(
            "custom, at (0.18, 0.2, 0.04)",
            {"camera.mount": "custom", "camera.x_m": 0.18, "camera.y_m": 0.2, "camera.z_m": 0.04},
        ),
    ],
    "two_cameras": [
        Picture("camera.left: mount = finger", TWO, SLIPPING_S, "left"),
        Picture("camera.right: mount = front", TWO, SLIPPING_S, "right"),
    ],
    "shift": [*of("camera.x_m", 0.02), *of("camera.y_m", 0.04), *of("camera.z_m", -0.02)],
    "turn": [*of("camera.yaw_deg", 5.0), *of("camera.pitch_deg", 5.0), *of("camera.roll_deg", 8.0)],
    "field_of_view": of("camera.fov_deg", 30.0, 47.0, 70.0),
    "spots": [
        *of("lens.spots", 12.0, lens__spot_opacity=0.6, lens__spot_px=8.0),
        *of("lens.spot_px", 25.0, lens__spot_opacity=0.6, lens__spots=4.0),
        *of("lens.glare", 0.0, 0.3),
    ],
    "clutter": [
        *of("clutter.count", 1, 5, t_s=1.2, clutter__texture="brick-2"),
        *of("clutter.shape", "object", t_s=1.2, clutter__count=4, object__shape="cylinder"),
        *of("clutter.size_m", 0.12, t_s=1.2, clutter__count=5, clutter__texture="brick-4"),
    ],
    "passers": [
        *of("passers.count", 3),
        *of(
            "passers.distance_m",
            1.2,
            passers__count=5,
            passers__height_m=0.4,
            passers__width_m=0.2,
            passers__speed_m_s=0.2,
        ),
        *of("passers.crosses", "light", t_s=1.1, passers__count=5, passers__width_m=0.2, passers__speed_m_s=0.1),
    ],
    "exposure": [
        *of("camera.exposure", "sample", background__luminance_cd_m2=500.0),
        *of("camera.exposure", "absolute", background__luminance_cd_m2=500.0),
        *of("camera.white_cd_m2", 1500.0, background__luminance_cd_m2=500.0, camera__exposure="absolute"),
    ],
    "lift": of("motion.lift_m", 0.05, 0.15, 0.3),
    "tilt": of("motion.tilt_deg", -25.0, 0.0, 25.0, t_s=TILTED_S),
}


FLICKERS: dict[str, dict[str, Any]] = {
    "still": {},
    "sine, lamp and surroundings 0.3": {"flicker.lamp_depth": 0.3, "flicker.surroundings_depth": 0.3},
    "sine, lamp 0.3": {"flicker.lamp_depth": 0.3},
    "pwm, lamp 0.3": {"flicker.lamp_depth": 0.3, "flicker.waveform": "pwm", "flicker.duty": 0.3},
}
SHOWN_MS = 40
"""Length of what the plot of the flicker shows, from LIFTED_S on."""


def make_cup(path: Path) -> None:
    """A cup, open at the top: a body of revolution, 80 mm high."""
    profile = [[0, 0], [0.019, 0], [0.022, 0.003], [0.025, 0.08], [0.0225, 0.08], [0.02, 0.006], [0, 0.006]]
    trimesh.creation.revolve(np.array(profile), sections=96).export(path)


def draw(picture: Picture, folder: Path) -> np.ndarray:
    changes = {**COMMON, **picture.changes}
    if "object.mesh" in changes:
        changes["object.mesh"] = str(folder / CUP)
    trajectory = evslip.simulate(evslip.draw(evslip.load_config("simple", changes), 0))
    if picture.camera:
        trajectory = seen_from(trajectory, picture.camera)
    return render_color(trajectory, round(1e6 * picture.t_s))


def plot_flicker(path: Path) -> None:
    """Light of a picture's mean and of its darkest tenth over time, and the events that it makes, for FLICKERS."""
    figure = Figure(figsize=(3.1 * len(FLICKERS), 4.2), layout="constrained")
    axes = figure.subplots(2, len(FLICKERS), sharex=True, sharey="row")
    for (light, rate), (caption, changes) in zip(axes.T, FLICKERS.items(), strict=True):
        trajectory = evslip.simulate(evslip.draw(evslip.load_config("simple", COMMON | changes), 0))
        start_us = round(1e6 * LIFTED_S)
        # Pixels get used to the light in the time before.
        span = {"start_us": start_us - 100_000, "end_us": start_us + 1000 * SHOWN_MS}
        frames = list(evslip.render(trajectory, **span, size=(173, 130)))
        images = np.stack([frame.luminance for frame in frames])
        dark = images.mean(0) <= np.quantile(images.mean(0), 0.1)
        t_ms = 1e-3 * (np.array([frame.t_us for frame in frames]) - start_us)
        for part, label in ((np.ones_like(dark), "all pixels"), (dark, "darkest tenth")):
            line = images[:, part].mean(1)
            light.plot(t_ms, line / line.mean(), label=label)
        events = evslip.EventCamera("davis346-bright", size=(173, 130)).run(frames)
        for is_on, label in ((True, "ON"), (False, "OFF")):
            own = 1e-3 * (events.t_us[events.p == is_on] - start_us)
            counts = np.histogram(own, np.arange(SHOWN_MS + 1))[0]
            rate.step(np.arange(SHOWN_MS), counts / dark.size, where="post", label=label)
        light.set(title=caption, xlim=(0, SHOWN_MS))
        rate.set(xlabel="ms")
    axes[0, 0].set_ylabel("light / mean")
    axes[1, 0].set_ylabel("events a pixel and ms")
    for axis in axes[:, -1]:
        axis.legend(fontsize=8)
    figure.savefig(path, dpi=110)


def main(out: Path, only: list[str]) -> None:
    out.mkdir(parents=True, exist_ok=True)
    if not only or "flicker" in only:
        plot_flicker(out / "flicker.png")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        make_cup(folder / CUP)
        for name in [name for name in STRIPS if not only or name in only]:
            strip = STRIPS[name]
            figure = Figure(figsize=(3.1 * len(strip), 2.6), layout="constrained")
            for axis, picture in zip(figure.subplots(1, len(strip), squeeze=False)[0], strip, strict=True):
                axis.imshow(draw(picture, folder))
                axis.set_title(picture.caption, size=10)
                axis.set_axis_off()
            figure.savefig(out / f"{name}.jpg", dpi=110, pil_kwargs={"quality": 85})


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--only", nargs="*", default=[], choices=[*STRIPS, "flicker"], metavar="NAME")
    options = parser.parse_args()
    main(options.out, options.only)
