"""Grippers from URDF or MJCF: a palm, and the links that two sliding joints move along y."""

import math
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from evslip.config.robot_file import GripperFile, PadsFile
from evslip.physics.robots import urdf
from evslip.physics.robots.description import FINGER_Z_M, STRAIGHT, TCP_M, Box, Gripper, Look, Part, corners_of
from evslip.physics.robots.grippers import mass_of
from evslip.physics.robots.hulls import has_flat_body, shape_corners
from evslip.physics.robots.own_files import require_mesh
from evslip.physics.robots.own_gripper import LONGEST_M, TURNED, around, assembled, pad_of, vector
from evslip.physics.robots.own_pads import backing_m
from evslip.physics.robots.urdf import ET, Origin, Shape, after
from evslip.utils.errors import ConfigError
from evslip.utils.files import digest

SIDES = ("left", "right")
ALONG = math.cos(math.radians(1.0))
"""Least part of y in the direction in which a finger slides."""
SPARE_M = 0.0003
"""Pads may meet so far beyond the ends of a joint."""
LEAST_STROKE_M = 0.003
MOST_BOXES = 16
RUBBER = (0.31, 0.31, 0.31)
"""Colour of pads, sRGB."""


class _Links(NamedTuple):
    looks: tuple[Shape, ...]
    collisions: tuple[Shape, ...]
    mass_kg: float
    """0 where the file says none."""

    @property
    def seen(self) -> tuple[Shape, ...]:
        return self.looks or self.collisions

    def moved(self, frame: Origin) -> "_Links":
        """These in another frame, in which theirs is at `frame`."""
        looks, collisions = (
            tuple(shape._replace(origin=after(frame, shape.origin)) for shape in shapes)
            for shapes in (self.looks, self.collisions)
        )
        return _Links(looks, collisions, self.mass_kg)


def gripper_from(given: GripperFile, path: Path) -> tuple[Gripper, list[str], list[Path]]:
    """The gripper of a URDF or MJCF, what is assumed of it, and the files it is made of. path: the robot's file.
    Raises ConfigError."""
    made: Any = given  # the schema has asked for all of them
    file = (path.parent / made.file).resolve()
    if not file.is_file():
        raise ConfigError(f"{path}: gripper.file: {made.file}: no such file beside it")
    tree = _Tree(file, path)
    if made.base not in tree.links:
        names = ", ".join(tree.links)
        raise ConfigError(f"{path}: gripper.base: {made.base!r} is no link of {file.name}; expected one of {names}")
    if made.joints[0] == made.joints[1]:
        raise ConfigError(f"{path}: gripper.joints: both are {made.joints[0]!r}; expected the left and the right one")
    face = Rotation.from_euler("xyz", made.mount_rpy_deg, degrees=True).as_matrix()
    lift = np.array([0.0, 0.0, float(TCP_M[2]) - made.pads.z_m])  # from the face's frame to that of the hand
    hand = Origin(lift - face.T @ made.mount_m, face.T)
    palm = tree.together(made.base, made.joints).moved(hand)
    if not palm.seen:
        raise ConfigError(f"{path}: gripper.base: {made.base} has no shape; expected the link that is the palm")
    (left, left_m), (right, right_m) = _fingers(tree, made, hand, path)
    most = min(left_m, right_m)
    stroke = most if given.stroke_m is None else given.stroke_m
    if stroke > most + SPARE_M:
        raise ConfigError(
            f"{path}: gripper.stroke_m: {stroke:g} is more than the joints go, {most:.4g} m from where the pads touch"
        )
    whole = _part(palm, None, "palm", tree, path)
    gripper, assumed = assembled(given, path, (whole, left, right), stroke)
    if given.stroke_m is None:
        assumed.append(f"gripper: stroke_m is not given: as far as the joints go, {most:.4g}")
    return gripper, tree.assumed + assumed, tree.files


class _Tree:
    """The links of a file, what of them is drawn, and what is assumed of them."""

    def __init__(self, file: Path, path: Path):
        self.file, self._path, root = file, path, urdf.tree(file)
        self.links = {str(link.attrib.get("name")): link for link in root.findall("link")}
        self.joints = {str(joint.attrib.get("name")): joint for joint in root.findall("joint")}
        self.assumed: list[str] = []
        self._meshes: list[Path] = []

    @property
    def files(self) -> list[Path]:
        """The file and the meshes that were asked for."""
        return [self.file, *dict.fromkeys(self._meshes)]

    @cached_property
    def below(self) -> dict[str, list[ET.Element]]:
        """Joints that begin at each link."""
        found: dict[str, list[ET.Element]] = {}
        for joint in self.joints.values():
            found.setdefault(urdf.end_of(joint, "parent"), []).append(joint)
        return found

    def together(self, base: str, without: tuple[str, str]) -> _Links:
        """A link and all that it carries but by some joints, in its frame, the joints at 0."""
        looks, collisions, mass = [], [], 0.0
        waiting, seen = [(base, urdf.AT_ORIGIN)], {base}
        while waiting:
            name, frame = waiting.pop()
            if name not in self.links:
                raise ConfigError(f"{self._path}: gripper.file: a joint ends at link {name!r}, which is not there")
            element = self.links[name]
            link = urdf.described(self.file, element)
            own = _Links(link.looks, link.collisions, 0.0).moved(frame)
            looks += own.looks
            collisions += own.collisions
            mass += urdf.mass_kg_of(element)
            for joint in self.below.get(name, []):
                child = urdf.end_of(joint, "child")
                if joint.attrib["name"] in without or child in seen:
                    continue
                if joint.attrib.get("type") != "fixed":
                    self.assumed.append(f"gripper: joint {joint.attrib['name']} stands still at 0")
                seen.add(child)
                waiting.append((child, after(frame, urdf.origin_of(joint))))
        self._require_meshes(base, (*looks, *collisions))
        links = _Links(tuple(looks), tuple(collisions), mass)
        if has_flat_body(links.seen):
            raise ConfigError(
                f"{self._path}: gripper.file: {base} has a shape that is flat; expected one with a volume"
            )
        return links

    def place(self, link: str, base: str, without: tuple[str, str]) -> Origin | None:
        """Frame of a link in that of the base, the joints at 0; None if the base does not carry it, but by some
        joints."""
        above = {urdf.end_of(joint, "child"): joint for joint in self.joints.values()}
        frame = urdf.AT_ORIGIN
        while link != base:
            joint = above.pop(link, None)  # so that a loop ends
            if joint is None or joint.attrib["name"] in without:
                return None
            frame, link = after(urdf.origin_of(joint), frame), urdf.end_of(joint, "parent")
        return frame

    def _require_meshes(self, base: str, shapes: tuple[Shape, ...]) -> None:
        key = f"{self._path}: gripper.file: {base}"
        for shape in shapes:
            if shape.file is not None:
                require_mesh(shape.file, key)
                self._meshes.append(shape.file)
            reach = float(np.abs(shape_corners(shape)).max())
            if reach > LONGEST_M:
                raise ConfigError(
                    f"{key}: reaches {reach:.4g} m from its frame; is its mesh in millimetres? Then give it "
                    'scale="0.001 0.001 0.001"'
                )


def _fingers(tree: _Tree, made: Any, hand: Origin, path: Path) -> list[tuple[Part, float]]:
    """The left and the right finger, as of `_finger`."""
    try:
        return [_finger(tree, made, side, hand, path) for side in (0, 1)]
    except ConfigError:
        right, left = made.joints
        if not _fit(tree, made.model_copy(update={"joints": (left, right)}), hand, path):
            raise
    raise ConfigError(
        f"{path}: gripper.joints: {right!r} and {left!r} are swapped; expected [{left!r}, {right!r}], the joint of the "
        "finger at y > 0 first"
    )


def _fit(tree: _Tree, made: Any, hand: Origin, path: Path) -> bool:
    try:
        return all(_finger(tree, made, side, hand, path) for side in (0, 1))
    except ConfigError:
        return False


def _finger(tree: _Tree, made: Any, side: int, hand: Origin, path: Path) -> tuple[Part, float]:
    """A finger in its own frame, closed, and how far it opens. hand: frame of the base in that of the hand."""
    name, key = made.joints[side], f"{path}: gripper.joints.{side}"
    if name not in tree.joints:
        names = ", ".join(name for name, joint in tree.joints.items() if joint.attrib.get("type") == "prismatic")
        raise ConfigError(f"{key}: {name!r} is no joint of {tree.file.name}; its sliding ones: {names or 'none'}")
    joint = tree.joints[name]
    kind = joint.attrib.get("type")
    if kind != "prismatic":
        raise ConfigError(
            f"{key}: {name!r} is {kind}; expected a sliding joint (prismatic, slide). Fingers that swing are described "
            "as [gripper.left] and [gripper.right], of boxes and meshes"
        )
    if joint.find("limit") is None:
        raise ConfigError(f"{key}: {name!r} has no <limit> of lower and upper")
    above = tree.place(urdf.end_of(joint, "parent"), made.base, made.joints)
    if above is None:
        raise ConfigError(f"{key}: {name!r} is not on {made.base!r}; expected a joint that gripper.base carries")
    frame = after(after(hand, above), urdf.origin_of(joint))
    along = frame.turn @ urdf.axis_of(joint)
    along = along / max(float(np.linalg.norm(along)), 1e-12)
    outward = -1.0 if side else 1.0
    if abs(along[1]) < ALONG:
        text = ", ".join(f"{part:.2f}" for part in along)
        raise ConfigError(
            f"{key}: {name!r} slides along ({text}) of the face that the gripper is mounted with; expected its y: turn "
            "the face by gripper.mount_rpy_deg"
        )
    opens = outward * float(np.sign(along[1]))
    ends = sorted(opens * end for end in urdf.limits_of(joint))
    links = tree.together(urdf.end_of(joint, "child"), made.joints).moved(frame)
    # In the finger's own frame it opens along y.
    turn = TURNED if side else np.eye(3)
    links = links.moved(Origin(-turn @ [0.0, 0.0, FINGER_Z_M], turn))
    behind = backing_m(links.seen, made.pads, f"{path}: gripper.pads", urdf.end_of(joint, "child"))
    closed = made.pads.thickness_m - behind  # way from the joint's 0 to where the pads touch
    if not ends[0] - SPARE_M <= closed <= ends[1] - LEAST_STROKE_M:
        gap = behind + ends[0]
        raise ConfigError(
            f"{key}: {name!r} leaves {1e3 * gap:.2f} mm between finger and middle where it is closed, and "
            f"{1e3 * (behind + ends[1]):.2f} mm where it is open; expected the pad's thickness between them: "
            f"gripper.pads.thickness_m, {made.pads.thickness_m:g}, or gripper.mount_m, for y = 0 is the middle"
        )
    closed_at = Origin(np.array([0.0, closed, 0.0]), np.eye(3))
    tree.assumed.append(
        f"gripper: the {SIDES[side]} pad is in the middle where {name} is at {1e3 * opens * closed:.3g} mm"
    )
    return _part(links.moved(closed_at), made.pads, SIDES[side], tree, path), ends[1] - closed


def _part(links: _Links, pads: PadsFile | None, key: str, tree: _Tree, path: Path) -> Part:
    """Description of links, with a pad if they are a finger."""
    shapes = links.collisions or links.looks
    boxes = tuple(_box(shape) for shape in shapes)
    if len(boxes) > MOST_BOXES:
        boxes = (around(corners_of(boxes)),)
    if pads is not None:
        # A box around a mesh may reach farther than the mesh: on the other side of the middle is the other finger.
        boxes = (*(_behind(box) for box in boxes), pad_of(pads))
    mass = links.mass_kg
    if mass <= 0:
        mass = mass_of(*boxes)
        tree.assumed.append(f"gripper: {key} has no mass in its file: that of its boxes at 1500 kg/m3")
    looks = tuple(_look(shape) for shape in links.seen)
    if pads is not None:
        looks = (*looks, Look(None, corners_m=tuple(map(vector, corners_of((pad_of(pads),)))), colour=RUBBER))
    return Part(boxes, around(corners_of(boxes)), looks, mass_kg=mass)


def _box(shape: Shape) -> Box:
    """The box that a shape is, or the one along the axes around it."""
    corners, origin = shape.corners, shape.origin
    if len(corners) != 8:
        return around(shape_corners(shape))
    low, high = corners.min(axis=0), corners.max(axis=0)
    if not ((corners == low) | (corners == high)).all():
        return around(shape_corners(shape))
    rows: Any = tuple(map(vector, origin.turn))
    return Box(vector(origin.turn @ ((low + high) / 2) + origin.place), vector((high - low) / 2), rows)


def _behind(box: Box) -> Box:
    """The part of a box along the axes on its finger's side of the middle; others as they are."""
    low, high = box.place_m[1] - box.half_m[1], box.place_m[1] + box.half_m[1]
    if box.axes != STRAIGHT or low >= 0 or high <= 0:
        return box
    (x, _, z), (width, _, height) = box.place_m, box.half_m
    return Box((x, high / 2, z), (width, high / 2, height), albedo=box.albedo)


def _look(shape: Shape) -> Look:
    rows: Any = tuple(map(vector, shape.origin.turn))
    place, scale = vector(shape.origin.place), vector(shape.scale)
    colour = None if shape.colour is None else vector(shape.colour)
    if shape.file is not None:
        return Look(shape.file, place, rows, scale, colour=colour, content=digest([shape.file]))
    return Look(None, place, rows, corners_m=tuple(map(vector, shape.corners)), colour=colour)
