"""Grippers from files: boxes and meshes given in the frame of the face that they are mounted with."""

from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from evslip.config.robot_file import BoxFile, GripperFile, PadsFile, PartFile
from evslip.physics.robots.description import FINGER_Z_M, TCP_M, Box, Gripper, Look, Part, corners_of
from evslip.physics.robots.grippers import RUBBER, mass_of
from evslip.physics.robots.hulls import mesh_triangles
from evslip.physics.robots.own_files import require_mesh
from evslip.utils.errors import ConfigError
from evslip.utils.files import digest

SLACK_M = 0.0005
"""Distances of a pad from its jaw, and of a mesh from the middle, that do not matter."""
TOOL_M = float(TCP_M[2]) - FINGER_Z_M
"""Height of the pads' middle in the frames of the fingers."""
LONGEST_M = 0.6
"""Parts that reach farther are taken for ones in millimetres."""
TURNED = np.diag([-1.0, -1.0, 1.0])


def gripper_of(given: GripperFile, path: Path) -> tuple[Gripper, list[str], list[Path]]:
    """The gripper that a robot's file describes, what is assumed of it, and the files it is made of. path: the robot's
    file. Raises ConfigError."""
    made: Any = given  # the schema has asked for all of them
    pads = made.pads
    files = [_mesh(part, key, path) for key, part in _parts(given) if part.mesh is not None]
    lift = float(TCP_M[2]) - pads.z_m  # from the face's frame to that of the hand
    up = np.array([0.0, 0.0, lift])
    palm = _whole(made.palm, path, up, np.eye(3), tuple(_box(box, up, np.eye(3)) for box in made.palm.boxes))
    down = np.array([0.0, 0.0, lift - FINGER_Z_M])
    left = _jaw(made.left, "left", path, down, np.eye(3), pads)
    right = None if made.right is None else _jaw(made.right, "right", path, down, TURNED, pads)
    assumed = [] if right is not None else ["gripper: right is not given: the left finger, turned by half a turn"]
    for key, part in _parts(given):
        if part.mass_kg is None:
            assumed.append(f"gripper: {key}.mass_kg is not given: that of its boxes at 1500 kg/m3")
    gripper, more = assembled(given, path, (palm, left, right), made.stroke_m)
    return gripper, assumed + more, files


def assembled(
    given: GripperFile, path: Path, parts: tuple[Part, Part, Part | None], stroke_m: float
) -> tuple[Gripper, list[str]]:
    """The gripper of a palm, a left and a right finger, each in its own frame, and what is assumed of its pads. Raises
    ConfigError."""
    made: Any = given
    pads, (palm, left, right), (low, high) = made.pads, parts, made.force_n
    if low > high:
        raise ConfigError(f"{path}: gripper.force_n: {low:g} is above {high:g}; expected the least, then the largest")
    if pads.friction[0] > pads.friction[1]:
        raise ConfigError(f"{path}: gripper.pads.friction: expected the least, then the largest")
    top = float(TCP_M[2]) - corners_of(palm.boxes)[:, 2].max()
    if top <= pads.size_m / 2:
        raise ConfigError(
            f"{path}: gripper.palm: reaches to {1e3 * top:.1f} mm from the pads' middle; there is no room for an object"
        )
    gripper = Gripper(
        name=path.stem,
        palm=palm,
        finger=left,
        right=right,
        pad_half_m=pads.size_m / 2,
        pad_stiffness_pa_m=pads.stiffness_pa_m,
        friction=pads.friction,
        stroke_m=stroke_m,
        least_n=low,
        most_n=high,
        length_m=pads.z_m,
    )
    if "stiffness_pa_m" in pads.model_fields_set:
        return gripper, []
    return gripper, [f"gripper: pads.stiffness_pa_m is not given: {pads.stiffness_pa_m:.3g}"]


def _parts(given: GripperFile) -> list[tuple[str, PartFile]]:
    parts = [(key, getattr(given, key)) for key in ("palm", "left", "right")]
    return [(key, part) for key, part in parts if part is not None]


def _mesh(part: PartFile, key: str, path: Path) -> Path:
    file = (path.parent / str(part.mesh)).resolve()
    require_mesh(file, f"{path}: gripper.{key}.mesh")
    reach = float(np.abs(mesh_triangles(file)).max()) * part.mesh_scale
    if reach > LONGEST_M:
        raise ConfigError(
            f"{path}: gripper.{key}.mesh: {file.name} reaches {reach:.4g} m from the face; is it in millimetres? Then "
            "give mesh_scale = 0.001"
        )
    return file


def _jaw(given: PartFile, key: str, path: Path, shift: np.ndarray, turn: np.ndarray, pads: PadsFile) -> Part:
    """A finger with its pad, in its own frame."""
    jaw = tuple(_box(box, shift, turn) for box in given.boxes)
    _require_behind(jaw, pads.size_m / 2, TOOL_M, pads, f"{path}: gripper.{key}.boxes")
    return _whole(given, path, shift, turn, (*jaw, pad_of(pads)))


def _whole(given: PartFile, path: Path, shift: np.ndarray, turn: np.ndarray, boxes: tuple[Box, ...]) -> Part:
    """A part of boxes in a frame whose axes are turned by `turn`, after it has been shifted from the face's."""
    mass = mass_of(*boxes) if given.mass_kg is None else given.mass_kg
    looks = ()
    if given.mesh is not None:
        file = (path.parent / given.mesh).resolve()
        rows: Any = tuple(map(vector, turn))
        scale = given.mesh_scale, given.mesh_scale, given.mesh_scale
        looks = (Look(file, vector(turn @ shift), rows, scale, content=digest([file])),)
    return Part(boxes, around(corners_of(boxes)), looks, mass_kg=mass)


def around(corners_m: np.ndarray) -> Box:
    """The box along the axes around corners of shape (n, 3)."""
    low, high = corners_m.min(axis=0), corners_m.max(axis=0)
    return Box(vector((low + high) / 2), vector((high - low) / 2))


def pad_of(pads: PadsFile) -> Box:
    """The pad in a finger's frame."""
    half, thick = pads.size_m / 2, pads.thickness_m
    return Box((0.0, thick / 2, TOOL_M), (half, thick / 2, half), albedo=RUBBER)


def _box(given: BoxFile, shift: np.ndarray, turn: np.ndarray) -> Box:
    axes = turn @ Rotation.from_euler("xyz", given.turn_deg, degrees=True).as_matrix()
    rows: Any = tuple(map(vector, axes))
    return Box(vector(turn @ (given.centre_m + shift)), vector(np.array(given.size_m) / 2), rows, given.albedo)


def vector(numbers: Any) -> tuple[float, float, float]:
    """Three numbers as a description has them."""
    x, y, z = (float(number) + 0.0 for number in numbers)  # no minus before a zero
    return x, y, z


def _require_behind(jaw: tuple[Box, ...], half: float, tool: float, pads: PadsFile, key: str) -> None:
    """Raise ConfigError unless one of the boxes carries the pad, and none reaches beyond the middle."""
    spans = [(corners.min(axis=0), corners.max(axis=0)) for corners in (corners_of((box,)) for box in jaw)]
    for number, (low, _) in enumerate(spans):
        if low[1] < -1e-6:
            raise ConfigError(
                f"{key}.{number}: reaches {-1e3 * low[1]:.2f} mm beyond the middle where the other finger closes; "
                "expected it on its own side of y = 0"
            )
    off = []
    for low, high in spans:
        outside = max(low[0] + half, half - high[0], low[2] - tool + half, tool + half - high[2], 0.0)
        off.append(max(outside, abs(low[1] - pads.thickness_m)))
    if min(off) > SLACK_M:
        raise ConfigError(
            f"{key}: the pad of {1e3 * pads.size_m:.4g} mm is {1e3 * min(off):.1f} mm off the jaw; expected a box that "
            f"begins {1e3 * pads.thickness_m:.4g} mm (pads.thickness_m) from y = 0 and lies behind all of the pad, "
            f"about x = 0 and z = {pads.z_m:g}"
        )
