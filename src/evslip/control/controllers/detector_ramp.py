"""A slip detector, and a force that rises as fast as it may while it says slip."""

from dataclasses import dataclass
from typing import ClassVar

from evslip.control.controllers.detector_control import DetectorControl, DetectorParameters


class DetectorRamp(DetectorControl):
    """Raises the force when a detector says slip, as fast as the actuator goes, the further the more the alarm is
    believed, until the object slows down; gives it back when it says hold."""

    @dataclass(frozen=True)
    class Parameters(DetectorParameters):
        """Parameters of DetectorRamp."""

        LIMITS: ClassVar = DetectorParameters.LIMITS | {"falling": (0, 1)}

        falling: float = 0.8
        """Share of the largest estimated speed since the alarm began below which the object is coming to rest, so that
        the force is enough. A detector without speeds does not know."""

    def __init__(self, parameters: Parameters | None = None):
        self.parameters = parameters or self.Parameters()
        super().__init__(self.parameters)

    def _slips(self, speed_mm_s: float, is_new: bool) -> None:
        if speed_mm_s < self.parameters.falling * self._fastest_mm_s:
            self._force.stay()
        else:
            self._force.raise_by(self._belief)
