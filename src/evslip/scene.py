"""The physical scene: the Panda, a cuboid on a surface, and the contacts between them."""

from typing import Any

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from evslip.grip import TCP_M, contact_points
from evslip.params import Params
from evslip.robot import FINGERS, HAND, panda

TIMESTEP_S = 0.001
OBJECT, SURFACE = "object", "surface"
PAD_POINTS = 4
PAD_RADIUS_M = 0.004
FINGER_Z_M = 0.0584
"""Origin of the finger frames in the hand frame."""
SURFACE_FRICTION = 0.15
"""Low, so that an object gripped off its centre slides when the fingers close instead of tipping."""
GRAVITY_M_S2 = 9.81
FORCE, PLACE, NORMAL, TANGENT = (1 << bit for bit in (1, 4, 5, 6))
"""What a contact sensor can report."""
FORCE_BITS, TORQUE_BITS, UTILISATION_BITS = 10, 20, 10
"""Forces are kept to 1 mN, torques to 1 micronewton metre, the utilisation to 0.001."""


def build(params: Params) -> mujoco.MjModel:
    """The model of one sample. Sensors report poses, joints and contact forces; see `sensor_columns`."""
    spec = panda(params.grip.force_n)
    _set_solver(spec)
    _add_object(spec, params)
    _add_pads(spec, params)
    _add_sensors(spec)
    return spec.compile()


def _set_solver(spec: Any) -> None:
    # Settings under which a held object does not creep. Static creep is proportional to 1 / impratio; the discrete
    # integrator keeps stick where implicitfast with stiff servos breaks it.
    option = spec.option
    option.timestep = TIMESTEP_S
    option.gravity = [0, 0, -GRAVITY_M_S2]
    option.integrator = mujoco.mjtIntegrator.mjINT_DISCRETE
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.impratio = 1000
    option.solver = mujoco.mjtSolver.mjSOL_NEWTON
    option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    option.iterations = 100
    option.tolerance = 1e-8
    option.noslip_iterations = 0


def _add_object(spec: Any, params: Params) -> None:
    shape = params.object
    half = np.array([shape.width_m, shape.depth_m, shape.height_m]) / 2
    body = spec.worldbody.add_body(name=OBJECT, pos=[shape.x_m, shape.y_m, half[2]])
    body.add_freejoint(name=OBJECT)
    body.add_geom(
        name=OBJECT, type=mujoco.mjtGeom.mjGEOM_BOX, size=half, mass=shape.mass_kg,
        contype=2, conaffinity=1, condim=3, friction=[params.grip.friction, 0.005, 1e-4], solref=[0.01, 1],
    )  # fmt: skip
    spec.worldbody.add_geom(
        name=SURFACE, type=mujoco.mjtGeom.mjGEOM_PLANE, size=[3, 3, 0.1],
        contype=1, conaffinity=2, condim=3, friction=[SURFACE_FRICTION, 0.005, 1e-4],
        priority=1,  # otherwise the larger friction of the two would count
    )  # fmt: skip


def _add_pads(spec: Any, params: Params) -> None:
    friction = params.grip.friction
    for finger, side in zip(FINGERS, (1, -1), strict=True):
        for i, (x, z_up) in enumerate(contact_points(params)):
            name = f"{finger}_pad{i}"
            spec.body(finger).add_geom(
                name=name, type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[PAD_RADIUS_M, 0, 0], mass=0,
                pos=[x, side * PAD_RADIUS_M, TCP_M[2] - FINGER_Z_M - z_up], contype=0, conaffinity=0,
            )  # fmt: skip
            # The soft normal forgives the arm's tiny drift against the object, which a stiff one answers by unloading
            # the pad corner by corner; the stiff friction damping keeps that drift from becoming creep.
            spec.add_pair(
                geomname1=name, geomname2=OBJECT, condim=3, friction=[friction, friction, 0.0065, 1e-4, 1e-4],
                solref=[0.03, 1], solreffriction=[-1, -1e4], solimp=[0.95, 0.99, 0.001, 0.5, 2],
            )  # fmt: skip


def _add_sensors(spec: Any) -> None:
    sensor, kind = mujoco.mjtSensor, mujoco.mjtObj
    for body in (HAND, OBJECT):
        spec.add_sensor(type=sensor.mjSENS_FRAMEPOS, objtype=kind.mjOBJ_XBODY, objname=body)
        spec.add_sensor(type=sensor.mjSENS_FRAMEQUAT, objtype=kind.mjOBJ_XBODY, objname=body)
    for joint in [j.name for j in spec.joints if j.name != OBJECT]:
        spec.add_sensor(type=sensor.mjSENS_JOINTPOS, objtype=kind.mjOBJ_JOINT, objname=joint)
    for finger in FINGERS:
        for i in range(PAD_POINTS):
            _add_force_sensor(spec, f"{finger}_pad{i}", OBJECT, reduce=1, data=FORCE | PLACE | NORMAL | TANGENT)
    _add_force_sensor(spec, OBJECT, SURFACE, reduce=3)


def _add_force_sensor(spec: Any, geom: str, other: str, reduce: int, data: int = FORCE) -> None:
    """What `data` says of one contact (reduce=1), forces in its frame, or of all contacts in the world frame (3)."""
    kind = mujoco.mjtObj.mjOBJ_GEOM
    spec.add_sensor(
        type=mujoco.mjtSensor.mjSENS_CONTACT, objtype=kind, objname=geom, reftype=kind, refname=other,
        intprm=[data, reduce, 1],
    )  # fmt: skip


def split_sensors(data: np.ndarray, friction: float) -> tuple[np.ndarray, ...]:
    """Columns of sensor data (n, 122) as gripper pose (n, 7), object pose (n, 7), joints (n, 9), normal forces of the
    pads (n, 2), floor force (n,), and the pads' friction (n, 2, 3) and its utilisation (n, 2): see Trajectory."""
    gripper, obj, joints, pads, floor = np.split(data, np.cumsum([7, 7, 9, 2 * PAD_POINTS * 12]), axis=1)
    force, place, normal, tangent = np.moveaxis(pads.reshape(len(data), 2, PAD_POINTS, 4, 3), 3, 0)
    pressing = np.abs(force[..., 0])
    available = friction * pressing.sum(2)
    used = np.hypot(force[..., 1], force[..., 2]).sum(2)
    utilisation = np.divide(used, available, out=np.zeros_like(used), where=available > 0)
    wrench = _in_hand_plane(gripper, place, force[..., 1:2] * tangent + force[..., 2:] * np.cross(normal, tangent))
    return gripper, obj, joints, pressing.sum(2), np.abs(floor[:, 2]), wrench, rounded(utilisation, UTILISATION_BITS)


def _in_hand_plane(gripper: np.ndarray, place: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Wrenches (n, 2, 3) in the plane of the pads of forces at places (n, 2, PAD_POINTS, 3) in the world."""
    hand = Rotation.from_quat(gripper[:, 3:], scalar_first=True).as_matrix().astype(np.float32)
    place = (place - gripper[:, None, None, :3]) @ hand[:, None] - TCP_M.astype(np.float32)
    force = force @ hand[:, None]
    x, up, along, upward = place[..., 0], -place[..., 2], force[..., 0], -force[..., 2]
    torque = (up * along - x * upward).sum(2)
    forces = np.stack([along.sum(2), upward.sum(2)], axis=-1)
    return np.concatenate([rounded(forces, FORCE_BITS), rounded(torque, TORQUE_BITS)[..., None]], axis=-1)


def rounded(values: np.ndarray, bits: int) -> np.ndarray:
    """Values to the nearest 2**-bits: what lies beyond any use would only make records large."""
    return (np.round(values * 2.0**bits) / 2.0**bits).astype(np.float32)
