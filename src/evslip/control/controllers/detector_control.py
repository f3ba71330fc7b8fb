"""What controllers that ask a slip detector have in common."""

from dataclasses import dataclass, field

from evslip.control.controllers.controller import Controller, Setup
from evslip.control.controllers.grip_force import GripForce, Relaxation
from evslip.control.controllers.slip_signal import MODEL, TRUTH, require_model, signal_of


@dataclass(frozen=True)
class DetectorParameters:
    """Parameters of a detector, and of a force that its alarms raise."""

    model: str = MODEL
    """Folder of the detector, or the one of the package; "truth": the truth in place of it."""
    threshold: float | None = None
    """Probability from which on it says slip; None: the detector's own."""
    answers: int = 1
    """Answers in a row that are an alarm."""
    deg_mm: float = 3.0
    """Degrees of turning that count as a millimetre of sliding."""
    relaxation: Relaxation = field(default_factory=Relaxation)


class DetectorControl(Controller):
    """Asks a slip detector at every step. Raises DataError for a model that cannot be read."""

    def __init__(self, parameters: DetectorParameters):
        require_model(parameters.model)
        self.sees = parameters.model != TRUTH
        self._asks = parameters

    def reset(self, setup: Setup) -> None:
        own = self._asks
        self._signal = signal_of(own.model, setup, own.threshold, own.answers)
        self._force, self.alarm = GripForce(setup, own.relaxation), False
