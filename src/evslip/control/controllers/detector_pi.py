"""A slip detector, and a PI controller on the speed of the slip that it estimates."""

from dataclasses import dataclass
from typing import ClassVar

from evslip.control.controllers.controller import Setup, SlipAnswer
from evslip.control.controllers.detector_control import DetectorControl, DetectorParameters


class DetectorPI(DetectorControl):
    """Asks for more force the faster the object slips: a part in proportion to the estimated speed, and one in
    proportion to the way that it has slipped, which stays. A detector without speeds is used as by `detector`."""

    @dataclass(frozen=True)
    class Parameters(DetectorParameters):
        """Parameters of DetectorPI."""

        LIMITS: ClassVar = DetectorParameters.LIMITS | {"proportional": (0, 100), "integral": (0, 100)}

        proportional: float = 0.02
        """Share of the force that is added for each mm/s of slip."""
        integral: float = 0.3
        """Share of the force that is added for each mm of slip."""

    def __init__(self, parameters: Parameters | None = None):
        self.parameters = parameters or self.Parameters()
        super().__init__(self.parameters)

    def reset(self, setup: Setup) -> None:
        super().reset(setup)
        self._seconds, self._base_n, self._way_mm = setup.step_us / 1e6, setup.force_n, 0.0

    def _slips(self, speed_mm_s: float, is_new: bool) -> None:
        own = self.parameters
        if not self._signal.has_speeds:
            self._force.raise_by(self._belief)
            return
        if is_new:
            self._base_n, self._way_mm = self._force.value_n, 0.0
        self._way_mm += speed_mm_s * self._seconds
        self._force.raise_to(self._base_n * (1 + own.proportional * speed_mm_s + own.integral * self._way_mm))

    def _speed_mm_s(self, answer: SlipAnswer) -> float:
        return answer.slide_mm_s + answer.rotation_deg_s / self.parameters.deg_mm
