"""An arm of an MJCF as a URDF: its bodies, hinges, inertias and geoms."""

import copy
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from evslip.physics.robots.own_files import require_mesh
from evslip.utils.errors import ConfigError

KEPT = ("compiler", "default", "asset", "worldbody", "actuator")
"""All that says something of an arm."""
ASSETS = ("mesh", "material")
LAST_SEEN = 2
"""Geoms of the groups up to this one are seen in MuJoCo's viewers, by default."""
UNSAID = (0.5, 0.5, 0.5, 1.0)
"""Colour of geoms that say none."""


def as_urdf(root: ET.Element, path: Path) -> ET.Element:
    """Root of a URDF that has the bodies of an MJCF as links, whose joints lie at the links' origins; root: the MJCF's.
    Raises ConfigError for one that MuJoCo does not take, or that says more than a URDF can."""
    spec, model = _compiled(root, path)
    robot = ET.Element("robot", name="mjcf")
    ET.SubElement(robot, "link", name="world")
    names = [_name(model, mujoco.mjtObj.mjOBJ_BODY, body, "body") for body in range(model.nbody)]
    anchors = np.zeros((model.nbody, 3))  # of the links, in the frames of their bodies
    for body in range(1, model.nbody):
        count = model.body_jntnum[body]
        if count > 1:
            raise ConfigError(f"{path}: body {names[body]!r} has {count} joints; expected at most one, as in a URDF")
        joint = int(model.body_jntadr[body]) if count else None
        if joint is not None:
            _require_no_ref(model, joint, path)
            anchors[body] = model.jnt_pos[joint]
        link = ET.SubElement(robot, "link", name=names[body])
        _add_inertia(link, model, body, anchors[body])
        for geom in np.flatnonzero(model.geom_bodyid == body):
            _add_geom(link, spec, model, int(geom), anchors[body], path)
        _add_joint(robot, model, body, joint, names, anchors)
    return robot


def _compiled(root: ET.Element, path: Path) -> tuple[mujoco.MjSpec, mujoco.MjModel]:
    root = copy.deepcopy(root)
    if next(root.iter("include"), None) is not None:
        raise ConfigError(f"{path}: has an <include>; write it as one file, as MuJoCo's mj_saveLastXML does")
    for part in [part for part in root if part.tag not in KEPT]:
        root.remove(part)
    for actuators in root.findall("actuator"):  # those of tendons and sites, which are not kept, would lead nowhere
        for actuator in [actuator for actuator in actuators if "joint" not in actuator.attrib]:
            actuators.remove(actuator)
    for assets in root.findall("asset"):
        for asset in [asset for asset in assets if asset.tag not in ASSETS]:
            assets.remove(asset)
        for material in assets.findall("material"):
            material.attrib.pop("texture", None)
    for body in root.iter():  # what is seen alone is not simulated
        for part in [part for part in body if part.tag in ("camera", "light", "site") and body.tag != "default"]:
            body.remove(part)
    compilers = root.findall("compiler") or [ET.SubElement(root, "compiler")]
    for compiler in compilers:
        folder = compiler.attrib.get("meshdir", compiler.attrib.get("assetdir", "."))
        compiler.attrib["meshdir"] = str((path.parent / folder).resolve())
    for mesh in root.findall("asset/mesh"):
        if "file" not in mesh.attrib:
            raise ConfigError(f"{path}: mesh {mesh.attrib.get('name')!r} has no file")
        require_mesh(Path(compilers[-1].attrib["meshdir"]) / mesh.attrib["file"], f"{path}: mesh")
    try:
        spec = mujoco.MjSpec.from_string(ET.tostring(root, encoding="unicode"))
        return spec, spec.compile()
    except ValueError as error:
        raise ConfigError(f"{path}: MuJoCo says: {' '.join(str(error).split())[:200]}") from None


def _require_no_ref(model: mujoco.MjModel, joint: int, path: Path) -> None:
    """Raise ConfigError for a hinge or a slide that is not at 0 where the bodies are as they are drawn."""
    kind, start = mujoco.mjtJoint(int(model.jnt_type[joint])), float(model.qpos0[model.jnt_qposadr[joint]])
    if kind not in (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE) or start == 0:
        return
    name = _name(model, mujoco.mjtObj.mjOBJ_JOINT, joint, "joint")
    unit = "rad" if kind == mujoco.mjtJoint.mjJNT_HINGE else "m"
    raise ConfigError(
        f"{path}: joint {name!r} has a ref of {start:.4g} {unit}; expected 0, as in a URDF: take it off "
        "the joint's range and, of an arm, off arm.rest_deg"
    )


def _name(model: mujoco.MjModel, kind: Any, number: int, usual: str) -> str:
    return mujoco.mj_id2name(model, kind, number) or f"{usual}{number}"


def _text(numbers: Any) -> str:
    return " ".join(repr(float(number)) for number in numbers)


def _add_origin(part: ET.Element, place: np.ndarray, quat: np.ndarray) -> None:
    turn = Rotation.from_quat(quat, scalar_first=True)
    # A matrix near the gimbal lock still has exact angles: scipy then sets one of them to zero.
    ET.SubElement(part, "origin", xyz=_text(place), rpy=_text(turn.as_euler("xyz")))


def _add_inertia(link: ET.Element, model: mujoco.MjModel, body: int, anchor: np.ndarray) -> None:
    if model.body_mass[body] <= 0:
        return
    inertial = ET.SubElement(link, "inertial")
    _add_origin(inertial, model.body_ipos[body] - anchor, model.body_iquat[body])
    ET.SubElement(inertial, "mass", value=repr(float(model.body_mass[body])))
    names, diagonal = ("ixx", "iyy", "izz"), model.body_inertia[body]
    moments = {name: repr(float(moment)) for name, moment in zip(names, diagonal, strict=True)}
    ET.SubElement(inertial, "inertia", {**moments, "ixy": "0", "ixz": "0", "iyz": "0"})


def _as_in_file(
    spec: mujoco.MjSpec, model: mujoco.MjModel, geom: int, path: Path
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Place, quaternion and factors along its axes by which the file of a geom's mesh becomes that mesh."""
    mesh = int(model.geom_dataid[geom])
    given, scale = spec.meshes[mesh], model.mesh_scale[mesh]
    # MuJoCo has moved the mesh to its middle and principal axes: back to those that it had before.
    turn = Rotation.from_quat(model.geom_quat[geom], scalar_first=True)
    turn = turn * Rotation.from_quat(model.mesh_quat[mesh], scalar_first=True).inv()
    ref = Rotation.from_quat(given.refquat, scalar_first=True).inv()
    place = model.geom_pos[geom] - turn.apply(model.mesh_pos[mesh] + scale * ref.apply(given.refpos))
    if ref.magnitude() == 0:
        return place, turn.as_quat(scalar_first=True), scale
    # MuJoCo scales along the axes that the refquat leads to, a URDF along those of the file.
    matrix = scale[:, None] * ref.as_matrix()
    factors = np.linalg.norm(matrix, axis=0)
    factors[0] *= np.sign(np.linalg.det(matrix))
    own = matrix / factors
    if not np.allclose(own.T @ own, np.eye(3), atol=1e-6):
        name = _name(model, mujoco.mjtObj.mjOBJ_MESH, mesh, "mesh")
        raise ConfigError(
            f"{path}: mesh {name!r} has a refquat and a scale that differs along its axes, {_text(scale)}; expected "
            "one of the two, or a scale that is the same along all"
        )
    return place, (turn * Rotation.from_matrix(own)).as_quat(scalar_first=True), factors


def _add_geom(
    link: ET.Element, spec: mujoco.MjSpec, model: mujoco.MjModel, geom: int, anchor: np.ndarray, path: Path
) -> None:
    """Geometry that is seen, and, where something may touch it, a collision shape."""
    kind, size = mujoco.mjtGeom(int(model.geom_type[geom])), model.geom_size[geom]
    place, quat = model.geom_pos[geom], model.geom_quat[geom]
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = int(model.geom_dataid[geom])
        place, quat, scale = _as_in_file(spec, model, geom, path)
        start = int(model.mesh_pathadr[mesh])
        file = model.paths[start : model.paths.index(b"\0", start)].decode()
        folder = path.parent
        shape = ("mesh", {"filename": str(folder / file), "scale": _text(scale)})
    elif kind in (mujoco.mjtGeom.mjGEOM_BOX, mujoco.mjtGeom.mjGEOM_ELLIPSOID):
        shape = ("box", {"size": _text(2 * size)})
    elif kind in (mujoco.mjtGeom.mjGEOM_CYLINDER, mujoco.mjtGeom.mjGEOM_CAPSULE):
        round_ends = size[0] if kind == mujoco.mjtGeom.mjGEOM_CAPSULE else 0.0
        shape = ("cylinder", {"radius": repr(float(size[0])), "length": repr(float(2 * (size[1] + round_ends)))})
    elif kind == mujoco.mjtGeom.mjGEOM_SPHERE:
        shape = ("sphere", {"radius": repr(float(size[0]))})
    else:
        return  # planes and height fields are no part of an arm
    material, rgba = int(model.geom_matid[geom]), model.geom_rgba[geom]
    if material >= 0 and np.array_equal(rgba, UNSAID):  # a geom's own colour goes before its material's
        rgba = model.mat_rgba[material]
    seen = model.geom_group[geom] <= LAST_SEEN and rgba[3] > 0
    touches = model.geom_contype[geom] or model.geom_conaffinity[geom]
    for role in [role for role, has in (("visual", seen), ("collision", touches)) if has]:
        part = ET.SubElement(link, role)
        _add_origin(part, place - anchor, quat)
        ET.SubElement(ET.SubElement(part, "geometry"), *shape)
        if role == "visual":
            ET.SubElement(ET.SubElement(part, "material", name=""), "color", rgba=_text(rgba))


def _add_joint(
    robot: ET.Element, model: mujoco.MjModel, body: int, joint: int | None, names: list[str], anchors: np.ndarray
) -> None:
    parent, fixed = int(model.body_parentid[body]), joint is None
    hinge = not fixed and model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_HINGE
    slide = not fixed and model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_SLIDE
    kind = "revolute" if hinge else "prismatic" if slide else "fixed" if fixed else "floating"
    if hinge and not model.jnt_limited[joint]:
        kind = "continuous"
    name = f"{names[body]}_fixed" if joint is None else _name(model, mujoco.mjtObj.mjOBJ_JOINT, joint, "joint")
    part = ET.SubElement(robot, "joint", name=name, type=kind)
    turn = Rotation.from_quat(model.body_quat[body], scalar_first=True)
    _add_origin(part, model.body_pos[body] + turn.apply(anchors[body]) - anchors[parent], model.body_quat[body])
    ET.SubElement(part, "parent", link=names[parent])
    ET.SubElement(part, "child", link=names[body])
    if joint is None:
        return
    ET.SubElement(part, "axis", xyz=_text(model.jnt_axis[joint]))
    low, high = map(float, model.jnt_range[joint])
    ET.SubElement(part, "limit", lower=repr(low), upper=repr(high), effort=repr(_torque(model, joint)), velocity="0")


def _torque(model: mujoco.MjModel, joint: int) -> float:
    """Largest torque on a joint, of its own or of its actuator; 0 where the MJCF limits none."""
    if model.jnt_actfrclimited[joint]:
        return float(np.abs(model.jnt_actfrcrange[joint]).max())
    for actuator in np.flatnonzero(model.actuator_trnid[:, 0] == joint):
        if model.actuator_trntype[actuator] == mujoco.mjtTrn.mjTRN_JOINT and model.actuator_forcelimited[actuator]:
            return float(np.abs(model.actuator_forcerange[actuator]).max() * abs(model.actuator_gear[actuator, 0]))
    return 0.0
