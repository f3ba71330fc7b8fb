"""The fast renderer: every surface is a formula, so that a frame is a few passes of plain arithmetic."""

import numpy as np

from evslip.camera import Camera
from evslip.errors import ConfigError
from evslip.frame import ARM
from evslip.params import Params
from evslip.rendering.arm import Arm, cast_links
from evslip.rendering.backdrop import backdrop
from evslip.rendering.body import View, make_body
from evslip.rendering.casters import ARM_PART, OBJECT_PART, Casters, cast
from evslip.rendering.gripper import make_room, merge_gripper, put_over, shade_gripper
from evslip.rendering.hand import BOX_PARTS, Boxes
from evslip.rendering.lanes import LANES, SCRATCH
from evslip.rendering.layers import RED
from evslip.rendering.lens import SPREAD, Lens
from evslip.rendering.links import CASTERS, LinkPoses
from evslip.rendering.openings import Opening, Openings
from evslip.rendering.outline import Outline
from evslip.rendering.poses import Poses
from evslip.rendering.setting import LUMA, prepare

PARTS = np.array([OBJECT_PART, *BOX_PARTS, *[ARM_PART] * CASTERS])
"""Body of each caster."""
SURFACE_GLOSS, GRIPPER_GLOSS = 0.1, 0.3
"""Strength of the highlights; see `body.GLOSS`."""


NO_OUTLINE = tuple(
    np.zeros(shape, kind)
    for shape, kind in (((0, 2, 3), np.float32), (1, np.int64), ((0, 3, 3), float), ((0, 3), float), ((0, 3), float))
)


def _alone(outline: Outline) -> tuple[np.ndarray, ...]:
    """Edges, starts, frames, origins and planes of `Casters`, of one outline."""
    starts = np.array([0, len(outline.edges)])
    return outline.edges, starts, outline.turn[None], outline.place[None], outline.plane[None]


class Raycaster:
    """Draws one sample, one colour channel, at one resolution."""

    def __init__(self, params: Params, camera: Camera, held_travel_m: float, channel: int = LUMA):
        """held_travel_m: finger travel while the object is held, as in `Openings`."""
        if not camera.is_mounted:
            raise ConfigError(
                "renderer: raycast draws what the camera on the hand sees; use pathtrace for any other camera"
            )
        self._lens, self._sensor, self._held_m = Lens(params, camera), camera, held_travel_m
        camera = self._lens.pinhole
        height, width = camera.height, camera.width
        self.camera, self.setting = camera, prepare(params, channel)
        self._backdrop = backdrop
        if params.render.device == "cuda":
            from evslip.rendering.cuda import CudaBackdrop

            self._backdrop = CudaBackdrop(self.setting, height, width)
        self.params = params
        self._closing = camera.rotation.T @ (1e-3, 1.0, 0.0)
        self.albedo_row = RED + channel
        self._body = make_body(params, camera, channel)
        self._arm = Arm(camera, GRIPPER_GLOSS)
        self._openings = Openings(camera, held_travel_m)
        self._current: Opening | None = None
        self._channels: list[Raycaster] = []
        self._scratch = (np.zeros(SCRATCH, np.float32), np.zeros(LANES, np.uint64))
        self._image, self._keep = np.zeros((height, width), np.float32), np.ones((height, width), np.float32)

    def draw(self, poses: Poses, index: int, scale: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
        """Luminance in cd/m2 times `scale`, float32, and body indices, uint8, both new arrays (height, width)."""
        layers, boxes, blockers = self._opening(poses.travel_m[index])
        camera, turn = poses.camera_position[index], poses.camera_rotation[index]
        lamp, ambient = self.setting.lamp, self.setting.ambient
        out, body, focal = self._image, self._body, self.camera.focal_px
        light = (lamp.position, lamp.radius_m, lamp.luminance)
        view = View(camera, turn, focal, poses.object_position[index], poses.object_rotation[index])
        body.cover(view)
        casters = self._casters(view, boxes, blockers, poses.links, index)
        bodies = np.zeros(out.shape, np.uint8)
        background, surface = self.params.background, self.params.surface
        self._backdrop(
            out, bodies, *self._scratch, camera, turn, focal, *light,
            *self.setting.surface, surface.tile_m, ambient.surface, SURFACE_GLOSS,
            *self.setting.sphere, self.setting.repetitions, background.radius_m, background.luminance_cd_m2,
            casters, layers.seen, body.total, body.touched, body.full,
        )  # fmt: skip
        if poses.links is not None and self._arm.cover(poses.links, index, view):
            self._arm.mark(bodies, ARM)
            make_room(out, self._arm.total, self._arm.touched)
            self._arm.draw(out, self._scratch, view, self.setting, casters)
        shade_gripper(
            self._values, self._scratch[0], layers.fragments, self.albedo_row, layers.bounds,
            camera, turn, focal, lamp.luminance, lamp.share, ambient.matrix, GRIPPER_GLOSS, casters,
        )  # fmt: skip
        body.order(self._front, layers)
        fragments = (self._front, layers.fragments, layers.pixels, layers.starts)
        merge_gripper(out, self._keep, self._over, self._values, *fragments)
        make_room(out, body.total, body.touched)
        body.draw(out, self._keep, self._scratch, view, self.setting, casters)
        put_over(out, bodies, self._keep, body.total, body.touched, self._over, *fragments)
        return self._lens.form(out, scale, SPREAD), self._lens.bend_mask(bodies)

    def color(self, poses: Poses, index: int, scale: float = 1.0) -> np.ndarray:
        """Linear RGB in cd/m2 times `scale`, float32 of shape (height, width, 3)."""
        if not self._channels:
            self._channels = [Raycaster(self.params, self._sensor, self._held_m, channel) for channel in range(3)]
        return np.stack([one.draw(poses, index, scale)[0] for one in self._channels], -1)

    def _casters(self, view: View, boxes: Boxes, blockers: Boxes, links: LinkPoses | None, index: int) -> Casters:
        """What stands before the lamp: the object, the gripper's boxes and the arm's links."""
        lamp = self.setting.lamp
        outline = self._body.outline(view, lamp.position)
        solids = [
            (view.axes[None], view.place[None], self._body.half[None]),
            (view.turn @ boxes.turns, view.camera + boxes.places @ view.turn.T, boxes.halves),
        ]
        blocking = (
            np.concatenate([view.axes[None], view.turn @ blockers.turns]),
            np.concatenate([view.place[None], view.camera + blockers.places @ view.turn.T]),
            np.concatenate([self._body.half[None], blockers.halves]),
        )
        outlines = [NO_OUTLINE if outline is None else _alone(outline)]
        count = 0 if outline is None else 1
        numbers = [np.full(1 + len(boxes.halves), -1)]
        numbers[0][0] = count - 1
        if links is not None:
            own, found = cast_links(links, index, lamp.position, -view.turn[:, 2])
            solids.append(own)
            outlines.append(found)
            numbers.append(count + np.arange(len(own[0])))
        turns, places, halves = (np.concatenate(arrays) for arrays in zip(*solids, strict=True))
        edges, starts, *rest = zip(*outlines, strict=True)
        starts = np.concatenate([starts[0], *(len(edges[0]) + more[1:] for more in starts[1:])])
        return cast(
            lamp.position, lamp.radius_m, view.turn @ self._closing, turns, places, halves, PARTS[: len(halves)],
            blocking, np.concatenate(numbers), np.concatenate(edges), starts,
            *(np.concatenate(arrays) for arrays in rest),
        )  # fmt: skip

    def _opening(self, travel_m: float) -> Opening:
        opening = self._openings.at(travel_m)
        if opening is not self._current:
            self._current = opening
            count = opening.layers.fragments.shape[1]
            self._values, self._front = np.zeros(count, np.float32), np.zeros(count, np.float32)
            self._over = np.zeros(len(opening.layers.pixels), np.float32)
            self._keep[:] = 1.0
        return opening
