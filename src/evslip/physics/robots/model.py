"""MuJoCo's bodies, joints and servos of a robot, without any geometry, weightless."""

from typing import Any

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from evslip.physics.robots.description import FINGER_Z_M, TCP_M, Arm, Gripper, Part, Robot, Servo, corners_of
from evslip.physics.robots.urdf import bare, chain

ARM_ARMATURE = 0.1
FINGER_STIFFNESS, FINGER_DAMPING = 4000.0, 60.0
FINGER_JOINT_DAMPING = 5.0
CARTESIAN_JOINTS = ("hand_x", "hand_y", "hand_z", "hand_tilt")
CARTESIAN_INERTIA = (100.0, 100.0, 100.0, 1.0)
"""In kg and kg m2: so heavy that nothing that it holds moves it."""
CARTESIAN_RATE_RAD_S = 200.0
"""Natural frequency of the critically damped servos."""
SPARE_M = 0.001
"""Fingers could open wider than their stroke by this, ..."""
THROUGH_M = 0.002
"""... and close by this beyond the middle."""


def spec_of(robot: Robot, grip_force_n: float) -> Any:
    """A mujoco.MjSpec of arm and hand, with servos on every joint.

    Each finger pushes with at most `grip_force_n`, so a finger that closes into an object presses with exactly that.
    """
    spec = _cartesian_hand(robot.gripper) if robot.arm is None else _with_arm(robot.arm, robot.gripper)
    add_finger_servos(spec, robot.gripper, grip_force_n)
    return spec


def _with_arm(arm: Arm, gripper: Gripper) -> Any:
    base = chain(arm.urdf, arm.joints)[0].name
    if gripper.urdf == arm.urdf:
        spec = mujoco.MjSpec.from_string(bare(arm.urdf, base))
    else:
        # The URDF's own hand, if it has one, makes room.
        spec = mujoco.MjSpec.from_string(bare(arm.urdf, base, arm.left_out))
        turn = Rotation.from_euler("xyz", arm.mount_rpy)
        place = np.array(arm.mount_m) + turn.apply([0.0, 0.0, gripper.length_m - TCP_M[2]])
        _add_boxes(spec, spec.body(arm.flange), gripper, place, turn.as_quat(scalar_first=True))
    _make_weightless(spec)
    for name, servo in zip(arm.joints, arm.servos, strict=True):
        spec.joint(name).armature = ARM_ARMATURE
        _add_servo(spec, name, servo)
    return spec


def _cartesian_hand(gripper: Gripper) -> Any:
    """The hand on three slides and a hinge: an ideal robot. Its joints are the tool centre's x, y, z and the tilt about
    the closing axis."""
    spec = hand(gripper)
    slide, hinge = mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE
    axes = np.diag([1, -1, -1])[[0, 1, 2, 1]]  # in the frame of the hand, which points down
    for name, kind, axis, inertia in zip(
        CARTESIAN_JOINTS, (slide, slide, slide, hinge), axes, CARTESIAN_INERTIA, strict=True
    ):
        spec.body(gripper.hand).add_joint(name=name, type=kind, axis=axis, pos=TCP_M, armature=inertia)
        rate = CARTESIAN_RATE_RAD_S
        _add_servo(spec, name, Servo(inertia * rate**2, 2 * inertia * rate, np.inf))
    return spec


def hand(gripper: Gripper) -> Any:
    """A mujoco.MjSpec of the hand alone, pointing down, its tool centre at the origin, without servos."""
    place, down = TCP_M, [0, 1, 0, 0]
    if gripper.urdf is None:
        spec = mujoco.MjSpec()
        _add_boxes(spec, spec.worldbody, gripper, place, down)
    else:
        spec = mujoco.MjSpec.from_string(bare(gripper.urdf, gripper.hand))
        spec.body(gripper.hand).pos, spec.body(gripper.hand).quat = place, down
    _make_weightless(spec)
    return spec


def _add_boxes(spec: Any, parent: Any, gripper: Gripper, place_m: Any, quat: Any) -> None:
    """Palm and fingers, with the inertia of their boxes, on a body."""
    palm = parent.add_body(name=gripper.hand, pos=place_m, quat=quat)
    _set_inertia(palm, gripper.palm)
    for name, joint, side, jaw in zip(gripper.fingers, gripper.finger_joints, (1, -1), gripper.jaws, strict=True):
        body = palm.add_body(name=name, pos=[0, 0, FINGER_Z_M])
        _set_inertia(body, jaw)
        body.add_joint(name=joint, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0, side, 0])
    # One drive moves both: otherwise what they hold could carry them along y, as their forces are limited.
    left, right = gripper.finger_joints
    joints = {"objtype": mujoco.mjtObj.mjOBJ_JOINT, "name1": right, "name2": left}
    coupling = spec.add_equality(type=mujoco.mjtEq.mjEQ_JOINT, **joints)
    coupling.data[:] = 0
    coupling.data[1] = 1


def _set_inertia(body: Any, part: Part) -> None:
    """Mass and inertia of a part as those of the box around it."""
    corners = corners_of(part.boxes)
    side = np.ptp(corners, axis=0)
    body.explicitinertial = True
    body.mass, body.ipos = part.mass_kg, (corners.min(axis=0) + corners.max(axis=0)) / 2
    body.inertia = part.mass_kg / 12 * (side @ side - side**2)


def _make_weightless(spec: Any) -> None:
    for body in spec.bodies[1:]:
        body.gravcomp = 1


def add_finger_servos(spec: Any, gripper: Gripper, grip_force_n: float) -> None:
    """Let each finger push with at most `grip_force_n`."""
    for name in gripper.finger_joints:
        joint = spec.joint(name)
        joint.damping[0] = FINGER_JOINT_DAMPING
        joint.armature = 0.1
        joint.range = [-THROUGH_M, gripper.stroke_m + SPARE_M]
        _add_servo(spec, name, Servo(FINGER_STIFFNESS, FINGER_DAMPING, grip_force_n))


def _add_servo(spec: Any, joint: str, servo: Servo) -> None:
    kinds = {"gaintype": mujoco.mjtGain.mjGAIN_FIXED, "biastype": mujoco.mjtBias.mjBIAS_AFFINE}
    actuator = spec.add_actuator(name=joint, target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT, **kinds)
    actuator.gainprm[0] = servo.stiffness
    actuator.biasprm[:3] = [0, -servo.stiffness, -servo.damping]
    actuator.forcelimited = int(np.isfinite(servo.limit))
    if actuator.forcelimited:
        actuator.forcerange = [-servo.limit, servo.limit]
    actuator.ctrllimited = 0
