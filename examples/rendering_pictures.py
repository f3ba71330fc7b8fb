"""Figures of docs/explanation/rendering.md and renderer-model.md: python examples/rendering_pictures.py [FOLDER]

Every shape on the table under a small and a large lamp, then held and turned, each with an enlarged piece; and what
the lens does, with what a frame holds besides light.
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np
import trimesh
from PIL import Image

from evslip.config.loading import load_config
from evslip.config.params import Params
from evslip.draws.draw import draw
from evslip.physics.trajectory import Trajectory
from evslip.rendering.camera import hand_camera
from evslip.rendering.outputs import OUTPUTS, Outputs
from evslip.rendering.poses import ScenePoses
from evslip.rendering.raycast.renderer import Raycaster
from evslip.scene.textures.library import linear_to_srgb

SMALL_LAMP, LARGE_LAMP = 0.3, 3.0
ZOOM = 4
PIECE = (80, 65)
"""Width and height in pixels of the piece that is enlarged."""

LENSES = {
    "distortion": {"camera.k1": -0.4},
    "vignetting": {"camera.vignetting": 2.0},
    "defocus": {"camera.defocus_px": 2.0},
}
FASTEST_PX_S = 100.0
"""Speed that is drawn in full colour."""


def pose(params: Params, held: bool) -> Trajectory:
    """One instant: the object under the hand on the table, or lifted, with the object turned in the grip."""
    height, lift = params.object.height_m, 0.12 if held else 0.0
    hand = np.array([[0.45, 0.0, height + 0.1034 - 0.01 + lift, 0.0, 1.0, 0.0, 0.0]])
    half = np.radians(12.0 if held else 0.0)
    body = np.array([[0.45, 0.0, height / 2 + lift, np.cos(half), 0.0, np.sin(half), 0.0]])
    joints = np.zeros((1, 9))
    joints[:, 7:] = params.object.depth_m / 2
    hand, body, joints = (np.repeat(array, 2, axis=0) for array in (hand, body, joints))
    return Trajectory(params, np.array([0, 1000]), hand, body, joints, np.ones((2, 2)), np.zeros(2))


def picture(params: Params, traj: Trajectory) -> np.ndarray:
    """sRGB uint8 of shape (height, width, 3), with the median at a quarter of white."""
    camera = hand_camera(params)
    poses = ScenePoses(traj, camera, traj.t_us[:1])
    travel = float(poses.travel_m[0])
    linear = np.stack([Raycaster(params, camera, travel, channel).draw(poses, 0)[0] for channel in range(3)], -1)
    return np.round(linear_to_srgb(linear * (0.25 / np.median(linear))) * 255).astype(np.uint8)


def enlarged(image: np.ndarray, traj: Trajectory, params: Params) -> np.ndarray:
    """The piece around the object's lower left corner, enlarged without smoothing."""
    camera = hand_camera(params)
    poses = ScenePoses(traj, camera, traj.t_us[:1])
    corner = np.array([params.object.width_m / 2, 0.0, -params.object.height_m / 2])
    world = poses.object_position[0] + poses.object_rotation[0] @ corner
    x, y, _ = camera.project((world - poses.camera_position[0]) @ poses.camera_rotation[0])
    left = int(np.clip(x - PIECE[0] / 2, 0, camera.width - PIECE[0]))
    top = int(np.clip(y - PIECE[1] / 2, 0, camera.height - PIECE[1]))
    piece = image[top : top + PIECE[1], left : left + PIECE[0]]
    return piece.repeat(ZOOM, 0).repeat(ZOOM, 1)


def moving(traj: Trajectory) -> Trajectory:
    """The hand moves sideways and up, and the object turns in the grip, over the millisecond."""
    hand, body = traj.gripper_pose.copy(), traj.object_pose.copy()
    for poses in (hand, body):
        poses[1, :3] += (-0.00005, 0.0, 0.00005)
    half = np.arctan2(body[1, 5], body[1, 3]) + 0.0007
    body[1, 3:] = np.cos(half), 0.0, np.sin(half), 0.0
    return traj._replace(gripper_pose=hand, object_pose=body)


def coloured(outputs: dict[str, np.ndarray]) -> list[np.ndarray]:
    """Pictures of depth (nearer is brighter), normal (right, up, backward as red, green, blue), and motion: its
    direction as hue, red to the right and green-blue to the left, its speed as colour on white."""
    depth = np.clip(0.15 / outputs["depth"], 0, 1)[..., None].repeat(3, 2)
    x, y = np.moveaxis(outputs["motion"], -1, 0)
    angle, speed = np.arctan2(y, x), np.clip(np.hypot(x, y) / FASTEST_PX_S, 0, 1)
    hue = 0.5 + 0.5 * np.cos(angle[..., None] - np.radians([0, 120, 240]))
    motion = 1 - speed[..., None] * (1 - hue)
    return [np.round(image * 255).astype(np.uint8) for image in (depth, outputs["normal"] / 2 + 0.5, motion)]


def lens_figure() -> np.ndarray:
    """Above: the same instant through four lenses. Below: the first one's bodies, depth, normals and motion."""
    scene = {"background.texture": "room-0", "object.texture": "cardboard-0", "surface.texture": "tile-0"}
    above = []
    for lens in ({}, *LENSES.values()):
        params = draw(load_config("simple", {**scene, **lens}), 0)
        above.append(picture(params, pose(params, held=True)))
    params = draw(load_config("simple", scene), 0)
    traj, camera = moving(pose(params, held=True)), hand_camera(params)
    _, bodies = Raycaster(params, camera, float(traj.joints[0, 7])).draw(ScenePoses(traj, camera, traj.t_us[:1]), 0)
    shades = np.array([[40, 40, 40], [110, 90, 60], [220, 60, 50], [70, 120, 210]], np.uint8)
    below = [shades[bodies], *coloured(Outputs(traj, camera, OUTPUTS).at(500))]
    return np.concatenate([np.concatenate(above, 1), np.concatenate(below, 1)])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, nargs="?", default=Path("docs/figures"))
    folder = parser.parse_args().folder
    with tempfile.TemporaryDirectory() as scratch:
        ring = trimesh.creation.torus(0.027, 0.011, major_sections=64, minor_sections=32)
        ring.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0]))
        ring.vertices[:, 2] = np.maximum(ring.vertices[:, 2], -0.034)  # a flat base, so that it stands
        ring.export(Path(scratch) / "ring.stl")
        shapes = {
            "cuboid": {},
            "cylinder": {"object.shape": "cylinder"},
            "ring": {"object.shape": "mesh", "object.mesh": str(Path(scratch) / "ring.stl"), "object.mesh_fit": "own"},
        }
        rows = []
        for shape in shapes.values():
            for radius, held in ((SMALL_LAMP, False), (LARGE_LAMP, False), (SMALL_LAMP, True)):
                light = {
                    "light.radius_m": radius,
                    "light.luminance_cd_m2": 4.5e6 / radius**2,
                    "light.azimuth_deg": 60.0,
                }
                scene = {"background.luminance_cd_m2": 1500.0, "object.texture": "cardboard-0", **light, **shape}
                params = draw(load_config("simple", scene), 0)
                traj = pose(params, held)
                image = picture(params, traj)
                rows.append(np.concatenate([image, enlarged(image, traj, params)], 1))
    strip = [np.concatenate(rows[k : k + 3], 1) for k in range(0, len(rows), 3)]
    path = folder / "rendering_shapes.jpg"
    Image.fromarray(np.concatenate(strip)).save(path, quality=88)
    print(path)
    path = folder / "rendering_lens.png"
    Image.fromarray(lens_figure()).save(path, optimize=True)
    print(path)


if __name__ == "__main__":
    main()
