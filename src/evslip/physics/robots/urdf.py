"""Links and joints of a URDF, and the files of its meshes."""

import math
import xml.etree.ElementTree as ET
from collections.abc import Collection
from functools import cache
from importlib import import_module, metadata
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from evslip.physics.robots.description import Arm
from evslip.scene.shapes.surface import BOX_CORNERS
from evslip.utils.errors import ConfigError, MissingExtraError

SHAPES = ("box", "cylinder", "sphere", "capsule", "mesh")
AROUND = 20
"""Corners around a cylinder or a sphere."""
_ROBOTS = "share/example-robot-data/robots"


@cache
def robots_folder() -> Path:
    """Folder of the robots in the package example-robot-data. Raises MissingExtraError."""
    try:
        root = Path(str(metadata.distribution("example-robot-data").locate_file("")))
    except metadata.PackageNotFoundError:
        raise MissingExtraError("the models of robots are missing; pip install example-robot-data") from None
    for folder in [root / "cmeel.prefix" / _ROBOTS, *(parent / _ROBOTS for parent in root.parents)]:
        if (folder / "panda_description" / "urdf" / "panda.urdf").is_file():
            return folder
    raise MissingExtraError(f"example-robot-data is installed, but {_ROBOTS} is not in it; reinstall it")


def file_of(path: Path) -> Path:
    """The file itself of a path of a description. Raises MissingExtraError."""
    return path if path.is_absolute() else robots_folder() / path


class Origin(NamedTuple):
    """Place and turn of a frame in another."""

    place: np.ndarray
    """In metres, of shape (3,)."""
    turn: np.ndarray
    """Axes as columns, of shape (3, 3)."""


AT_ORIGIN = Origin(np.zeros(3), np.eye(3))


def after(outer: Origin, inner: Origin) -> Origin:
    """A frame that is given in another one, whose own is `outer`."""
    return Origin(outer.place + outer.turn @ inner.place, outer.turn @ inner.turn)


class Shape(NamedTuple):
    """A mesh of a link, or a convex body."""

    file: Path | None
    """The mesh's; None for a body."""
    origin: Origin
    scale: np.ndarray
    """Factors of the mesh along its axes, of shape (3,)."""
    corners: np.ndarray
    """Points of the body, in metres in its own frame, of shape (n, 3)."""
    colour: np.ndarray | None
    """Colour of the body, or of the mesh in place of the file's own, sRGB of 0 to 1, of shape (3,), if the URDF says
    one."""


class Link(NamedTuple):
    """A link of an arm, in its own frame."""

    name: str
    origin: Origin
    """Its frame in that of the link before, at joint angle 0."""
    axis_turn: np.ndarray
    """Turn (3, 3) of z to the axis of the joint that moves it."""
    looks: tuple[Shape, ...]
    collisions: tuple[Shape, ...]


@cache
def tree(path: Path) -> ET.Element:
    """The URDF's root; of an MJCF that of a URDF of the same arm. Raises MissingExtraError, ConfigError."""
    text = file_of(path).read_bytes()
    if b"<!DOCTYPE" in text or b"<!ENTITY" in text:
        raise ConfigError(f"{path}: has a DOCTYPE, which may name other files; remove it")
    try:
        root = ET.fromstring(text)
    except (ET.ParseError, ValueError, LookupError) as error:  # LookupError: an unknown encoding
        raise ConfigError(f"{path}: not valid XML: {error}") from None
    if root.tag == "robot":
        _require_links(root, path)
        return root
    if root.tag == "mujoco":
        # Looked up, so that what reads a URDF needs no MuJoCo.
        return import_module("evslip.physics.robots.mjcf").as_urdf(root, path)
    raise ConfigError(f"{path}: begins with <{root.tag[:40]}>; expected <robot>, a URDF, or <mujoco>, an MJCF")


def _require_links(root: ET.Element, path: Path) -> None:
    """Raise ConfigError for what becomes a URDF by ROS's xacro only, or has no links."""
    if any("/xacro}" in part.tag for part in root.iter()):
        raise ConfigError(f"{path}: is xacro, of which a URDF is made first; expected what `xacro {path.name}` writes")
    if root.find("link") is None:
        raise ConfigError(f"{path}: has no <link>; expected a URDF of links and joints")


def bare(path: Path, base: str, without: Collection[str] = ()) -> str:
    """The URDF from link `base` on, up to the links `without`, without geometry: MuJoCo loads it without looking for
    mesh files."""
    root = ET.fromstring(ET.tostring(tree(path)))
    joints = root.findall("joint")
    parents = {end_of(joint, "child"): end_of(joint, "parent") for joint in joints}

    def kept(link: str) -> bool:
        return link not in without and (link == base or (link in parents and kept(parents[link])))

    for link in root.findall("link"):
        for part in [*link.findall("visual"), *link.findall("collision")]:
            link.remove(part)
        if not kept(link.attrib["name"]):
            root.remove(link)
    for joint in joints:
        if not (kept(end_of(joint, "parent")) and kept(end_of(joint, "child"))):
            root.remove(joint)
    for extension in root.findall("mujoco"):  # MuJoCo takes one only
        root.remove(extension)
    extension = ET.SubElement(root, "mujoco")
    ET.SubElement(extension, "compiler", fusestatic="false", autolimits="true")
    return ET.tostring(root, encoding="unicode")


@cache
def chain(path: Path, joints: tuple[str, ...]) -> tuple[Link, ...]:
    """The base and the links that the joints move, one after the other. Fixed joints between count to the link after
    them."""
    root = tree(path)
    named = {joint.attrib["name"]: joint for joint in root.findall("joint")}
    above = {end_of(joint, "child"): joint for joint in named.values()}
    links = {link.attrib["name"]: link for link in root.findall("link")}
    base = end_of(named[joints[0]], "parent")
    found, before = [described(path, links[base])], base
    for name in joints:
        joint, link = named[name], end_of(named[name], "child")
        origin, at = origin_of(joint), end_of(named[name], "parent")
        while at != before:
            origin, at = after(origin_of(above[at]), origin), end_of(above[at], "parent")
        found.append(described(path, links[link], origin, _turn_to(axis_of(joint))))
        before = link
    return tuple(found)


def joint_limits(arm: Arm) -> list[tuple[float, float]]:
    """Least and largest angle of each joint of an arm, in radians."""
    named = {joint.attrib["name"]: joint for joint in tree(arm.urdf).findall("joint")}
    return [limits_of(named[name]) for name in arm.joints]


def limits_of(joint: ET.Element) -> tuple[float, float]:
    """Least and largest angle of a joint in radians; infinite where it has none."""
    limit = joint.find("limit")
    if joint.attrib["type"] == "continuous" or limit is None:
        return -math.inf, math.inf
    return float(limit.attrib.get("lower", "0")), float(limit.attrib.get("upper", "0"))


def origin_of(part: ET.Element) -> Origin:
    """Origin that an element says."""
    origin = part.find("origin")
    attributes = {} if origin is None else origin.attrib
    place, rpy = (_numbers(attributes.get(key, "0 0 0")) for key in ("xyz", "rpy"))
    return Origin(place, Rotation.from_euler("xyz", rpy).as_matrix())


def axis_of(joint: ET.Element) -> np.ndarray:
    """Axis of a joint in its own frame, of shape (3,), not of unit length if the file's is not."""
    axis = joint.find("axis")
    return np.array([1.0, 0.0, 0.0]) if axis is None else _numbers(axis.attrib["xyz"])


def mass_kg_of(link: ET.Element) -> float:
    """Mass of a link, 0 where the file says none. Raises ValueError."""
    part = link.find("inertial/mass")
    text = "0" if part is None else part.attrib.get("value", "0")
    mass = float(text)
    if not 0 <= mass < math.inf:
        raise ValueError(f"link {link.attrib['name']!r} has a mass of {text[:40]}; expected a finite one, at least 0")
    return mass


def _turn_to(axis: np.ndarray) -> np.ndarray:
    z = np.array([0.0, 0.0, 1.0])
    if np.array_equal(axis, z):
        return np.eye(3)
    return Rotation.align_vectors(axis[None], z[None])[0].as_matrix()


def described(path: Path, link: ET.Element, origin: Origin = AT_ORIGIN, axis_turn: np.ndarray = AT_ORIGIN.turn) -> Link:
    """A link with its shapes."""
    looks, collisions = (
        tuple(_shape(path, link, part) for part in link.findall(kind) if part.find("geometry/*") is not None)
        for kind in ("visual", "collision")
    )
    return Link(link.attrib["name"], origin, axis_turn, looks, collisions)


def _shape(path: Path, link: ET.Element, part: ET.Element) -> Shape:
    shape = part.find("geometry/*")
    assert shape is not None  # asked before
    if shape.tag not in SHAPES:
        raise ConfigError(
            f"{path}: link {link.attrib['name']!r} has a <{shape.tag[:40]}>; expected one of {', '.join(SHAPES)}"
        )
    rgb, origin = _colour(path, part), origin_of(part)
    if shape.tag != "mesh":
        return Shape(None, origin, np.ones(3), _corners(shape), rgb)
    scale = np.ones(3) * _numbers(shape.attrib.get("scale", "1 1 1"), 1, 3)
    return Shape(mesh_file(path, shape.attrib["filename"]), origin, scale, np.zeros((0, 3)), rgb)


def _colour(path: Path, part: ET.Element) -> np.ndarray | None:
    """Colour of a visual's material, which another one of its name may give."""
    material = part.find("material")
    if material is None:
        return None
    name, materials = material.attrib.get("name"), [material]
    # Robots of example-robot-data keep the look that their records have: xArm names colours for its meshes.
    if name and path.is_absolute():
        materials += [other for other in tree(path).iter("material") if other.attrib.get("name") == name]
    colours = [colour for one in materials if (colour := one.find("color")) is not None]
    return _numbers(colours[0].attrib["rgba"], 3, 4)[:3] if colours else None


def _corners(shape: ET.Element) -> np.ndarray:
    """Corners of a box, or of a cylinder or a sphere with flat faces; of a capsule those of the cylinder around it."""
    if shape.tag == "box":
        return BOX_CORNERS * (0.5 * _numbers(shape.attrib["size"]))
    radius, around = _number(shape.attrib["radius"]), 2 * np.pi * np.arange(AROUND) / AROUND
    if shape.tag != "sphere":
        length = _number(shape.attrib["length"]) + (2 * radius if shape.tag == "capsule" else 0.0)
        levels = [(radius, end * length) for end in (-0.5, 0.5)]
    else:
        levels = [(radius * np.cos(a), radius * np.sin(a)) for a in np.linspace(-1.5, 1.5, AROUND // 2)]
    return np.concatenate(
        [np.column_stack([r * np.cos(around), r * np.sin(around), 0 * around + z]) for r, z in levels]
    )


def mesh_file(urdf: Path, name: str) -> Path:
    """File that a URDF means by a name: beside it, or in a package that is a folder above it."""
    if name.startswith("package://example-robot-data/robots/"):
        return robots_folder() / name.removeprefix("package://example-robot-data/robots/")
    if name.startswith("package://"):
        package, _, rest = name.removeprefix("package://").partition("/")
        for folder in file_of(urdf).parents:
            if folder.name == package:
                return folder / rest
            if (folder / package / rest).is_file():
                return folder / package / rest
        return file_of(urdf).parent / rest
    return file_of(urdf).parent / name.removeprefix("file://")


def _numbers(text: str, least: int = 3, most: int = 3) -> np.ndarray:
    """Numbers of an attribute. Raises ValueError unless there are so many, all finite."""
    numbers = np.array([float(x) for x in text.split()])
    if not (least <= len(numbers) <= most and np.isfinite(numbers).all()):
        raise ValueError(f"{text[:40]!r}, expected {most} finite number{'s' * (most > 1)}")
    return numbers


def _number(text: str) -> float:
    return float(_numbers(text, 1, 1)[0])


def end_of(joint: ET.Element, end: str) -> str:
    """Link at an end of a joint, "parent" or "child"."""
    part = joint.find(end)
    return "" if part is None else part.attrib["link"]
