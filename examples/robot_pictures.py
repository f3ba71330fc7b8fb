"""Picture of docs/explanation/robots.md, robots in both renderers: python examples/robot_pictures.py [FOLDER] [SPP]

A robot a row: the camera on its hand by the fast renderer and by the path tracer, and the whole scene. Needs the extra
[photo].
"""

import argparse
from pathlib import Path

import numpy as np
from PIL import Image

from evslip.config.loading import load_config
from evslip.draws.draw import draw
from evslip.physics.motion.phases import phase_times
from evslip.physics.simulation import simulate
from evslip.rendering import pictures

SIZE, QUALITY = (240, 180), 85
SCENE = {
    "object.texture": "cardboard-0",
    "surface.texture": "wood-0",
    "background.texture": "room-0",
    "object.x_m": 0.45,
    "object.y_m": 0.0,
    "object.mass_kg": 0.03,
    "grip.friction": 0.6,
    "motion.move_y_m": -0.15,
    "render.key_motion_px": 0.0,
}
OWN = str(Path(__file__).parent / "own_robot" / "robot.toml")
ROBOTS = (
    {"robot.kind": "ur5", "robot.gripper": "small"},
    {"robot.kind": "xarm7", "robot.gripper": "large"},
    {"robot.kind": OWN, "camera.mount": "robot"},
)
VIEWS = (("wrist", "raycast"), ("wrist", "pathtrace"), ("scene", "pathtrace"))


def row(robot: dict[str, str], spp: int) -> np.ndarray:
    traj = simulate(draw(load_config("simple", {**SCENE, "render.spp": spp, **robot}), 0))
    lifted = np.array([phase_times(traj.params)["lift"][1]])
    return np.concatenate([next(pictures(traj, lifted, size=SIZE, view=v, renderer=r)) for v, r in VIEWS], 1)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, nargs="?", default=Path("docs/figures"))
    parser.add_argument("spp", type=int, nargs="?", default=16, help="paths a pixel (default: 16)")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    sheet = np.concatenate([row(robot, options.spp) for robot in ROBOTS], 0)
    Image.fromarray(sheet).save(options.folder / "robots.jpg", quality=QUALITY)


if __name__ == "__main__":
    main()
