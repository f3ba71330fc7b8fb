"""A slip detector, and steps of force while it says slip."""

from dataclasses import dataclass
from typing import ClassVar

from evslip.control.controllers.controller import Setup
from evslip.control.controllers.detector_control import DetectorControl, DetectorParameters


class DetectorSteps(DetectorControl):
    """Raises the force by a step when a detector says slip, again while it goes on saying so, and gives it back when it
    says hold."""

    @dataclass(frozen=True)
    class Parameters(DetectorParameters):
        """Parameters of DetectorSteps."""

        LIMITS: ClassVar = DetectorParameters.LIMITS | {
            "gain": (1, 100),
            "least_step_n": (0, 100),
            "again": (0, 1),
            "wait_s": (0, 10),
            "falling": (0, 1),
        }

        gain: float = 2.5
        """Multiple of the force that an alarm asks for."""
        least_step_n: float = 0.5
        """Least step that it asks for, where the multiple is less."""
        again: float = 0.5
        """Share of that step that each further one adds while the alarm goes on: an object that goes on slipping with a
        raised force is rarer than a detector that goes on being wrong."""
        wait_s: float = 0.12
        """Time that a raised force is given before it is raised again."""
        falling: float = 0.8
        """Share of the largest estimated speed since the alarm began below which the object is coming to rest, so that
        the alarm is about the past and raises nothing. A detector without speeds does not know."""

    def __init__(self, parameters: Parameters | None = None):
        self.parameters = parameters or self.Parameters()
        super().__init__(self.parameters)

    def reset(self, setup: Setup) -> None:
        super().reset(setup)
        self._raised_us, self._share = 0, 1.0

    def _slips(self, speed_mm_s: float, now_us: int, is_new: bool) -> None:
        own, before_n = self.parameters, self._force.value_n
        if is_new:
            self._share = 1.0
        elif now_us - self._raised_us < own.wait_s * 1e6 or speed_mm_s < own.falling * self._fastest_mm_s:
            return
        self._force.raise_to(before_n + self._share * max((own.gain - 1) * before_n, own.least_step_n))
        self._raised_us, self._share = now_us, self._share * own.again
