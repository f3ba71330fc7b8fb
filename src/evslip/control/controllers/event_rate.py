"""Slip by the rate of events alone: more of them than the noise and the motion make."""

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from evslip.control.controllers.controller import Controller, Setup
from evslip.control.controllers.grip_force import GripForce, Relaxation
from evslip.control.senses import Senses
from evslip.events.stream import Events


class EventRate(Controller):
    """Alarm while the events of the last while are a multiple of what is usual, after Muthusamy et al. 2020.

    The usual rate is the median of what has been seen, which a slip hardly moves. What the arm's motion makes is not
    separated from a slip: this is the baseline that a detector has to beat.
    """

    @dataclass(frozen=True)
    class Parameters:
        """Parameters of EventRate."""

        LIMITS: ClassVar = {
            "window_s": (0.001, 10),
            "multiple": (1, 1000),
            "least_hz": (0, 1e9),
            "memory_s": (0.001, 1000),
            "gain": (1, 100),
            "wait_s": (0, 10),
        }

        window_s: float = 0.02
        """Time over which events are counted."""
        multiple: float = 3.0
        """Multiple of the usual rate that is an alarm."""
        least_hz: float = 20_000.0
        """Rate below which nothing is an alarm."""
        memory_s: float = 2.0
        """Time of which the usual rate is the median."""
        gain: float = 1.5
        """Multiple of the force that an alarm asks for."""
        wait_s: float = 0.08
        """Time that a raised force is given to stop the slip before it is raised again."""
        relaxation: Relaxation = field(default_factory=Relaxation)

    def __init__(self, parameters: Parameters | None = None):
        self.parameters = parameters or self.Parameters()

    def reset(self, setup: Setup) -> None:
        own = self.parameters
        self._force, self._setup, self.alarm = GripForce(setup, own.relaxation), setup, False
        self._counts: list[int] = []
        self._steps = max(1, round(own.window_s * 1e6 / setup.step_us))
        self._memory = max(self._steps, round(own.memory_s * 1e6 / setup.step_us))
        self._raised_us: int | None = None

    def step(self, events: Events, senses: Senses) -> float:
        own = self.parameters
        self._counts = [*self._counts[-self._memory :], events.count]
        seconds = self._setup.step_us / 1e6
        rate = sum(self._counts[-self._steps :]) / (min(self._steps, len(self._counts)) * seconds)
        usual = float(np.median(self._counts)) / seconds
        was_alarm, self.alarm = self.alarm, rate > max(own.least_hz, own.multiple * usual)
        if self.alarm and not was_alarm:
            self._force.alarm_begins()
        if not self.alarm:
            if was_alarm:
                self._force.slipped()
            self._force.rest()
        elif self._raised_us is None or senses.t_us - self._raised_us >= own.wait_s * 1e6:
            self._force.raise_to(own.gain * self._force.value_n)
            self._raised_us = senses.t_us
        return self._force.command_n(senses)
