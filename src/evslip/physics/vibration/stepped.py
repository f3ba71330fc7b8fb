"""Vibration of a simulation that is stepped, of which nothing depends on what comes later.

The camera's is that of `displacement`. The object's is another where that looks ahead: its noise is as long as the
motion, and it fades out after a touch or a loss, not before.
"""

import numpy as np

from evslip.config.params import Params
from evslip.physics.grip import camera_place_m
from evslip.physics.motion.phases import phase_times
from evslip.physics.robots.description import TCP_M
from evslip.physics.trajectory import Trajectory
from evslip.physics.vibration.displacement import (
    CAMERA,
    IN_PADS,
    OBJECT,
    RAMP_S,
    Tremble,
    as_poses,
    hand_acceleration,
    with_object_moved,
)
from evslip.scene.motions.steps import step


class SteppedVibration:
    """The vibration of a motion of `steps` samples that come `step_s` apart."""

    def __init__(self, params: Params, steps: int, step_s: float):
        spec = params.vibration
        self._step_s = step_s
        self._camera = Tremble(params, CAMERA, steps, step_s) if spec.mount_hz is not None else None
        self._object = Tremble(params, OBJECT, steps, step_s) if spec.object_hz is not None else None
        self._place = camera_place_m(params)
        times = phase_times(params)
        self._carried_us = times["lift"][0], times["release"][0]
        self._shown = 0.0

    def add(self, part: Trajectory, known: Trajectory) -> Trajectory:
        """The next samples with what trembles. known: samples from the one before them to the one behind, as far as
        there are any, and three at least."""
        rows = np.isin(known.t_us, part.t_us)
        if self._camera is not None:
            moved = self._camera.advance(hand_acceleration(known, self._place)[rows])
            part = part._replace(camera_displacement=as_poses(moved))
        if self._object is not None:
            moved = np.zeros((len(part.t_us), 6))
            tremble = self._object.advance(hand_acceleration(known, TCP_M)[rows][:, IN_PADS])
            moved[:, IN_PADS] = self._ramp(part)[:, None] * tremble
            part = with_object_moved(part, as_poses(moved))
        return part

    def _ramp(self, part: Trajectory) -> np.ndarray:
        """Share of the object's trembling that shows, (n,): it grows while the object hangs in the grip."""
        first, end = self._carried_us
        hangs = (part.t_us >= first) & (part.t_us < end)
        hangs &= (part.floor_force_n == 0) & (part.pad_force_n > 0).all(axis=1)
        shown = np.empty(len(hangs))
        for k, hanging in enumerate(hangs):
            change = self._step_s if hanging else -self._step_s
            self._shown = min(max(self._shown + change, 0.0), RAMP_S)
            shown[k] = self._shown
        return step(shown, 0.0, RAMP_S)
