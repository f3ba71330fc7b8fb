"""The renderer that traces light paths: what the fast one leaves out is here, at many times its cost."""

from collections.abc import Iterator, Sequence

import numpy as np

from evslip.config.params import Params
from evslip.rendering.camera import Camera
from evslip.rendering.distractors.distractor import Distractor
from evslip.rendering.lens import SPREAD, Lens
from evslip.rendering.pathtrace.keyframes import Keyframes
from evslip.rendering.pathtrace.mitsuba_scene import BOUNCES, MitsubaScene
from evslip.rendering.poses import ScenePoses
from evslip.rendering.raycast.renderer import Raycaster
from evslip.rendering.raycast.setting import LUMA, channel_of


class Pathtracer:
    """Draws one sample at one resolution."""

    def __init__(
        self, params: Params, camera: Camera, held_travel_m: float, channel: int = LUMA, *,
        arm: bool = True, bounces: int = BOUNCES, distractors: Sequence[Distractor] = (),
    ):  # fmt: skip
        """held_travel_m, distractors: as of Raycaster; arm, bounces: as of `MitsubaScene`. Raises
        ConfigError, MissingExtraError."""
        self._lens, self._channel, self._spp = Lens(params, camera), channel, params.render.spp
        self.scene = MitsubaScene(params, self._lens.pinhole, arm=arm, bounces=bounces, distractors=distractors)
        self._params, self._is_sparse = params, camera.is_mounted and params.render.key_motion_px > 0
        self._keyframes: dict[int | None, Keyframes] = {}
        masks = (
            Raycaster(params, camera, held_travel_m, channel, distractors=distractors) if camera.is_mounted else None
        )
        self._masks = masks

    def draw(self, poses: ScenePoses, index: int, scale: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
        """Frame as of Raycaster. The body indices are those of the fast renderer, exact; other cameras than the hand's
        have none, and get zeros."""
        luminance = self._lens.form(self._trace(poses, index, self._channel), scale, SPREAD)
        if self._masks is None:
            return luminance, np.zeros(luminance.shape, np.uint8)
        return luminance, self._masks.draw(poses, index)[1]

    def draw_sequence(self, poses: ScenePoses, scale: float = 1.0) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Frames as of `draw`, of all poses in turn."""
        return (self.draw(poses, index, scale) for index in range(len(poses.travel_m)))

    def color(self, poses: ScenePoses, index: int, scale: float = 1.0) -> np.ndarray:
        """Linear RGB in cd/m2 times `scale`, float32 of shape (height, width, 3)."""
        image = self._trace(poses, index)
        return np.stack([self._lens.form(channel_of(image, k), scale, SPREAD) for k in range(3)], -1)

    def _trace(self, poses: ScenePoses, index: int, channel: int | None = None) -> np.ndarray:
        """Image that the pinhole sees in cd/m2: one channel of it, or linear RGB."""
        if self._is_sparse:
            if channel not in self._keyframes:
                self._keyframes[channel] = Keyframes(self._params, self._lens.pinhole, self.scene, channel)
            return self._keyframes[channel].draw(poses, index)
        self.scene.show(poses, index)
        image = self.scene.render(self._spp)
        return image if channel is None else channel_of(image, channel)
