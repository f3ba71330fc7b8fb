"""Arms from files, URDF or MJCF."""

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from evslip.config.robot_file import ArmFile
from evslip.physics.robots import urdf
from evslip.physics.robots.arms import servos_of
from evslip.physics.robots.description import MOST_JOINTS, Arm
from evslip.physics.robots.hulls import has_flat_body, has_volume, link_corners, shape_corners
from evslip.physics.robots.own_files import require_mesh
from evslip.utils.errors import ConfigError
from evslip.utils.files import digest

ACCELERATION_DEG_S2 = 860.0
LONGEST_M = 5.0
"""Arms that are longer are taken for ones in millimetres."""
REACH = (0.35, 0.8)
"""Shares of its length between which an arm is likely to reach; for messages."""


def arm_of(given: ArmFile, path: Path) -> tuple[Arm, list[str], list[Path]]:
    """The arm that a robot's file describes, what is assumed of it, and the files it is made of. path: the robot's
    file. Raises ConfigError."""
    assert given.file is not None and given.flange is not None and given.rest_deg is not None  # asked by the schema
    file = (path.parent / given.file).resolve()
    if not file.is_file():
        raise ConfigError(f"{path}: arm.file: {given.file}: no such file beside it")
    joints = _joints(given, file, path)
    links, assumed = urdf.chain(file, tuple(joint.attrib["name"] for joint in joints)), []
    files = [file]
    for link in links:
        shapes = (*link.looks, *link.collisions)
        if not shapes:
            assumed.append(f"arm: {link.name} has no shape, so that nothing of it is seen")
        for shape in shapes:
            if shape.file is not None:
                require_mesh(shape.file, f"{path}: arm.file: {link.name}")
                files.append(shape.file)
        extent = max((float(np.abs(shape_corners(shape)).max()) for shape in shapes), default=0.0)
        if extent > LONGEST_M:
            raise ConfigError(
                f"{path}: arm.file: {link.name} reaches {extent:.4g} m from its joint; is its mesh in millimetres? "
                'Then give it scale="0.001 0.001 0.001"'
            )
        if shapes and not has_volume(link_corners(link)):
            raise ConfigError(f"{path}: arm.file: {link.name} is flat; expected a shape with a volume, or none")
        if has_flat_body(link.looks or link.collisions):
            raise ConfigError(f"{path}: arm.file: {link.name} has a shape that is flat; expected one with a volume")
    length = float(sum(np.linalg.norm(link.origin.place) for link in links[1:]))
    if not 0.1 < length < LONGEST_M:
        raise ConfigError(
            f"{path}: arm.file: its links are {length:.4g} m long together; expected 0.1 to {LONGEST_M:g}; "
            "is it in metres?"
        )
    torques = _each(given.torque_n_m, "torque_n_m", "effort", joints, path)
    speeds = _each(given.speed_deg_s, "speed_deg_s", "velocity", joints, path)
    accelerations = given.acceleration_deg_s2
    if accelerations is None:
        accelerations = (ACCELERATION_DEG_S2,) * len(joints)
        assumed.append(f"arm: acceleration_deg_s2 is not given: {ACCELERATION_DEG_S2:g} for every joint")
    for key, values in (("rest_deg", given.rest_deg), ("acceleration_deg_s2", accelerations)):
        _require_count(values, key, joints, path)
    for joint, angle in zip(joints, given.rest_deg, strict=True):
        low, high = (math.degrees(end) for end in urdf.limits_of(joint))
        if not low <= angle <= high:
            raise ConfigError(
                f"{path}: arm.rest_deg: {angle:g} of {joint.attrib['name']} is outside its limits, "
                f"{low:.4g} to {high:.4g}"
            )
    roll, pitch, yaw = given.mount_rpy_deg
    arm = Arm(
        name=path.stem,
        urdf=file,
        joints=tuple(joint.attrib["name"] for joint in joints),
        flange=given.flange,
        mount_m=given.mount_m,
        mount_rpy=(math.radians(roll), math.radians(pitch), math.radians(yaw)),
        servos=servos_of(torques),
        rest_rad=tuple(map(math.radians, given.rest_deg)),
        most_speed_rad_s=speeds if given.speed_deg_s is None else tuple(map(math.radians, speeds)),
        most_acceleration_rad_s2=tuple(map(math.radians, accelerations)),
        reach_m=(round(REACH[0] * length, 2), round(REACH[1] * length, 2)),
        left_out=tuple(_besides(file, {link.name for link in links})),
        content=digest(files),
    )
    return arm, assumed, files


def _joints(given: ArmFile, file: Path, path: Path) -> list[urdf.ET.Element]:
    """The joints that move from the base to the flange."""
    root = urdf.tree(file)
    if given.flange not in {link.attrib.get("name") for link in root.findall("link")}:
        names = ", ".join(str(link.attrib.get("name")) for link in root.findall("link"))
        raise ConfigError(f"{path}: arm.flange: {given.flange!r} is no link of {file.name}; expected one of {names}")
    above = {urdf.end_of(joint, "child"): joint for joint in root.findall("joint")}
    _require_no_loop({child: urdf.end_of(joint, "parent") for child, joint in above.items()}, path)
    found, link = [], str(given.flange)
    while link in above:
        joint = above[link]
        kind, name = joint.attrib.get("type"), joint.attrib.get("name")
        if kind not in ("fixed", "revolute", "continuous"):
            raise ConfigError(f"{path}: arm.file: joint {name!r} is {kind}; expected an arm of revolute joints")
        if kind != "fixed":
            if name is None or (kind == "revolute" and joint.find("limit") is None):
                raise ConfigError(f"{path}: arm.file: joint {name!r} has no name or no <limit> of lower and upper")
            if not urdf.axis_of(joint).any():
                raise ConfigError(f"{path}: arm.file: joint {name!r} has the axis 0 0 0; expected a direction")
            found.append(joint)
        link = urdf.end_of(joint, "parent")
    if not 1 <= len(found) <= MOST_JOINTS:
        raise ConfigError(
            f"{path}: arm.flange: {len(found)} joints move {given.flange!r}; expected 1 to {MOST_JOINTS}, "
            "from the base on"
        )
    if urdf.end_of(found[0], "child") != given.flange:
        raise ConfigError(
            f"{path}: arm.flange: no joint moves {given.flange!r} itself; expected "
            f"{urdf.end_of(found[0], 'child')!r}, with mount_m and mount_rpy_deg for what is fixed to it"
        )
    for joint in found:
        child = urdf.end_of(joint, "child")
        link = next((link for link in root.findall("link") if link.attrib.get("name") == child), None)
        if link is None:
            raise ConfigError(
                f"{path}: arm.file: joint {joint.attrib['name']!r} ends at link {child!r}, which is not there; "
                "expected the name of a <link>"
            )
        if urdf.mass_kg_of(link) == 0 or link.find("inertial/inertia") is None:
            raise ConfigError(f"{path}: arm.file: link {link.attrib['name']!r} has no mass; give it an <inertial>")
    return found[::-1]


def _require_no_loop(parents: dict[str, str], path: Path) -> None:
    """Raise ConfigError where a link carries itself. parents: links by those that they carry."""
    clear: set[str] = set()
    for start in parents:
        link, way = start, set()
        while link in parents and link not in clear:
            if link in way:
                raise ConfigError(
                    f"{path}: arm.file: link {link!r} carries itself in a loop of joints; expected a tree"
                )
            way.add(link)
            link = parents[link]
        clear |= way


def _besides(file: Path, links: set[str]) -> Iterator[str]:
    """Links that an arm's links carry and that are none of them."""
    for joint in urdf.tree(file).findall("joint"):
        child = urdf.end_of(joint, "child")
        if urdf.end_of(joint, "parent") in links and child not in links:
            yield child


def _each(
    given: tuple[float, ...] | None, key: str, attribute: str, joints: list[urdf.ET.Element], path: Path
) -> tuple[float, ...]:
    """A limit of every joint: as it is given, or else the file's."""
    if given is not None:
        _require_count(given, key, joints, path)
        return given
    found = []
    for joint in joints:
        limit = joint.find("limit")
        found.append(0.0 if limit is None else float(limit.attrib.get(attribute, "0")))
        if not found[-1] > 0:
            raise ConfigError(
                f"{path}: arm.{key}: this key is missing, and the arm's file does not say it of {joint.attrib['name']}"
            )
    return tuple(found)


def _require_count(values: tuple[float, ...], key: str, joints: list[urdf.ET.Element], path: Path) -> None:
    if len(values) != len(joints):
        names = ", ".join(joint.attrib["name"] for joint in joints)
        raise ConfigError(f"{path}: arm.{key}: {len(values)} entries for {len(joints)} joints: {names}")
