"""The interface of all controllers."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, ClassVar, NamedTuple

from evslip.control.episode_truth import GripTruth
from evslip.control.senses import Senses
from evslip.events.stream import Events


class Setup(NamedTuple):
    """Facts that are known before an episode begins."""

    size: tuple[int, int]
    """The sensor's width and height."""
    step_us: int
    """Time between two steps."""
    start_us: int
    """Time at which control begins."""
    force_n: float
    """Grip force at that time."""
    least_n: float
    most_n: float
    """Forces that may be commanded."""
    truth: Callable[[], GripTruth] | None = None
    """The grip's true state at any time of the episode; None on a robot."""

    def allowed(self, force_n: float) -> float:
        """The force nearest to one that may be commanded."""
        return min(max(force_n, self.least_n), self.most_n)


class SlipAnswer(NamedTuple):
    """Answer of a detector at one time."""

    alarm: bool
    """Whether the object slips."""
    p_slip: float
    """Probability of that; 0 before the first window is complete."""
    rotation_deg_s: float
    slide_mm_s: float
    """Speeds; 0 of a detector that estimates none."""


NO_ANSWER = SlipAnswer(False, 0.0, 0.0, 0.0)


class Controller(ABC):
    """Commands a grip force, step by step."""

    Parameters: ClassVar[Any]
    """Frozen dataclass of what can be chosen."""
    sees: bool = True
    """Whether it needs events."""

    alarm: bool = False
    """Whether it takes the object to slip, as of the last step."""
    answer: SlipAnswer | None = None
    """The answer of its detector in the last step; None for one without."""

    @abstractmethod
    def reset(self, setup: Setup) -> None:
        """Begin an episode. Raises EvslipError for one that it cannot do."""

    @abstractmethod
    def step(self, events: Events, senses: Senses) -> float:
        """Force in newtons to command until the next step, given the events since the last one and what the hand
        measures now."""
