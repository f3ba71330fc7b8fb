"""A force that stays."""

from dataclasses import dataclass
from typing import ClassVar

from evslip.control.controllers.controller import Controller, Setup
from evslip.control.senses import Senses
from evslip.events.stream import Events


class Constant(Controller):
    """The force with which the grip was closed, or another one, whatever happens."""

    @dataclass(frozen=True)
    class Parameters:
        """Parameters of Constant."""

        LIMITS: ClassVar = {"force_n": (0, 1000)}

        force_n: float | None = None
        """Force; None: that of the start."""

    sees = False

    def __init__(self, parameters: Parameters | None = None):
        self.parameters = parameters or self.Parameters()

    def reset(self, setup: Setup) -> None:
        wanted = setup.force_n if self.parameters.force_n is None else self.parameters.force_n
        self._force_n = setup.allowed(wanted)

    def step(self, events: Events, senses: Senses) -> float:
        return self._force_n


class Strong(Constant):
    """The largest force that is allowed: it holds whatever may come, and may crush what is soft."""

    def reset(self, setup: Setup) -> None:
        self._force_n = setup.most_n
