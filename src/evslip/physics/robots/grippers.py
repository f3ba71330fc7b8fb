"""Grippers that are built in: the Panda's hand, and a parallel gripper made of numbers."""

import math
from pathlib import Path

from evslip.physics.robots.description import FINGER_Z_M, TCP_M, Box, Gripper, Look, Part

_TILTED = ((1.0, 0.0, 0.0), (0.0, math.cos(math.pi / 6), -0.5), (0.0, 0.5, math.cos(math.pi / 6)))
_PALM = Box((0.0, 0.0, 0.030), (0.0215, 0.1, 0.035))
PANDA_HAND = Gripper(
    name="panda",
    # The palm, the flange above it, and three boxes a finger: fitted to slices of the meshes.
    palm=Part(
        (_PALM, Box((0.0, 0.0, -0.055), (0.04, 0.04, 0.05))),
        _PALM,
        (Look(Path("panda_description/meshes/visual/hand.dae")),),
        Path("panda_description/meshes/collision/hand.stl"),
    ),
    finger=Part(
        (
            Box((0.0, 0.0184, 0.010), (0.0105, 0.0069, 0.010)),
            Box((0.0, 0.0159, 0.02835), (0.00875, 0.0035, 0.01175), _TILTED),
            Box((0.0, 0.0072, 0.045), (0.009, 0.0072, 0.009)),
        ),
        Box((0.0, 0.0115, 0.027), (0.0098, 0.0115, 0.027)),
        (Look(Path("panda_description/meshes/visual/finger.dae")),),
        Path("panda_description/meshes/collision/finger.stl"),
    ),
    pad_half_m=0.0085,
    stroke_m=0.039,
    most_n=70.0,
    length_m=float(TCP_M[2]),
    hand="panda_hand",
    fingers=("panda_leftfinger", "panda_rightfinger"),
    finger_joints=("panda_finger_joint1", "panda_finger_joint2"),
    urdf=Path("panda_description/urdf/panda.urdf"),
)
METAL, JAW, RUBBER = 0.45, 0.6, 0.08
"""Albedos of the parallel gripper's palm, jaws and pads."""
PAD_M = 0.002
"""Thickness of its rubber pads."""
DENSITY_KG_M3 = 1500.0
"""Density of all that it is made of: an assumption, aluminium with motors and room between."""


def parallel_gripper(
    name: str, *, pad_half_m: float, stroke_m: float, palm_m: tuple[float, float, float], jaw_m: float, most_n: float
) -> Gripper:
    """A palm, two jaws and their rubber pads, all of them boxes.

    palm_m: sides of the palm along x, y and z; jaw_m: thickness of a jaw behind its pad, along y."""
    width, depth, height = palm_m
    tool = float(TCP_M[2]) - FINGER_Z_M  # of the pad in the frame of the finger
    clear = 2.5 * pad_half_m + 0.018  # from the palm to the tool centre: the object has room between the jaws
    floor = float(TCP_M[2]) - clear
    palm = Box((0.0, 0.0, floor - height / 2), (width / 2, depth / 2, height / 2), albedo=METAL)
    adapter = Box((0.0, 0.0, floor - height - 0.01), (0.03, 0.03, 0.01), albedo=METAL)
    low = tool + pad_half_m
    jaw = Box(
        (0.0, PAD_M + jaw_m / 2, (floor - FINGER_Z_M + low) / 2),
        (pad_half_m, jaw_m / 2, (low - floor + FINGER_Z_M) / 2),
        albedo=JAW,
    )
    pad = Box((0.0, PAD_M / 2, tool), (pad_half_m, PAD_M / 2, pad_half_m), albedo=RUBBER)
    whole = Box(
        (0.0, (PAD_M + jaw_m) / 2, jaw.place_m[2]), (pad_half_m, (PAD_M + jaw_m) / 2, jaw.half_m[2]), albedo=JAW
    )
    return Gripper(
        name=name,
        palm=Part((palm, adapter), palm, mass_kg=mass_of(palm, adapter)),
        finger=Part((jaw, pad), whole, mass_kg=mass_of(whole)),
        pad_half_m=pad_half_m,
        stroke_m=stroke_m,
        most_n=most_n,
        length_m=clear + height + 0.02,
    )


def mass_of(*boxes: Box) -> float:
    """Mass of boxes in kg."""
    return DENSITY_KG_M3 * sum(8 * math.prod(box.half_m) for box in boxes)


SMALL = parallel_gripper("small", pad_half_m=0.007, stroke_m=0.039, palm_m=(0.04, 0.12, 0.05), jaw_m=0.008, most_n=40.0)
LARGE = parallel_gripper("large", pad_half_m=0.011, stroke_m=0.055, palm_m=(0.06, 0.17, 0.07), jaw_m=0.012, most_n=70.0)
GRIPPERS: dict[str, Gripper] = {gripper.name: gripper for gripper in (PANDA_HAND, SMALL, LARGE)}
"""By robot.gripper."""
