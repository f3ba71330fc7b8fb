"""Frames of a motion that goes on: the hand's way is planned, what the object does in it shows only as it happens."""

from itertools import islice
from typing import Any

import numpy as np

from evslip.config.params import Params
from evslip.events.frame import Frame
from evslip.physics.trajectory import Trajectory, rotation_of
from evslip.rendering import exposure_scale, make_renderer
from evslip.rendering.camera import hand_camera
from evslip.rendering.distractors.distractor import distractors_of
from evslip.rendering.lights import Lights
from evslip.rendering.poses import ScenePoses, interpolate, matrices
from evslip.rendering.timing.cell_motion import LAG, LIGHT_LAG
from evslip.rendering.timing.flicker import Flicker
from evslip.rendering.timing.schedule import frame_times
from evslip.utils.errors import ConfigError

AHEAD = LAG + LIGHT_LAG + 1
"""Frames by which the light on the surface is drawn before it is seen."""


class LiveView:
    """The hand camera's frames, as `render` draws them, of a trajectory that becomes known piece by piece.

    Surface, background and distractors are drawn ahead, as the hand is planned to move; object, gripper and arm when a
    frame is due. What of a slip is known late is its shadow on the surface. Pixels at the object's edge are those of
    `render` within what the surface changes across a pixel.
    """

    def __init__(
        self, nominal: Trajectory, span_us: tuple[int, int], *, every_us: int, size: tuple[int, int] | None = None
    ):
        """nominal: the same motion as it was planned, whatever the object does in it. span_us: first and last instant.
        every_us: a frame is drawn at each multiple of it after the first instant, and between as often as the motion
        asks for. size: (width, height). `times_us`: times of all frames, int64 (m,); `white_cd_m2`: luminance that is 1
        in them. Raises ConfigError."""
        params, (start_us, end_us) = nominal.params, span_us
        if params.render.renderer != "raycast":
            raise ConfigError(f"render.renderer: {params.render.renderer} draws nothing live; expected raycast")
        camera, carried = hand_camera(params, size), _carried(nominal, start_us)
        self._keys_us = frame_times(carried, start_us, end_us, camera=camera, every_us=every_us)
        self._poses = ScenePoses(carried, camera, self._keys_us)
        self._poses.distractors = distractors = distractors_of(nominal)
        flicker, self._known, self._given = Flicker(params), 0, 0
        if flicker.is_on:

            def make(own: Params) -> Any:
                return make_renderer(None, carried._replace(params=own), camera, span_us, distractors)

            lights = Lights(params, make)
            scale = exposure_scale(lights, nominal, camera, start_us)
            self.times_us = flicker.times(self._keys_us)
            self._drawn = lights.draw_sequence(self._poses, self._keys_us, self.times_us, scale, live=True)
        else:
            renderer = make_renderer(None, carried, camera, span_us, distractors)
            scale = exposure_scale(renderer, nominal, camera, start_us)
            self.times_us = self._keys_us
            self._drawn = renderer.draw_sequence(self._poses, scale, live=True)
        self.white_cd_m2 = 1.0 / scale
        self._flickers = flicker.is_on

    def advance(self, trajectory: Trajectory) -> list[Frame]:
        """Frames since the last call and up to a trajectory's last sample; its first is not after the last frame
        given."""
        upto = int(np.searchsorted(self._keys_us, trajectory.t_us[-1], "right"))
        self._follow(trajectory, upto)
        first, self._given = self._given, max(self._given, self._ready(upto))
        drawn = islice(self._drawn, self._given - first)
        return [Frame(t_us, *frame) for t_us, frame in zip(self.times_us[first:].tolist(), drawn, strict=False)]

    def _ready(self, keys: int) -> int:
        """Frames that can be drawn once the poses of so many keys are known: in light that flickers more of them lie
        between two keys, and need both."""
        if not self._flickers or keys == 0:
            return keys
        return int(np.searchsorted(self.times_us, self._keys_us[keys - 1], "right"))

    def _follow(self, trajectory: Trajectory, upto: int) -> None:
        """Put the object into the planned hand as it lies in the real one, up to a frame, and as it does now after."""
        new, poses = slice(self._known, upto), self._poses
        own = (trajectory.t_us, trajectory.gripper_pose), (trajectory.t_us, trajectory.object_pose)
        at_us = np.append(self._keys_us[new], trajectory.t_us[-1])
        hand, body = (interpolate(*one, at_us) for one in own)
        place, axes = _in_hand(hand, body)
        stop = min(upto + AHEAD, len(self._keys_us))
        whole, own = slice(self._known, stop), np.minimum(np.arange(stop - self._known), len(at_us) - 1)
        turn = poses.hand_rotation[whole]
        poses.object_position[whole] = poses.hand_position[whole] + (turn @ place[own][..., None])[..., 0]
        poses.object_rotation[whole] = turn @ axes[own]
        self._known = upto


def _in_hand(hand: np.ndarray, body: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions (m, 3) and axes (m, 3, 3) of an object in the hand's frame, of poses (m, 7) in the world."""
    turn = matrices(hand[:, 3:]).transpose(0, 2, 1)
    return (turn @ (body[:, :3] - hand[:, :3])[..., None])[..., 0], turn @ matrices(body[:, 3:])


def _carried(nominal: Trajectory, from_us: int) -> Trajectory:
    """The motion with the object fixed in the hand from an instant on."""
    held = nominal.t_us >= from_us
    first = int(held.argmax())
    hand, body = nominal.gripper_pose.astype(np.float64), nominal.object_pose.astype(np.float64)
    turns = rotation_of(hand)
    lies = turns[first].inv() * rotation_of(body[first])
    place = turns[first].inv().apply(body[first, :3] - hand[first, :3])
    pose = np.hstack([hand[:, :3] + turns.apply(place), (turns * lies).as_quat(scalar_first=True)])
    return nominal._replace(object_pose=np.where(held[:, None], pose, body), object_displacement=None)
