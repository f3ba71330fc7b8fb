"""A disturbance of the grasp: something happens while the object is carried."""

from typing import Annotated, Generic

from evslip.config.section import N, OneOf, S, Section, Within, usual

DISTURBANCES = ("none", "mass", "push", "wet", "shake", "faster")
"""Kinds. `physics.inputs.disturbance` has mass, push and wet; shake and faster are part of the planned motion."""


class DisturbanceSpec(Section, Generic[N, S]):
    """Disturbance of the object, or of the hand that carries it."""

    kind: Annotated[S, OneOf(DISTURBANCES)] = usual("none")
    """None; mass is added or removed; the object is pushed; the pads become wet; the hand shakes; or the motion goes
    faster for a while. A list is a mixture."""
    at: Annotated[N, Within(0.0, 1.0)] = usual(0.5)
    """When it begins, as a share of the time from the start of the lift to that of the placement."""
    mass_kg: Annotated[N, Within(-5.0, 5.0)] = usual(0.03)
    """Mass added to object.mass_kg, spread like the object's own; negative: removed, at most 0.9 of it."""
    mass_s: Annotated[N, Within(0.0, 60.0)] = usual(0.1)
    """Time in which it is added, evenly."""
    push_n: Annotated[N, Within(0.0, 100.0)] = usual(1.0)
    """Largest force of the push, at the object's centre of mass; it rises and falls as half a sine."""
    push_s: Annotated[N, Within(0.005, 60.0)] = usual(0.1)
    """Time that it lasts."""
    direction_deg: Annotated[N, Within(-360.0, 360.0)] = usual(-90.0)
    """Direction of the push, and of the shaking, in the plane of the pads: from world x towards up."""
    wet_factor: Annotated[N, Within(0.05, 1.0)] = usual(0.5)
    """Friction of wet pads over grip.friction; it stays."""
    shake_m: Annotated[N, Within(0.0, 0.1)] = usual(0.005)
    """Largest way to either side of the shaking hand."""
    shake_hz: Annotated[N, Within(0.1, 10.0)] = usual(4.0)
    """Oscillations a second of it."""
    shake_s: Annotated[N, Within(0.1, 60.0)] = usual(1.0)
    """Time that it lasts, a period of growing and one of dying away with it."""
    faster_factor: Annotated[N, Within(1.0, 5.0)] = usual(1.5)
    """Speed of the motion over the usual one."""
    faster_s: Annotated[N, Within(0.2, 60.0)] = usual(1.0)
    """Time that the motion is faster; what follows comes earlier."""
