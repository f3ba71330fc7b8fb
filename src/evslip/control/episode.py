"""One motion under control: from the closed grip to the command to open, or until the object is lost."""

import numpy as np

from evslip.config.params import Params
from evslip.config.views import camera_names
from evslip.control.camera_stream import CameraStream
from evslip.control.episode_truth import GripTruth
from evslip.control.senses import Senses
from evslip.control.slip_monitor import SlipMonitor
from evslip.events.frame import Frame
from evslip.events.stream import Events, empty_events
from evslip.physics.held import LOST_S, recorded
from evslip.physics.motion.phases import phase_times
from evslip.physics.stepping import SteppedSimulation
from evslip.physics.trajectory import Trajectory
from evslip.utils.errors import ConfigError, GraspFailed

LATE_US = 200_000
"""Time after the begin of the lift in which the grip may still close."""
SAMPLE_US = 1000
"""Time between two samples of the physics."""
CLOSING_US = 10_000
"""Time between two looks at whether it has."""


class Episode:
    """A motion whose grip force is commanded step by step.

    Up to its start the hand comes down and grips, with the parameters' grip.force_n. Equal parameters and commands give
    equal bytes. Raises ConfigError, PlanRejected, GraspFailed.
    """

    def __init__(self, params: Params, *, step_us: int = 10_000, sees: bool = True, ends: str = "release"):
        """step_us: time between two commands; sees: whether frames are drawn and events made; ends: the phase with
        whose begin the episode ends."""
        require_one_camera(params)
        times = phase_times(params)
        self.params, self.simulation, self._step_us = params, SteppedSimulation(params), step_us
        self.closed_us = self._close(times["lift"][0])
        self.start_us = self.simulation.t_us
        self.end_us = times[ends][0] // SAMPLE_US * SAMPLE_US
        self._empty = 0
        self._truth: GripTruth | None = None
        before = self.simulation.trajectory(self.closed_us)
        self.monitor = SlipMonitor(before)
        first_us = self.start_us - (self.start_us - self.closed_us) // step_us * step_us
        self._stream = self._camera(params, first_us) if sees else None
        self.events = self._see(self.simulation.trajectory(first_us))
        """Events since the step before; at first those since the grip closed."""

    @property
    def t_us(self) -> int:
        """Time in microseconds."""
        return self.simulation.t_us

    @property
    def allowed_n(self) -> tuple[float, float]:
        """Least and most force that can be commanded in this episode."""
        return self.simulation.allowed_n

    @property
    def target_n(self) -> float:
        """Force that was commanded last; before the first command grip.force_n, whatever is allowed."""
        return self.simulation.target_n

    @property
    def is_lost(self) -> bool:
        """Whether the object is out of the grip: a pad has carried nothing for a while."""
        return self._empty >= round(LOST_S * 1000)

    @property
    def is_over(self) -> bool:
        """Whether the episode has ended."""
        return self.is_lost or self.t_us >= self.end_us

    @property
    def frame(self) -> Frame | None:
        """Latest frame; None where none are drawn."""
        return None if self._stream is None else self._stream.frame

    @property
    def senses(self) -> Senses:
        """Measurements of the hand now."""
        hand = self.simulation.senses
        forces, acceleration = hand.pad_force_n.astype(np.float64), hand.hand_acceleration_m_s2.astype(np.float64)
        return Senses(self.t_us, forces, hand.opening_m, acceleration, hand.tilt_rad, self.target_n)

    @property
    def truth(self) -> GripTruth:
        """The grip's true state now."""
        if self._truth is None:
            hangs = bool(self.simulation.trajectory(self.t_us).floor_force_n[-1] <= 0)
            self._truth = GripTruth(
                self.monitor.is_sliding, self.simulation.least_force_n(), hangs, *self.monitor.speeds()
            )
        return self._truth

    def advance(self, until_us: int, target_n: float) -> None:
        """Go on to a time, at most to the end, with a force that is commanded, limited to `allowed_n`. Raises
        GraspFailed, ConfigError."""
        since = self.t_us
        self.simulation.advance(min(until_us, self.end_us), target_n)
        part = self.simulation.trajectory(since)
        self.monitor.push(part)
        self._truth = None
        for empty in np.any(part.pad_force_n[1:] <= 0, axis=1).tolist():
            self._empty = self._empty + 1 if empty or self.is_lost else 0
        self.events = self._see(part)

    def look_anew(self, params: Params) -> None:
        """Go on with other parameters of light, surroundings or sensor, at the exposure of before: the pixels settle on
        what is seen now. After the end nothing is. Raises ConfigError."""
        if self._stream is None or self.t_us >= self.end_us:
            return
        exposure = {"exposure": "absolute", "white_cd_m2": self._stream.white_cd_m2}
        params = params.model_copy(update={"camera": params.camera.model_copy(update=exposure)})
        span_us = self.t_us, self.end_us
        self._stream = CameraStream(params, span_us, self._step_us, self._stream.nominal)
        self.events = self._see(self.simulation.trajectory(self.t_us - SAMPLE_US))

    def finish(self) -> Trajectory:
        """The whole motion, the rest of it with the last command."""
        self.simulation.advance(self.simulation.end_us)
        return self.simulation.trajectory(0)

    def _close(self, lift_us: int) -> int:
        """Go on until the grip is closed, at least to the lift; the time at which it closed."""
        until = lift_us
        while True:
            self.simulation.advance(until)
            trajectory = self.simulation.trajectory(0)
            try:
                return int(trajectory.t_us[recorded(trajectory)[0]])
            except GraspFailed:
                if until >= lift_us + LATE_US:
                    raise
            until += CLOSING_US

    def _camera(self, params: Params, first_us: int) -> CameraStream:
        # The motion from here on as it is planned costs less than all of it anew. A frame is due at the very end: the
        # last step may be a short one.
        return CameraStream(params, (first_us, self.end_us), self._step_us, self.simulation.foreseen())

    def _see(self, part: Trajectory) -> Events:
        return empty_events() if self._stream is None else self._stream.advance(part)


def require_one_camera(params: Params) -> None:
    """Raise ConfigError for a sample of several cameras."""
    if camera_names(params):
        names = ", ".join(f"camera.{name}" for name in camera_names(params))
        raise ConfigError(f"{names}: the closed loop has one camera; expected the section camera alone")
