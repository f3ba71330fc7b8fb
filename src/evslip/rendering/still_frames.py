"""Pictures of one trajectory at any times, in any order: what does not change is made once."""

import numpy as np

from evslip.events.frame import Frame
from evslip.physics.trajectory import Trajectory
from evslip.rendering import exposure_scale, make_renderer, recorded_span
from evslip.rendering.camera import hand_camera
from evslip.rendering.poses import ScenePoses
from evslip.rendering.timing.schedule import check_times


class StillFrames:
    """Frames of the hand camera, luminance relative to white, exposed as `evslip.render` does. Raises ConfigError.

    One at a time: not for several threads at once.
    """

    def __init__(self, traj: Trajectory, *, size: tuple[int, int] | None = None, renderer: str | None = None):
        self._traj, self._camera = traj, hand_camera(traj.params, size)
        span = recorded_span(traj)
        self._renderer = make_renderer(renderer, traj, self._camera, span)
        self._scale = exposure_scale(self._renderer, traj, self._camera, span[0])

    def at(self, t_us: int) -> Frame:
        """The frame of one time, in microseconds, within the trajectory. Raises ConfigError."""
        check_times(self._traj, np.array([t_us]))
        poses = ScenePoses(self._traj, self._camera, np.array([t_us]))
        return Frame(t_us, *self._renderer.draw(poses, 0, self._scale))
