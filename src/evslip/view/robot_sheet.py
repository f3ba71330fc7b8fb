"""A robot from four sides, and in words."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from evslip.config.loading import load_config
from evslip.config.sections.robot import RobotSpec
from evslip.draws.draw import draw
from evslip.physics.robots import own
from evslip.physics.robots.catalogue import robot_of
from evslip.physics.robots.description import TCP_M, Arm, Gripper, Robot
from evslip.physics.robots.urdf import joint_limits
from evslip.rendering.camera import Camera, hand_camera
from evslip.rendering.geometry.hand import assemble
from evslip.rendering.geometry.links import link_poses, posed
from evslip.utils.atomic import write_bytes
from evslip.utils.errors import ConfigError
from evslip.view.pictures.images import figure_png

GREY, PALM, LEFT, RIGHT, PAD, SIGHT = "#b8bcc4", "#7f8794", "#d98c3f", "#4f86c6", "#c22f2f", "#3a9a5f"
SIGHT_M = 0.08
"""Length of the lines that tell what the camera sees."""
AXIS_M = 0.03
WORLD = {
    "from the side, -y": ((1, 0, 0), (0, 0, 1)),
    "from the front, +x": ((0, 1, 0), (0, 0, 1)),
    "from above": ((1, 0, 0), (0, 1, 0)),
    "from in front, above": ((0.6, 0.8, 0), (-0.4, 0.3, 0.866)),
}
HAND = {
    "along the closing axis, from +y": ((1, 0, 0), (0, 0, -1)),
    "across it, from +x": ((0, -1, 0), (0, 0, -1)),
    "from the palm": ((1, 0, 0), (0, -1, 0)),
    "from in front, below": ((0.6, 0.8, 0), (-0.4, 0.3, -0.866)),
}
"""Directions in which a robot is looked at, by name: what is right and up; of HAND in its frame, which points down."""


def write_robot_sheet(path: Path, kind: str) -> str:
    """Draw a robot, by its name or file, into a PNG; what there is to say of it. Raises ConfigError, StorageError."""
    if path.suffix.lower() != ".png":
        raise ConfigError(f"out: {str(path)!r} has no suffix of a picture, expected .png")
    spec = load_config("simple", {"robot.kind": kind}).robot
    robot = robot_of(spec)
    mount = "side" if robot.camera_m is None else "robot"
    camera = hand_camera(draw(load_config("simple", {"robot.kind": kind, "camera.mount": mount}), 0))
    write_bytes(path, figure_png(_figure(robot, camera, kind, mount), dpi=100))
    return "\n".join(_facts(robot, spec, camera, mount)) + "\n"


def _facts(robot: Robot, spec: RobotSpec, camera: Camera, mount: str) -> list[str]:
    lines = [f"robot    {spec.kind}", *_arm_facts(robot.arm), *_gripper_facts(robot.gripper)]
    x, y, z = camera.position - TCP_M
    lines.append(f"camera   mount {mount}: at ({x:.3f}, {y:.3f}, {z:.3f}) m from the tool centre, in the hand's axes")
    if robot.camera_m is None:
        lines.append("missing  [camera] place_m, for camera.mount = 'robot'; drawn is the mount 'side'")
    assumed = own.load(spec.kind).assumed if spec.is_file else ()
    return lines + [f"assumed  {text}" for text in assumed]


def _arm_facts(arm: Arm | None) -> list[str]:
    if arm is None:
        return ["arm      none: a cartesian hand, which reaches everything"]
    near, far = arm.reach_m
    lines = [f"arm      {arm.name}, {len(arm.joints)} joints, reaches paths about {near:g} to {far:g} m from its base"]
    limits = zip(joint_limits(arm), arm.rest_rad, arm.servos, strict=True)
    for name, limit, speed, change in zip(
        arm.joints, limits, arm.most_speed_rad_s, arm.most_acceleration_rad_s2, strict=True
    ):
        (low, high), rest, servo = limit
        ends = "no limit" if math.isinf(low) else f"{math.degrees(low):.0f} to {math.degrees(high):.0f} deg"
        lines.append(
            f"         {name}: {ends}, rest {math.degrees(rest):.0f}, {math.degrees(speed):.0f} deg/s, "
            f"{math.degrees(change):.0f} deg/s2, {servo.limit:g} N m"
        )
    return lines


def _gripper_facts(gripper: Gripper) -> list[str]:
    low, high = gripper.friction
    friction = "any" if math.isinf(high) else f"{low:g} to {high:g}"
    jaws = "alike" if gripper.right is None else "unlike"
    return [
        f"gripper  {gripper.name}, fingers {jaws}, opens to {2e3 * gripper.stroke_m:.4g} mm, "
        f"{gripper.least_n:g} to {gripper.most_n:g} N, {1e3 * gripper.length_m:.4g} mm from mount to tool centre",
        f"pads     {2e3 * gripper.pad_half_m:.4g} x {2e3 * gripper.pad_half_m:.4g} mm, "
        f"{gripper.pad_stiffness_pa_m:.3g} Pa/m, friction with objects {friction}",
    ]


def _figure(robot: Robot, camera: Camera, kind: str, mount: str) -> Any:
    from matplotlib.figure import Figure

    rows = 1 if robot.arm is None else 2
    figure = Figure(figsize=(16, 4.6 * rows + 0.4), layout="constrained")
    grid = figure.subplots(rows, 4, squeeze=False)
    mesh, parts = assemble(robot.gripper.stroke_m, gripper=robot.gripper)
    hand, colours = mesh.corners, [(PALM, LEFT, RIGHT)[part] for part in parts]
    if robot.arm is not None:
        links, place, turn = _arm(robot.arm, robot.gripper)
        bodies = np.concatenate([links, hand @ turn.T + place])
        both = [GREY] * len(links) + colours
        for axes, (name, sides) in zip(grid[0], WORLD.items(), strict=True):
            view = _axes_of(*sides)
            axes.set_title(name, fontsize=10)
            _draw(axes, view, bodies, both)
            _mark(axes, view, robot.gripper, camera, place, turn, 4 * AXIS_M)
    for axes, (name, sides) in zip(grid[-1], HAND.items(), strict=True):
        view = _axes_of(*sides)
        axes.set_title(name, fontsize=10)
        _draw(axes, view, hand, colours)
        _mark(axes, view, robot.gripper, camera, np.zeros(3), np.eye(3), AXIS_M)
    words = "red: pads, x; green: y, what the camera sees; blue: z; orange: left finger; fingers open; metres"
    figure.suptitle(f"{kind}: camera mount {mount}; {words}", fontsize=11)
    return figure


def _arm(arm: Arm, gripper: Gripper) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Triangles of the arm at rest, as the fast renderer has them, and place and axes of the hand, all in the world."""
    poses = link_poses(arm, np.array([arm.rest_rad]))
    facets, face = posed(poses, 0), Rotation.from_euler("xyz", arm.mount_rpy)
    flange, mount = poses.turns[0, -1], face.apply([0.0, 0.0, gripper.length_m - TCP_M[2]])
    return (
        facets.vertices[facets.faces],
        poses.places[0, -1] + flange @ (arm.mount_m + mount),
        flange @ face.as_matrix(),
    )


def _draw(axes: Any, view: np.ndarray, corners: np.ndarray, colours: Sequence[str]) -> None:
    """Triangles, the farthest first, the brighter the more they face the viewer."""
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import to_rgb

    right, up, toward = view
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1)
    facing = np.abs(normals @ toward) / np.maximum(length, 1e-12)
    order = np.argsort((corners @ toward).mean(axis=1))
    flat = np.stack([corners @ right, corners @ up], axis=-1)[order]
    shades = np.array([to_rgb(colour) for colour in colours])[order] * (0.45 + 0.55 * facing[order, None])
    axes.add_collection(PolyCollection(list(flat), facecolors=shades, edgecolors=shades, linewidths=0.3))
    axes.set_aspect("equal", adjustable="datalim")
    axes.autoscale_view()


def _mark(
    axes: Any, view: np.ndarray, gripper: Gripper, camera: Camera, place: np.ndarray, turn: np.ndarray, axis_m: float
) -> None:
    """Pads, axes of the tool and what the camera sees, of a hand at a place with these axes."""
    right, up, _ = view

    def line(points: Any, colour: str, width: float = 1.5) -> None:
        world = np.asarray(points, float) @ turn.T + place
        axes.plot(world @ right, world @ up, color=colour, linewidth=width)

    half = gripper.pad_half_m
    square = np.array([(-half, 0, -half), (half, 0, -half), (half, 0, half), (-half, 0, half), (-half, 0, -half)])
    for side in (1, -1):
        line(TCP_M + square + (0, side * gripper.stroke_m, 0), PAD, 2.0)
    for axis, colour in zip(np.eye(3), (PAD, SIGHT, RIGHT), strict=True):
        line([TCP_M, TCP_M + axis_m * axis], colour)
    reach = SIGHT_M / AXIS_M * axis_m
    wide, high = (0.5 * side / camera.focal_px for side in (camera.width, camera.height))
    corners = [(x * wide, y * high, -1.0) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1))]
    ends = camera.position + reach * np.array(corners) @ camera.rotation.T
    line(ends, SIGHT, 1.0)
    for end in ends[:-1]:
        line([camera.position, end], SIGHT, 1.0)


def _axes_of(*sides: Sequence[float]) -> np.ndarray:
    """Right, up and towards the viewer, as rows, from directions to the right and up."""
    right, up = (np.array(axis, float) / np.linalg.norm(axis) for axis in sides)
    return np.stack([right, up, np.cross(right, up)])
