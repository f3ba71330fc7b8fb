"""The grip: where and how hard the hand holds the object."""

from typing import Annotated, Any, Generic

from evslip.config.distributions import extremes
from evslip.config.section import LATER, N, OneOf, S, Section, Within, usual, wrong

ACTUATORS = ("ideal", "panda", "fast")
"""`physics.inputs.actuator.RESPONSES` has the response of each."""


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
    """How far the object stands from where the hand takes it to be, along its width."""
    error_y_m: Annotated[N, Within(-0.03, 0.03)] = usual(0.0)
    """Such an error along its depth: the fingers push the object into their middle."""
    error_yaw_deg: Annotated[N, Within(-20.0, 20.0)] = usual(0.0)
    """Such an error of its turn about the vertical: the pads give way to it, and turn the object straight only where
    friction is low."""
    actuator: Annotated[S, OneOf(ACTUATORS), LATER] = usual("panda")
    """How the grip force follows commands, of a controller; nothing else commands it. Ideal: at once."""
    actuator_hz: Annotated[N | None, Within(0.1, 1000.0), LATER] = None
    """Bandwidth of the actuator, a low-pass filter of first order. Default: that of its kind (panda 20, fast 100)."""
    actuator_n_s: Annotated[N | None, Within(0.1, 1e6), LATER] = None
    """Largest rate of its force in newtons a second. Default: that of its kind (panda 60, fast 1000)."""
    actuator_delay_s: Annotated[N | None, Within(0.0, 0.5), LATER] = None
    """Time before it answers, in whole milliseconds. Default: that of its kind (panda 0.005, fast 0.001)."""
    least_n: Annotated[N, Within(0.0, 70.0), LATER] = usual(0.5)
    """Least force that can be commanded. It does not limit force_n."""
    most_n: Annotated[N, Within(0.1, 70.0), LATER] = usual(20.0)
    """Largest force that can be commanded: what the object bears. It does not limit force_n."""

    def _check(self) -> None:
        given: tuple[Any, Any] = self.least_n, self.most_n
        least, most = extremes(given[0])[1], extremes(given[1])[0]
        if least > most:
            raise wrong("least_n", f"may be {least:g}, which is above grip.most_n {most:g}")
