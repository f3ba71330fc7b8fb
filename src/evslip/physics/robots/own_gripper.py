"""Grippers from files: boxes and meshes given in the frame of the face that they are mounted with."""

from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from evslip.config.robot_file import BoxFile, GripperFile, PadsFile, PartFile
from evslip.physics.robots.description import FINGER_Z_M, TCP_M, Box, Gripper, Look, Part, corners_of
from evslip.physics.robots.grippers import RUBBER, mass_of
from evslip.physics.robots.hulls import mesh_triangles
from evslip.physics.robots.own_files import digest, require_mesh
from evslip.utils.errors import ConfigError

SLACK_M = 0.0005
"""Distances of a pad from its jaw, and of a mesh from the middle, that do not matter."""
LONGEST_M = 0.6
"""Parts that reach farther are taken for ones in millimetres."""
TURNED = np.diag([-1.0, -1.0, 1.0])


def gripper_of(given: GripperFile, path: Path) -> tuple[Gripper, list[str], list[Path]]:
    """The gripper that a robot's file describes, what is assumed of it, and the files it is made of. path: the robot's
    file. Raises ConfigError."""
    made: Any = given  # the schema has asked for all of them
    pads, assumed = made.pads, []
    files = [_mesh(part, key, path) for key, part in _parts(given) if part.mesh is not None]
    lift = float(TCP_M[2]) - pads.z_m  # from the face's frame to that of the hand
    up = np.array([0.0, 0.0, lift])
    palm = _whole(made.palm, path, up, np.eye(3), tuple(_box(box, up, np.eye(3)) for box in made.palm.boxes))
    down = np.array([0.0, 0.0, lift - FINGER_Z_M])
    left = _jaw(made.left, "left", path, down, np.eye(3), pads)
    right = None if made.right is None else _jaw(made.right, "right", path, down, TURNED, pads)
    low, high = made.force_n
    if low > high:
        raise ConfigError(f"{path}: gripper.force_n: {low:g} is above {high:g}; expected the least, then the largest")
    if pads.friction[0] > pads.friction[1]:
        raise ConfigError(f"{path}: gripper.pads.friction: expected the least, then the largest")
    top = float(TCP_M[2]) - corners_of(palm.boxes)[:, 2].max()
    if top <= pads.size_m / 2:
        raise ConfigError(
            f"{path}: gripper.palm: reaches to {1e3 * top:.1f} mm from the pads' middle; there is no room for an object"
        )
    if given.right is None:
        assumed.append("gripper: right is not given: the left finger, turned by half a turn")
    for key, part in _parts(given):
        if part.mass_kg is None:
            assumed.append(f"gripper: {key}.mass_kg is not given: that of its boxes at 1500 kg/m3")
    if "stiffness_pa_m" not in pads.model_fields_set:
        assumed.append(f"gripper: pads.stiffness_pa_m is not given: {pads.stiffness_pa_m:.3g}")
    gripper = Gripper(
        name=path.stem,
        palm=palm,
        finger=left,
        right=right,
        pad_half_m=pads.size_m / 2,
        pad_stiffness_pa_m=pads.stiffness_pa_m,
        friction=pads.friction,
        stroke_m=made.stroke_m,
        least_n=low,
        most_n=high,
        length_m=pads.z_m,
    )
    return gripper, assumed, files


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
    half, tool = pads.size_m / 2, float(TCP_M[2]) - FINGER_Z_M
    _require_behind(jaw, half, tool, pads, f"{path}: gripper.{key}.boxes")
    pad = Box((0.0, pads.thickness_m / 2, tool), (half, pads.thickness_m / 2, half), albedo=RUBBER)
    return _whole(given, path, shift, turn, (*jaw, pad))


def _whole(given: PartFile, path: Path, shift: np.ndarray, turn: np.ndarray, boxes: tuple[Box, ...]) -> Part:
    """A part of boxes in a frame whose axes are turned by `turn`, after it has been shifted from the face's."""
    corners = corners_of(boxes)
    low, high = corners.min(axis=0), corners.max(axis=0)
    blocker = Box(_vector((low + high) / 2), _vector((high - low) / 2))
    mass = mass_of(*boxes) if given.mass_kg is None else given.mass_kg
    look = None
    if given.mesh is not None:
        file = (path.parent / given.mesh).resolve()
        rows: Any = tuple(map(_vector, turn))
        look = Look(file, _vector(turn @ shift), rows, given.mesh_scale, digest([file]))
    return Part(boxes, blocker, look, mass_kg=mass)


def _box(given: BoxFile, shift: np.ndarray, turn: np.ndarray) -> Box:
    axes = turn @ Rotation.from_euler("xyz", given.turn_deg, degrees=True).as_matrix()
    rows: Any = tuple(map(_vector, axes))
    return Box(_vector(turn @ (given.centre_m + shift)), _vector(np.array(given.size_m) / 2), rows, given.albedo)


def _vector(numbers: Any) -> tuple[float, float, float]:
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
