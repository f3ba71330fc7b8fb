"""The grip: where and how hard the hand holds the object."""

from typing import Annotated, Generic

from evslip.config.section import N, S, Section, Within, usual


class GripSpec(Section, Generic[N, S]):
    """Where and how hard the hand grips."""

    offset: Annotated[N, Within(-1.0, 1.0)]
    """Gripping point along the width, as a share of 0.9 x half width; 0 is the middle."""
    depth_m: Annotated[N, Within(-0.0075, 0.05)]
    """Tool centre below the top edge; negative is above it, where the pads still overlap the object."""
    force_n: Annotated[N, Within(0.1, 70.0)]
    """Normal force of each pad."""
    friction: Annotated[N, Within(0.05, 2.0)]
    """Coulomb friction coefficient between pad and object."""
    error_x_m: Annotated[N, Within(-0.03, 0.03)] = usual(0.0)
    """How far the object stands from where the hand takes it to be: along its width,"""
    error_y_m: Annotated[N, Within(-0.03, 0.03)] = usual(0.0)
    """... along its depth: the fingers push it into their middle,"""
    error_yaw_deg: Annotated[N, Within(-20.0, 20.0)] = usual(0.0)
    """... and turned about the vertical: the pads give way to it, and turn it straight only where friction is low."""
