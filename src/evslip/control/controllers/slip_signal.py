"""A detector's latest answer, step by step, or the truth in place of it."""

from typing import Protocol

import numpy as np

from evslip.control.controllers.controller import NO_ANSWER, Setup, SlipAnswer
from evslip.events.stream import Events
from evslip.learn.checkpoint import load_model
from evslip.learn.streaming.stream import Detector
from evslip.utils.errors import ConfigError, DataError
from evslip.windows.alignment import OtherSensor

MODEL = "default-hold"
"""Detector that is asked where none is named: the one of the package that was trained for the control of a grip."""
TRUTH = "truth"
"""In place of a model's folder: the truth about the grip, to see what the perception costs."""


class Signal(Protocol):
    """Source of an answer at every step: whether the object slips."""

    @property
    def has_speeds(self) -> bool:
        """Whether it knows speeds."""
        ...

    @property
    def memory_s(self) -> float:
        """Time for which it goes on about a slip that is over."""
        ...

    def push(self, events: Events, now_us: int) -> SlipAnswer:
        """Take the events since the last step; the answer now."""
        ...


def require_model(model: str) -> None:
    """Raise DataError unless the model can be read."""
    if model != TRUTH:
        load_model(model)


def signal_of(model: str, setup: Setup, threshold: float | None, answers: int) -> Signal:
    """The signal of a model, or the truth. Raises DataError for a model, ConfigError where no truth is known."""
    return TrueSignal(setup) if model == TRUTH else SlipSignal(model, setup, threshold, answers)


class SlipSignal:
    """A detector that is asked at every step. Raises DataError for a model that cannot be read or is of another
    sensor."""

    def __init__(self, model: str, setup: Setup, threshold: float | None, answers: int):
        """answers: number of them in a row, each above the threshold, that are an alarm."""
        try:
            self._detector = Detector(model, size=setup.size, hop_s=setup.step_us / 1e6)
        except OtherSensor:
            width, height = load_model(model)[1].windows.sensor
            raise DataError(
                f"model: {model} was trained on {width}x{height} pixels, and the camera has {setup.size[0]}x"
                f"{setup.size[1]}; expected camera.width = {width} and camera.height = {height}, or another model"
            ) from None
        self._threshold = self._detector.description.threshold if threshold is None else threshold
        self._needed, self._in_a_row = answers, 0
        self._latest, self._known_us = NO_ANSWER, 0

    @property
    def has_speeds(self) -> bool:
        """Whether the detector estimates speeds."""
        return self._detector.estimates_speeds

    @property
    def memory_s(self) -> float:
        """Time that its training labels are about."""
        return self._detector.description.windows.labelled_s

    def push(self, events: Events, now_us: int) -> SlipAnswer:
        """Take the events since the last step; the answer now. Events with time stamps before what is known already, as
        a clock that jumps gives them, count as of then."""
        in_order = events.replace(t_us=np.maximum(events.t_us, self._known_us))
        self._known_us = max(now_us, self._known_us, *in_order.t_us[-1:].tolist())
        found = self._detector.follow(in_order, self._known_us)
        for k in range(len(found.t_us)):
            p_slip = float(found.p_slip[k])
            self._in_a_row = self._in_a_row + 1 if p_slip >= self._threshold else 0
            estimates = found.rotation_speed, found.slide_speed
            speeds = (0.0 if estimate is None else float(estimate.median[k]) for estimate in estimates)
            self._latest = SlipAnswer(self._in_a_row >= self._needed, p_slip, *speeds)
        return self._latest


class TrueSignal:
    """The truth about the grip. Raises ConfigError where it is not known."""

    has_speeds, memory_s = True, 0.0

    def __init__(self, setup: Setup):
        if setup.truth is None:
            raise ConfigError(f"model {TRUTH}: needs the truth about the grip, which a robot does not have")
        self._truth = setup.truth

    def push(self, events: Events, now_us: int) -> SlipAnswer:
        """The answer now."""
        truth = self._truth()
        return SlipAnswer(truth.is_sliding, float(truth.is_sliding), truth.rotation_deg_s, truth.slide_mm_s)
