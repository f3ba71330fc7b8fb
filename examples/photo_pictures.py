"""Pictures of docs/explanation/rendering.md by both renderers: python examples/photo_pictures.py [FOLDER] [SPP]

A slip in five phases, and light from bright with hard shadows to dim with none. Needs the extra [photo].
"""

import argparse
from pathlib import Path

import numpy as np
from PIL import Image

from evslip.config.loading import load_config
from evslip.draws.draw import draw
from evslip.physics.motion.phases import phase_times
from evslip.physics.simulation import simulate
from evslip.physics.trajectory import Trajectory
from evslip.rendering import pictures
from evslip.rendering.pathtrace.variant import describe

SIZE = 240, 180
QUALITY = 85
SCENE = {"object.texture": "cardboard-0", "surface.texture": "wood-0", "background.texture": "room-0"}
PHASES = ("initial", "lift", "tilt", "back", "placement")
LATE = 0.9
"""Share of each phase after which the picture is taken."""
LIGHTS = {
    "small lamp": (5000.0, 0.2, 400.0),
    "large lamp": (4000.0, 3.0, 800.0),
    "hazy": (1200.0, 8.0, 1500.0),
    "overcast": (0.0, 1.0, 1200.0),
}
"""Luminance that the lamp gives to white paper in cd/m2, its radius in metres, luminance of the background's white."""
DISTANCE_M = 30.0
VIEWS = (("wrist", "raycast"), ("wrist", "pathtrace"), ("scene", "pathtrace"))


def made(changes: dict[str, object], spp: int) -> Trajectory:
    settings = {**SCENE, "render.spp": spp, "render.key_motion_px": 0.0, **changes}
    return simulate(draw(load_config("simple", settings), 0))


def strip(traj: Trajectory, times_us: np.ndarray, view: str, renderer: str) -> np.ndarray:
    return np.concatenate(list(pictures(traj, times_us, size=SIZE, view=view, renderer=renderer)), 1)


def phases(spp: int) -> np.ndarray:
    """Five phases as columns; fast, traced, and the whole scene as rows."""
    traj = made({"slip.kind": "rotation", "slip.multiple": 1.3, "grip.offset": 0.6}, spp)
    bounds = phase_times(traj.params)
    times = np.array([round(start + LATE * (end - start)) for start, end in (bounds[name] for name in PHASES)])
    return np.concatenate([strip(traj, times, *which) for which in VIEWS])


def lights(spp: int) -> np.ndarray:
    """Four lights as columns, the exposure the same; rows as above."""
    columns = []
    for on_paper, radius, background in LIGHTS.values():
        light = {
            "light.luminance_cd_m2": on_paper * (DISTANCE_M / radius) ** 2,
            "light.radius_m": radius,
            "light.distance_m": DISTANCE_M,
            "background.luminance_cd_m2": background,
            "camera.exposure": "absolute",
            "camera.white_cd_m2": 4500.0,
        }
        traj = made({"slip.kind": "hold", **light}, spp)
        start, end = phase_times(traj.params)["lift"]
        time = np.array([round(start + 0.3 * (end - start))])
        columns.append(np.concatenate([strip(traj, time, *which) for which in VIEWS]))
    return np.concatenate(columns, 1)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, nargs="?", default=Path("docs/figures"))
    parser.add_argument("spp", type=int, nargs="?", default=96, help="paths a pixel (default: 96)")
    options = parser.parse_args()
    print(describe())
    for name, make in (("rendering_phases", phases), ("rendering_lights", lights)):
        path = options.folder / f"{name}.jpg"
        Image.fromarray(make(options.spp)).save(path, quality=QUALITY, optimize=True)
        print(path, flush=True)


if __name__ == "__main__":
    main()
