"""The physical scene: the robot, an object on a surface, and the contacts between them."""

from typing import Any

import mujoco
import numpy as np

from evslip.config.params import Params
from evslip.physics.contact import Patch
from evslip.physics.grip import grasp
from evslip.physics.inertia import inertia_kg_m2
from evslip.physics.robots.catalogue import robot_of
from evslip.physics.robots.description import FINGER_Z_M, TCP_M
from evslip.physics.robots.model import spec_of
from evslip.physics.trajectory import rotation_of, rounded
from evslip.scene.shapes import shape_of
from evslip.scene.shapes.shape import Shape
from evslip.utils.errors import ConfigError

TIMESTEP_S = 0.001
OBJECT, SURFACE = "object", "surface"
PAD_RADIUS_M = 0.004
PAD_GIVE_M = 0.0004
"""Depth by which a pad gives under the grip force, whatever that is: so far that an object which stands a little askew
hardly changes how the points share the force."""
PAD_RELAXATION_S = 0.0005
"""Damping of a pad's give, over its stiffness."""
PAD_SLACK_M_S2 = 2000.0
"""Grip force times the regularisation of the pads' normal forces (MuJoCo's R, in 1/kg): large against what sliding
adds to the normal forces in MuJoCo's cone, see docs/explanation/physics.md."""
LEAST_FORCE_N = 1e-3
"""Pads that press with less are as soft as under this force."""
STICK_DAMPING_HZ = 1e5
"""Friction damping while a contact sticks: stops what an arm drifts against the object within one step."""
SLAB_M = 0.004
"""Thickness of the flat pieces that the pads press on."""
SURFACE_FRICTION = 0.15
"""Low, so that an object gripped off its centre slides when the fingers close instead of tipping."""
GRAVITY_M_S2 = 9.81
IN_PAIRS = {"mass": 0, "contype": 0, "conaffinity": 0}
"""A geom that weighs nothing and touches only what it is paired with."""
FORCE, PLACE, NORMAL, TANGENT = (1 << bit for bit in (1, 4, 5, 6))
"""Bits that ask a contact sensor for them."""
FORCE_BITS, TORQUE_BITS = 10, 20
"""Friction is kept to 1 mN, its torque to 1 micronewton metre."""


def build(params: Params) -> mujoco.MjModel:
    """The model of one sample. Sensors report poses, joints and contact forces; see `split_sensors`."""
    try:
        return assemble(spec_of(robot_of(params.robot), params.grip.force_n), params)
    except ValueError as error:
        if not params.robot.is_file:
            raise
        reason = " ".join(str(error).split())[:200]
        raise ConfigError(f"{params.robot.kind}: MuJoCo does not take this robot: {reason}") from None


def assemble(robot: Any, params: Params) -> mujoco.MjModel:
    """The model of a robot (a mujoco.MjSpec, which this changes) with its pads, the object and the surface."""
    _set_solver(robot)
    _add_object(robot, params)
    _add_pads(robot, params)
    _add_sensors(robot, params)
    model = robot.compile()
    set_compliance(model, params.grip.force_n)
    return model


def _set_solver(spec: Any) -> None:
    # Settings under which a held object does not creep. Static creep is proportional to 1 / impratio; the discrete
    # integrator keeps stick where implicitfast with stiff servos breaks it.
    option = spec.option
    option.timestep = TIMESTEP_S
    option.gravity = [0, 0, -GRAVITY_M_S2]
    option.integrator = mujoco.mjtIntegrator.mjINT_DISCRETE
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.impratio = 3e5
    option.solver = mujoco.mjtSolver.mjSOL_NEWTON
    option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    option.iterations = 100
    option.tolerance = 1e-8
    option.noslip_iterations = 0


def _add_object(spec: Any, params: Params) -> None:
    obj, error, shape = params.object, params.grip, shape_of(params)
    yaw = np.radians(error.error_yaw_deg) / 2
    place = [obj.x_m + error.error_x_m, obj.y_m + error.error_y_m, shape.half_m[2]]
    body = spec.worldbody.add_body(name=OBJECT, pos=place, quat=[np.cos(yaw), 0, 0, np.sin(yaw)])
    body.add_freejoint(name=OBJECT)
    inertia = inertia_kg_m2(params)
    body.explicitinertial = True
    body.mass, body.ipos = obj.mass_kg, shape.centre_of_mass_m()
    body.fullinertia = [*np.diag(inertia), inertia[0, 1], inertia[0, 2], inertia[1, 2]]
    friction = [params.grip.friction, 0.005, 1e-4]
    touches = {"contype": 2, "conaffinity": 1, "condim": 3, "friction": friction, "solref": [0.01, 1]}
    body.add_geom(name=OBJECT, mass=0, **_collision_geom(spec, shape), **touches)
    # With priority, as otherwise the larger friction of the two would count.
    friction = [SURFACE_FRICTION, 0.005, 1e-4]
    touches = {"contype": 1, "conaffinity": 2, "condim": 3, "friction": friction, "priority": 1}
    spec.worldbody.add_geom(name=SURFACE, type=mujoco.mjtGeom.mjGEOM_PLANE, size=[3, 3, 0.1], **touches)


def _collision_geom(spec: Any, shape: Shape) -> dict[str, Any]:
    """Attributes of a geom that make it the body that the table feels."""
    collision = shape.collision_shape()
    if collision.kind == "hull":
        spec.add_mesh(name=OBJECT, uservert=collision.vertices.ravel())
        return {"type": mujoco.mjtGeom.mjGEOM_MESH, "meshname": OBJECT}
    if collision.kind == "cylinder":
        return {"type": mujoco.mjtGeom.mjGEOM_CYLINDER, "size": [collision.half_m[1], collision.half_m[2], 0]}
    return {"type": mujoco.mjtGeom.mjGEOM_BOX, "size": collision.half_m}


def _add_pads(spec: Any, params: Params) -> None:
    friction = params.grip.friction
    for finger, side, pad in zip(_fingers(params), (1, -1), grasp(params).pads, strict=True):
        face = _face(spec, finger, side, pad)
        for i, (x, z_up) in enumerate(pad.contacts):
            name = f"{finger}_pad{i}"
            place = [x, side * (PAD_RADIUS_M - PAD_GIVE_M), TCP_M[2] - FINGER_Z_M - z_up]
            sphere = {"type": mujoco.mjtGeom.mjGEOM_SPHERE, "size": [PAD_RADIUS_M, 0, 0], **IN_PAIRS}
            spec.body(finger).add_geom(name=name, pos=place, **sphere)
            spec.add_pair(geomname1=name, geomname2=face, condim=3, friction=[friction, friction, 0.0065, 1e-4, 1e-4])


def _fingers(params: Params) -> tuple[str, str]:
    return robot_of(params.robot).gripper.fingers


def _face(spec: Any, finger: str, side: int, pad: Patch) -> str:
    """The geom that a pad touches: the object itself, or a thin box that is put where it presses on it."""
    if pad.slab is not None:
        (x, z), (half_x, half_z) = pad.slab.mean(axis=0), np.diff(pad.slab, axis=0)[0] / 2
        place = [x, -side * (pad.face_m - SLAB_M / 2), z]
        box = {"type": mujoco.mjtGeom.mjGEOM_BOX, "size": [half_x, SLAB_M / 2, half_z], **IN_PAIRS}
        spec.body(OBJECT).add_geom(name=_face_name(finger, pad), pos=place, **box)
    return _face_name(finger, pad)


def _face_name(finger: str, pad: Patch) -> str:
    return OBJECT if pad.slab is None else f"{OBJECT}_{finger}"


def set_compliance(model: mujoco.MjModel, force_n: float) -> None:
    """Make every pad contact a spring and damper that carries its share of the grip force at PAD_GIVE_M, so that a pad
    gives by that under any force and a change of the force moves no finger.

    MuJoCo's contact force f obeys R f = -(a + b v + k r), so its spring is k / R and its damper b / R. R itself follows
    from the impedance d and the inverse masses A by R = A (1 - d) / d.
    """
    regularisation = PAD_SLACK_M_S2 / max(force_n, LEAST_FORCE_N)
    stiffness = PAD_SLACK_M_S2 / (pad_points(model) * PAD_GIVE_M)
    touching = model.geom_bodyid[[model.pair_geom1[0], model.pair_geom2[0]]]
    inverse_mass = model.body_invweight0[touching, 0].sum()
    impedance = inverse_mass / (inverse_mass + regularisation)
    model.pair_solimp[:, :2] = impedance
    model.pair_solref[:] = -impedance * stiffness * np.array([1, PAD_RELAXATION_S])
    model.pair_solreffriction[:] = -1, -impedance * STICK_DAMPING_HZ


def _add_sensors(spec: Any, params: Params) -> None:
    sensor, kind = mujoco.mjtSensor, mujoco.mjtObj
    for body in (robot_of(params.robot).gripper.hand, OBJECT):
        spec.add_sensor(type=sensor.mjSENS_FRAMEPOS, objtype=kind.mjOBJ_XBODY, objname=body)
        spec.add_sensor(type=sensor.mjSENS_FRAMEQUAT, objtype=kind.mjOBJ_XBODY, objname=body)
    for joint in [j.name for j in spec.joints if j.name != OBJECT]:
        spec.add_sensor(type=sensor.mjSENS_JOINTPOS, objtype=kind.mjOBJ_JOINT, objname=joint)
    for finger, pad in zip(_fingers(params), grasp(params).pads, strict=True):
        for i in range(len(pad.contacts)):
            face, name = _face_name(finger, pad), f"{finger}_pad{i}"
            _add_force_sensor(spec, name, face, reduce=1, data=FORCE | PLACE | NORMAL | TANGENT)
    _add_force_sensor(spec, OBJECT, SURFACE, reduce=3)


def _add_force_sensor(spec: Any, geom: str, other: str, reduce: int, data: int = FORCE) -> None:
    """Sensor of one contact (reduce=1), forces in its frame, or of all contacts in the world frame (3)."""
    kind = mujoco.mjtObj.mjOBJ_GEOM
    between = {"objtype": kind, "objname": geom, "reftype": kind, "refname": other}
    spec.add_sensor(type=mujoco.mjtSensor.mjSENS_CONTACT, intprm=[data, reduce, 1], **between)


def pad_points(model: mujoco.MjModel) -> int:
    """Number of the points that stand for a pad."""
    return model.npair // 2


def split_sensors(data: np.ndarray, points: int) -> tuple[np.ndarray, ...]:
    """Columns of sensor data as gripper pose (n, 7), object pose (n, 7), joints (n, k), the pads' normal forces (n, 2),
    floor force (n,), and the pads' friction (n, 2, 3): see Trajectory.

    points: number of points that stand for a pad."""
    gripper, obj, joints, pads, floor = np.split(data, [7, 14, -(2 * points * 12 + 3), -3], axis=1)
    force, place, normal, tangent = np.moveaxis(pads.reshape(len(data), 2, points, 4, 3), 3, 0)
    wrench = _in_hand_plane(gripper, place, force[..., 1:2] * tangent + force[..., 2:] * np.cross(normal, tangent))
    return gripper, obj, joints, np.abs(force[..., 0]).sum(2), np.abs(floor[:, 2]), wrench


def _in_hand_plane(gripper: np.ndarray, place: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Wrenches (n, 2, 3) in the plane of the pads of forces at places (n, 2, points, 3) in the world."""
    hand = rotation_of(gripper).as_matrix().astype(np.float32)
    place = (place - gripper[:, None, None, :3]) @ hand[:, None] - TCP_M.astype(np.float32)
    force = force @ hand[:, None]
    x, up, along, upward = place[..., 0], -place[..., 2], force[..., 0], -force[..., 2]
    torque = (up * along - x * upward).sum(2)
    forces = np.stack([along.sum(2), upward.sum(2)], axis=-1)
    return np.concatenate([rounded(forces, FORCE_BITS), rounded(torque, TORQUE_BITS)[..., None]], axis=-1)
