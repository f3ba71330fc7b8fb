"""The whole scene from outside, as the physics has it: robot, object, surface, camera, lamp and the way of the hand.

python examples/whole_scene.py docs/figures/scenes/whole.jpg [--shape cylinder] [--time 3.4]
"""

import argparse
from typing import Any, NamedTuple

import mujoco
import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

import evslip
from evslip.physics import scene_model
from evslip.physics.motion.servo_plan import tool_path
from evslip.physics.robots.arms import PANDA
from evslip.physics.robots.grippers import PANDA_HAND
from evslip.rendering.camera import hand_camera
from evslip.rendering.geometry.hand import part_mesh
from evslip.rendering.geometry.links import link_mesh
from evslip.rendering.poses import matrices
from evslip.rendering.raycast.setting import make_lamp
from evslip.scene.shapes import surface_of
from evslip.scene.textures import library
from evslip.scene.textures.library import linear_to_srgb

EYE, LOOK_AT, ZOOM = np.array([1.45, -1.3, 0.95]), np.array([0.3, -0.08, 0.32]), 1450.0
SIZE = (1000, 800)
TABLE_M, TILES = ((-0.25, 0.85), (-0.6, 0.5)), 44


class Triangles(NamedTuple):
    corners: np.ndarray
    """In the world, of shape (n, 3, 3)."""
    albedo: np.ndarray
    """Linear RGB, of shape (n, 3)."""


def project(points: np.ndarray) -> np.ndarray:
    """Image positions, and distance along the view, of world points (..., 3)."""
    forward = (LOOK_AT - EYE) / np.linalg.norm(LOOK_AT - EYE)
    right = np.cross(forward, [0, 0, 1])
    right /= np.linalg.norm(right)
    seen = (points - EYE) @ np.stack([right, np.cross(right, forward), forward], axis=1)
    scale = ZOOM / seen[..., 2]
    x, y = SIZE[0] / 2 + scale * seen[..., 0], SIZE[1] / 2 + scale * seen[..., 1]
    return np.stack([x, y, seen[..., 2]], axis=-1)


def robot_and_object(trajectory: Any, index: int) -> list[Triangles]:
    params = trajectory.params
    model = scene_model.build(params)
    data = mujoco.MjData(model)
    data.qpos[:9] = trajectory.joints[index]
    mujoco.mj_kinematics(model, data)
    parts = []
    meshes = {f"panda_link{k}": link_mesh(PANDA, k) for k in range(8)}
    meshes |= {PANDA_HAND.hand: part_mesh(PANDA_HAND.palm)}
    meshes |= dict.fromkeys(PANDA_HAND.fingers, part_mesh(PANDA_HAND.finger))
    for body, mesh in meshes.items():
        turn = data.body(body).xmat.reshape(3, 3)
        if body == "panda_rightfinger":
            turn = turn @ np.diag([-1.0, -1.0, 1.0])
        parts.append(Triangles(mesh.corners @ turn.T + data.body(body).xpos, mesh.albedo))
    surface, pose = surface_of(params), trajectory.object_pose[index]
    corners, colours = finer(surface.vertices[surface.faces], surface.uv, params.object.texture)
    parts.append(Triangles(corners @ matrices(pose[3:]).T + pose[:3], colours))
    return parts


def finer(corners: np.ndarray, uv: np.ndarray, texture: str) -> tuple[np.ndarray, np.ndarray]:
    """Triangles cut in four again and again, each with the colour of its middle."""
    both = np.concatenate([corners, uv], axis=2)
    for _ in range(5 if len(both) < 100 else 3):
        a, b, c = both.transpose(1, 0, 2)
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        both = np.concatenate([np.stack(t, axis=1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    image = library.load(texture)
    middle = both[..., 3:].mean(axis=1) % 1 * image.shape[0]
    return both[..., :3], image[middle[:, 1].astype(int), middle[:, 0].astype(int)]


def lit(part: Triangles, lamp: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Image corners, colours and distances of the triangles that face the eye."""
    a, b, c = part.corners.transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    faces = np.sum(normal * (EYE - a), axis=1) > 0
    light = 0.45 + 0.75 * np.maximum(0, normal @ (lamp / np.linalg.norm(lamp)))
    image = project(part.corners[faces])
    return image[..., :2], linear_to_srgb(part.albedo * light[:, None])[faces], image[..., 2].mean(axis=1)


def table(texture: str, tile_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Image corners and colours of small squares of the surface."""
    sides = [np.linspace(*ends, TILES * 4 + 1) for ends in TABLE_M]
    x, y = (grid.ravel() for grid in np.meshgrid(sides[0][:-1], sides[1][:-1]))
    dx, dy = (side[1] - side[0] for side in sides)
    corners = [np.stack([x + i * dx, y + j * dy, 0 * x], axis=1) for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))]
    image = library.load(texture)
    column, row = ((side / tile_m % 1 * image.shape[0]).astype(int) for side in (x, -y))
    return project(np.stack(corners, axis=1))[..., :2], linear_to_srgb(0.9 * image[row, column])


def main(out: str, shape: str, t_s: float) -> None:
    changes = {"object.shape": shape, "object.texture": "cardboard-4", "object.width_m": 0.05, "grip.offset": 0.0}
    changes |= {"object.mass_kg": 0.012, "surface.texture": "wood-0", "together": []}
    params = evslip.draw(evslip.load_config("simple", changes), 0)
    trajectory = evslip.simulate(params)
    index = int(np.searchsorted(trajectory.t_us, 1e6 * t_s))
    lamp = make_lamp(params).position
    figure = Figure(figsize=(SIZE[0] / 100, SIZE[1] / 100))
    axis = figure.add_axes((0, 0, 1, 1))
    squares, colours = table(params.surface.texture, params.surface.tile_m)
    axis.add_collection(PolyCollection(list(squares), facecolors=colours, edgecolors=colours, linewidths=0.3))
    drawn = [lit(part, lamp) for part in robot_and_object(trajectory, index)]
    corners, colours, distance = (np.concatenate(column) for column in zip(*drawn, strict=True))
    order = distance.argsort()[::-1]
    axis.add_collection(
        PolyCollection(list(corners[order]), facecolors=colours[order], edgecolors=colours[order], linewidths=0.2)
    )
    annotate(axis, trajectory, index, lamp)
    axis.set(xlim=(0, SIZE[0]), ylim=(0, SIZE[1]))
    axis.set_axis_off()
    figure.savefig(out, dpi=100, pil_kwargs={"quality": 85})


def annotate(axis: Any, trajectory: Any, index: int, lamp: np.ndarray) -> None:
    """Camera, field of view, way of the hand, lamp, axes of the world."""
    params, hand = trajectory.params, trajectory.gripper_pose[index]
    camera = hand_camera(params)
    turn = matrices(hand[3:])
    place, axes = hand[:3] + turn @ camera.position, turn @ camera.rotation
    half = np.array([camera.width, camera.height]) / 2 / camera.focal_px
    rim = [place + 0.32 * axes @ [i * half[0], j * half[1], -1] for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    for corner, following in zip(rim, [*rim[1:], rim[0]], strict=True):
        for line in ((place, corner), (corner, following)):
            axis.plot(*project(np.array(line))[:, :2].T, color="tab:blue", lw=1)
    label(axis, place, "event camera,\nfixed to the hand\n(camera.mount)", "tab:blue", (-330, -10))
    path, _ = tool_path(params, trajectory.t_us[::20] / 1e6)
    axis.plot(*project(path)[:, :2].T, color="tab:red", lw=1.2, ls="--")
    label(axis, path[0], "object.x_m, object.y_m", "tab:red", (60, -100))
    label(axis, path[-1], "goal (motion.move_x_m, motion.move_y_m)", "tab:red", (-280, -110))
    origin = np.zeros(3)
    for name, end in zip("xyz", 0.15 * np.eye(3), strict=True):
        axis.plot(*project(np.array([origin, end]))[:, :2].T, color="k", lw=1.5)
        axis.text(*project(1.25 * end)[:2], name, ha="center", va="center")
    start = np.array([0.45, 0.42, 0.0])
    towards = start + 0.22 * lamp / np.linalg.norm(lamp)
    axis.annotate(
        "", project(towards)[:2], project(start)[:2], arrowprops={"arrowstyle": "->", "color": "tab:orange", "lw": 2}
    )
    axis.text(*project(towards)[:2], "to the light sphere", color="tab:orange", ha="center")


def label(axis: Any, point: np.ndarray, text: str, colour: str, offset: tuple[int, int]) -> None:
    x, y, _ = project(point)
    arrow = {"arrowstyle": "-", "color": colour, "lw": 0.7}
    box = {"facecolor": "white", "edgecolor": "none", "pad": 2}
    axis.annotate(text, (x, y), (x + offset[0], y + offset[1]), color=colour, arrowprops=arrow, bbox=box)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out")
    parser.add_argument("--shape", default="cuboid", choices=("cuboid", "cylinder"))
    parser.add_argument("--time", type=float, default=3.4)
    options = parser.parse_args()
    main(options.out, options.shape, options.time)
