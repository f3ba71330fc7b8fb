"""A stage of the readout, as `sensor_readout` asks for it."""

from typing import Protocol

import numpy as np

from evslip.events.readout.transit import Transit


class Stage(Protocol):
    state: dict[str, np.ndarray]
    """All that changes from call to call, by name."""

    def passed(self, events: Transit, until_us: float) -> Transit:
        """Events that come out, given those that came in since the call before.

        until_us: nothing that comes later is earlier than this. What the stage cannot order yet waits in its state; so
        what comes out over all calls does not depend on where they cut.
        """
        ...
