"""The physical scene: the Panda, a cuboid on a surface, and the contacts between them."""

from typing import Any

import mujoco
import numpy as np

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


def build(params: Params) -> mujoco.MjModel:
    """The model of one sample. Sensors report poses, joints and contact forces; see `split_sensors`."""
    spec = panda(params.grip.force_n)
    assemble(spec, params)
    return spec.compile()


def assemble(spec: Any, params: Params) -> None:
    """Give a robot its pads, and its world the object and the surface."""
    _set_solver(spec)
    _add_object(spec, params)
    _add_pads(spec, params)
    _add_sensors(spec)


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
            _add_force_sensor(spec, f"{finger}_pad{i}", OBJECT, reduce=1)
    _add_force_sensor(spec, OBJECT, SURFACE, reduce=3)


def _add_force_sensor(spec: Any, geom: str, other: str, reduce: int) -> None:
    """Force of one contact in its frame, normal first (reduce=1), or of all contacts in the world frame (reduce=3)."""
    kind = mujoco.mjtObj.mjOBJ_GEOM
    force_only = 1 << 1
    spec.add_sensor(
        type=mujoco.mjtSensor.mjSENS_CONTACT, objtype=kind, objname=geom, reftype=kind, refname=other,
        intprm=[force_only, reduce, 1],
    )  # fmt: skip


def split_sensors(data: np.ndarray) -> tuple[np.ndarray, ...]:
    """Columns of sensor data (n, 50) as gripper pose (n, 7), object pose (n, 7), joints (n, 9), pad forces (n, 2) and
    floor force (n,), in the order of `_add_sensors`."""
    gripper, obj, joints, pads, floor = np.split(data, np.cumsum([7, 7, 9, 2 * PAD_POINTS * 3]), axis=1)
    normal = np.abs(pads.reshape(len(data), 2, PAD_POINTS, 3)[..., 0]).sum(2)
    return gripper, obj, joints, normal, np.abs(floor[:, 2])
