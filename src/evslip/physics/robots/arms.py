"""Arms that are built in, from the URDFs of the package example-robot-data."""

import math
from pathlib import Path

from evslip.physics.robots.description import Arm, Servo

_QUARTER = math.pi / 2
# Stiff enough that the arm follows within micrometres once the command leads by damping / stiffness * velocity.
_STIFF = (*[(4500.0, 450.0)] * 2, *[(3500.0, 350.0)] * 2, *[(2000.0, 200.0)] * 3)


def servos_of(limits_n_m: tuple[float, ...]) -> tuple[Servo, ...]:
    """Servos of joints, from the base on, with these largest torques."""
    return tuple(Servo(*stiff, limit) for stiff, limit in zip(_STIFF, limits_n_m, strict=False))


PANDA = Arm(
    name="Panda",
    urdf=Path("panda_description/urdf/panda.urdf"),
    joints=tuple(f"panda_joint{i}" for i in range(1, 8)),
    flange="panda_link7",
    mount_m=(0.0, 0.0, 0.107),
    mount_rpy=(0.0, 0.0, -_QUARTER / 2),
    servos=servos_of((87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0)),
    rest_rad=(0.0, -0.25, 0.0, -2.35, 0.0, 2.1, 0.785),
    # Limits of the arm's joints (Franka Control Interface documentation, "Robot and interface specifications": the
    # Panda's limits in joint space). Those of position are in the URDF.
    most_speed_rad_s=(2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61),
    most_acceleration_rad_s2=(15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0),
    reach_m=(0.3, 0.7),
    left_out=("panda_hand",),
)
UR5 = Arm(
    name="UR5",
    urdf=Path("ur_description/urdf/ur5_robot.urdf"),
    joints=(
        *("shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint"),
        *("wrist_1_joint", "wrist_2_joint", "wrist_3_joint"),
    ),
    flange="wrist_3_link",
    mount_m=(0.0, 0.0823, 0.0),
    mount_rpy=(-_QUARTER, 0.0, 0.0),
    # Torques and speeds of the URDF; of accelerations it says nothing: an assumption.
    servos=servos_of((150.0, 150.0, 150.0, 28.0, 28.0, 28.0)),
    rest_rad=(-0.24, -1.64, 1.97, -1.9, -1.57, -1.81),
    most_speed_rad_s=(3.15, 3.15, 3.15, 3.2, 3.2, 3.2),
    most_acceleration_rad_s2=(15.0, 15.0, 15.0, 20.0, 20.0, 20.0),
    reach_m=(0.3, 0.75),
)
XARM7 = Arm(
    name="xArm7",
    urdf=Path("xarm_description/urdf/xarm7.urdf"),
    joints=tuple(f"joint{i}" for i in range(1, 8)),
    flange="link7",
    mount_m=(0.0, 0.0, 0.0),
    mount_rpy=(0.0, 0.0, 0.0),
    # As of the UR5.
    servos=servos_of((50.0, 50.0, 30.0, 30.0, 30.0, 20.0, 20.0)),
    rest_rad=(0.0, 0.02, 0.0, 0.91, 0.0, 0.89, 0.0),
    most_speed_rad_s=(3.14,) * 7,
    most_acceleration_rad_s2=(15.0,) * 7,
    reach_m=(0.25, 0.6),
)
ARMS: dict[str, Arm | None] = {"panda": PANDA, "cartesian": None, "ur5": UR5, "xarm7": XARM7}
"""By robot.kind. None: a cartesian hand."""
