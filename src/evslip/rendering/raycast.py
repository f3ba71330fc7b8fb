"""The fast renderer: every surface is a formula, so that a frame is a few passes of plain arithmetic."""

import numpy as np

from evslip.camera import Camera
from evslip.params import Params
from evslip.rendering.backdrop import backdrop
from evslip.rendering.coverage import cover_box
from evslip.rendering.gripper import make_room, merge_gripper, put_over, shade_gripper
from evslip.rendering.hand import PALM
from evslip.rendering.lanes import LANES, SCRATCH
from evslip.rendering.layers import RED
from evslip.rendering.lens import SPREAD, expose
from evslip.rendering.openings import Opening, Openings
from evslip.rendering.poses import Poses
from evslip.rendering.setting import LUMA, prepare
from evslip.rendering.shadow import casters
from evslip.rendering.solid import draw_solid

SURFACE_GLOSS, OBJECT_GLOSS, GRIPPER_GLOSS = 0.1, 0.2, 0.3
"""Strength of the highlights. A smooth dielectric (Fresnel 0.04) with exponent 32 has 0.2."""


class Raycaster:
    """Draws one sample, one colour channel, at one resolution."""

    def __init__(self, params: Params, camera: Camera, held_travel_m: float, channel: int = LUMA):
        """held_travel_m: finger travel while the object is held, as in `Openings`."""
        height, width = camera.height, camera.width
        self.camera, self.setting = camera, prepare(params, channel)
        self.params = params
        self.albedo_row = RED + channel
        self._openings = Openings(camera, held_travel_m)
        self._current: Opening | None = None
        shape = params.object
        self._half = np.array([shape.width_m, shape.depth_m, shape.height_m]) / 2
        self._scratch = np.zeros(SCRATCH, np.float32)
        self._fetched = np.zeros(LANES, np.uint64)
        self._area = np.zeros((3, height, width + 2))
        self._spans = np.zeros((3, height, 2), np.int64)
        self._rows, self._faces = np.zeros((3, 2), np.int64), np.zeros(3, np.int64)
        self._total, self._row_blur = np.zeros((height, width), np.float32), np.zeros((height, width), np.float32)
        self._touched, self._full = np.zeros((height, 2), np.int64), np.zeros((height, 2), np.int64)
        self._image, self._keep = np.zeros((height, width), np.float32), np.ones((height, width), np.float32)

    def draw(self, poses: Poses, index: int, scale: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
        """Luminance in cd/m2 times `scale`, float32, and body indices, uint8, both new arrays (height, width)."""
        layers, boxes = self._opening(poses.travel_m[index])
        camera, turn = poses.camera_position[index], poses.camera_rotation[index]
        place, axes = poses.object_position[index], poses.object_rotation[index]
        lamp, ambient = self.setting.lamp, self.setting.ambient
        out, focal, half = self._image, self.camera.focal_px, self._half
        light = (lamp.position, lamp.radius_m, lamp.luminance)
        turns, places = casters(camera, turn, place, axes, boxes.turns, boxes.places)
        halves = np.concatenate([half[None], boxes.halves])
        bodies = np.zeros(out.shape, np.uint8)
        visible = cover_box(
            camera, turn, focal, place, axes, half, self._area, self._spans, self._rows, self._faces,
            self._total, self._touched, self._full,
        )  # fmt: skip
        background, surface = self.params.background, self.params.surface
        backdrop(
            out, bodies, self._scratch, self._fetched, camera, turn, focal, *light,
            *self.setting.surface, surface.tile_m, ambient.surface, SURFACE_GLOSS,
            *self.setting.sphere, self.setting.repetitions, background.radius_m, background.luminance_cd_m2,
            turns, places, halves, layers.hidden, self._total, self._touched, self._full,
        )  # fmt: skip
        shade_gripper(
            self._values, self._front, self._scratch, layers.fragments, self.albedo_row, layers.bounds,
            camera, turn, focal, *light, lamp.share, ambient.matrix, GRIPPER_GLOSS, place, axes, half,
            boxes.turns[PALM], boxes.places[PALM], boxes.halves[PALM],
        )  # fmt: skip
        own = (self._front, layers.fragments, layers.pixels, layers.starts)
        merge_gripper(out, self._keep, self._over, self._values, *own)
        make_room(out, self._total, self._touched)
        draw_solid(
            out, self._scratch, self._fetched, camera, turn, focal, *light, lamp.share, ambient.matrix, OBJECT_GLOSS,
            place, axes, half, *self.setting.solid, turns, places, halves,
            visible, self._faces, self._rows, self._area, self._spans, self._keep,
        )  # fmt: skip
        put_over(out, bodies, self._keep, self._total, self._touched, self._over, *own)
        luminance = np.empty(out.shape, np.float32)
        expose(out, np.float32(scale), SPREAD, self._row_blur, luminance)
        return luminance, bodies

    def _opening(self, travel_m: float) -> Opening:
        opening = self._openings.at(travel_m)
        if opening is not self._current:
            self._current = opening
            count = opening.layers.fragments.shape[1]
            self._values, self._front = np.zeros(count, np.float32), np.zeros(count, np.float32)
            self._over = np.zeros(len(opening.layers.pixels), np.float32)
            self._keep[:] = 1.0
        return opening
