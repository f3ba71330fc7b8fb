"""Events of the hand's camera while a motion goes on."""

from evslip.config.params import Params
from evslip.events.frame import Frame
from evslip.events.stream import Events
from evslip.generation.sensor import camera_for
from evslip.physics.simulation import simulate
from evslip.physics.trajectory import Trajectory
from evslip.rendering.live import LiveView


class CameraStream:
    """The event camera of a sample, which sees a motion as it happens."""

    def __init__(self, params: Params, span_us: tuple[int, int], step_us: int, nominal: Trajectory | None = None):
        """span_us: from when to when it sees; step_us: time between two calls of `advance`, the first of which ends a
        whole number of steps after the begin. nominal: the same motion, if it is known already. Raises ConfigError,
        PlanRejected, GraspFailed."""
        # How the arm moves is known beforehand, and with it when frames are due.
        self.nominal = simulate(params) if nominal is None else nominal._replace(params=params)
        self._view = LiveView(self.nominal, span_us, every_us=step_us)
        self._camera = camera_for(params)
        self.frame: Frame | None = None
        """Latest frame."""

    @property
    def white_cd_m2(self) -> float:
        """Luminance that is 1 in the frames."""
        return self._view.white_cd_m2

    def advance(self, trajectory: Trajectory) -> Events:
        """Events up to the last of the samples since the last call, whose first is the last of the call before."""
        frames = self._view.advance(trajectory)
        self.frame = frames[-1] if frames else self.frame
        return self._camera.run(frames)
