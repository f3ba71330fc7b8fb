"""The fast renderer: every surface is a formula, so that a frame is a few passes of plain arithmetic."""

from collections.abc import Iterator

import numpy as np

from evslip.config.params import Params
from evslip.events.frame import ARM
from evslip.rendering.camera import Camera
from evslip.rendering.geometry.hand import BOX_PARTS, Boxes
from evslip.rendering.geometry.links import CASTERS
from evslip.rendering.lens import SPREAD, Lens
from evslip.rendering.materials.paint import GRIPPER_GLOSS
from evslip.rendering.poses import ScenePoses
from evslip.rendering.raycast.arm import Arm, cast_links
from evslip.rendering.raycast.backdrop import Uncovered, backdrop
from evslip.rendering.raycast.body import make_body
from evslip.rendering.raycast.foreground_layer import ForegroundLayer, LayerBuffer, spans_of
from evslip.rendering.raycast.gripper import add_front, dim_behind, merge_gripper, shade_gripper
from evslip.rendering.raycast.layers import RED
from evslip.rendering.raycast.openings import Opening, Openings
from evslip.rendering.raycast.setting import LUMA, prepare
from evslip.rendering.scratch import make_scratch
from evslip.rendering.shadows.casters import ARM_PART, OBJECT_PART, Casters, cast
from evslip.rendering.shadows.mesh_shadow import Outline
from evslip.rendering.timing.foreground import foreground_motion
from evslip.rendering.timing.update_schedule import LAG, CellPlan, Cells, cell_motion, divide, plan_cells, plan_still
from evslip.rendering.viewpoint import View
from evslip.utils.errors import ConfigError

PARTS = np.array([OBJECT_PART, *BOX_PARTS, *[ARM_PART] * CASTERS])
"""Body of each caster."""
NO_OUTLINE = tuple(
    np.zeros(shape, kind)
    for shape, kind in (((0, 2, 3), np.float32), (1, np.int64), ((0, 3, 3), float), ((0, 3), float), ((0, 3), float))
)


def _alone(outline: Outline) -> tuple[np.ndarray, ...]:
    """Edges, starts, frames, origins and planes of `Casters`, of one outline."""
    starts = np.array([0, len(outline.edges)])
    return outline.edges, starts, outline.turn[None], outline.place[None], outline.plane[None]


def _joined(*boxes: tuple[np.ndarray, ...]) -> Boxes:
    """Several sets of boxes as one."""
    return Boxes(*(np.concatenate(arrays) for arrays in zip(*boxes, strict=True)))


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
        self._scratch = make_scratch()
        self.params = params
        self._closing = camera.rotation.T @ (1e-3, 1.0, 0.0)
        self.albedo_row = RED + channel
        self._body = make_body(params, camera, channel)
        self._arm = Arm(camera, GRIPPER_GLOSS)
        self._openings = Openings(camera, held_travel_m)
        self._current: Opening | None = None
        self._channels: list[Raycaster] = []
        self._image, self._keep = np.zeros((height, width), np.float32), np.ones((height, width), np.float32)
        self._cells = divide(height, width)
        self._stills = LayerBuffer(1, height, width)
        self._whole, self._alone = plan_still(self._cells), plan_still(Cells(1, 1, height, width))

    def draw(self, poses: ScenePoses, index: int, scale: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
        """Luminance in cd/m2 times `scale`, float32, and body indices, uint8, both new arrays (height, width)."""
        self._prepare(poses, index)
        self._draw_backdrop(self._stills, self._whole.slots[0])
        self._draw_foreground(self._stills.foreground(0))
        return self._composite(self._stills, self._whole, self._alone, 0, scale)

    def draw_sequence(self, poses: ScenePoses, scale: float = 1.0) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Frames as of `draw`, of all poses in turn, which have to be as close as `schedule.frame_times` has them.

        Each cell of the backdrop, and what stands before it, is drawn as often as it moves by as much as a frame may,
        see `update_schedule` and `foreground`; so a frame is ready LAG frames after it was begun.
        """
        count = len(poses.travel_m)
        changes = np.diff(self._openings.rounded(poses.travel_m)) != 0
        scene = poses, self.camera, self.params, self.setting.lamp
        behind, before = (
            plan_cells(self._sensor.stretch() * motion, changes, self.params.render.max_motion_px)
            for motion in (cell_motion(*scene), foreground_motion(*scene))
        )
        buffer = LayerBuffer(LAG + 2, *self._image.shape)
        for index in range(count + LAG):
            if index < count:
                self._prepare(poses, index)
                self._draw_backdrop(buffer, behind.slots[index])
                slot = int(before.slots[index, 0, 0])
                if slot >= 0:
                    self._draw_foreground(buffer.foreground(slot))
            if index >= LAG:
                yield self._composite(buffer, behind, before, index - LAG, scale)

    def _prepare(self, poses: ScenePoses, index: int) -> None:
        """Put everything where it is."""
        opening = self._opening(poses.travel_m[index])
        self._layers = opening.layers
        camera = poses.camera_position[index], poses.camera_rotation[index], self.camera.focal_px
        self._view = View(*camera, poses.object_position[index], poses.object_rotation[index])
        self._body.cover(self._view)
        self._links = None if poses.links is None else (poses.links, index)
        self._casters = self._cast(opening.boxes, opening.blockers)

    def _draw_backdrop(self, buffer: LayerBuffer, slots: np.ndarray) -> None:
        """Draw the cells that are due into their slots."""
        body = self._body
        uncovered = Uncovered(self._layers.seen, body.total, body.touched, body.full)
        due = buffer.backdrops, buffer.grounds, slots, self._cells
        backdrop(self._scratch, *due, self._view, self.setting, self._casters, uncovered)

    def _draw_foreground(self, layer: ForegroundLayer) -> None:
        """Draw what stands before the backdrop."""
        layers, view, casters, body, arm = self._layers, self._view, self._casters, self._body, self._arm
        if self._links is not None and arm.cover(*self._links, view):
            layer.wipe(self._span, body.touched, arm.touched)
            arm.mark(layer.marks, ARM)
            dim_behind(layer.light, layer.clear, arm.total, arm.touched)
            arm.draw(layer.light, self._scratch, view, self.setting, casters)
        else:
            layer.wipe(self._span, body.touched)
        own = GRIPPER_GLOSS, layers.fragments, self.albedo_row
        shade_gripper(self._scratch, self._values, view, self.setting, *own, casters)
        body.order(self._front, layers)
        fragments = (self._front, layers.fragments, layers.pixels, layers.starts)
        merge_gripper(layer.light, layer.clear, self._keep, self._over, self._values, *fragments)
        dim_behind(layer.light, layer.clear, body.total, body.touched)
        body.draw(layer.light, self._keep, self._scratch, view, self.setting, casters)
        add_front(layer.light, layer.marks, self._keep, body.total, body.touched, self._over, *fragments)

    def _composite(
        self, buffer: LayerBuffer, behind: CellPlan, before: CellPlan, index: int, scale: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """The frame of this number in the plans of backdrop and foreground."""
        bodies = buffer.composite(behind, before, index, self._cells, self._image)
        return self._lens.form(self._image, scale, SPREAD), self._lens.bend_mask(bodies)

    def color(self, poses: ScenePoses, index: int, scale: float = 1.0) -> np.ndarray:
        """Linear RGB in cd/m2 times `scale`, float32 of shape (height, width, 3)."""
        if not self._channels:
            self._channels = [Raycaster(self.params, self._sensor, self._held_m, channel) for channel in range(3)]
        return np.stack([one.draw(poses, index, scale)[0] for one in self._channels], -1)

    def _cast(self, boxes: Boxes, blockers: Boxes) -> Casters:
        """Casters before the lamp: the object, the gripper's boxes and the arm's links."""
        lamp, view, half = self.setting.lamp, self._view, self._body.half
        outline = self._body.outline(view, lamp.position)
        own = view.axes[None], view.place[None], half[None]
        blocking = _joined(own, self._in_world(blockers))
        casting: list[tuple[np.ndarray, ...]] = [_joined(own, self._in_world(boxes))]
        contours = [NO_OUTLINE if outline is None else _alone(outline)]
        count = 0 if outline is None else 1
        numbers = [np.full(1 + len(boxes.halves), -1)]
        numbers[0][0] = count - 1
        if self._links is not None:
            links, found = cast_links(*self._links, lamp.position, -view.turn[:, 2])
            casting.append(links)
            contours.append(found)
            numbers.append(count + np.arange(len(links[0])))
        joined = _joined(*casting)
        edges, starts, *rest = zip(*contours, strict=True)
        starts = np.concatenate([starts[0], *(len(edges[0]) + more[1:] for more in starts[1:])])
        contour = np.concatenate(edges), starts, *(np.concatenate(arrays) for arrays in rest)
        parts, along = PARTS[: len(joined.halves)], view.turn @ self._closing
        return cast(lamp.position, lamp.radius_m, along, joined, parts, blocking, np.concatenate(numbers), contour)

    def _in_world(self, boxes: Boxes) -> Boxes:
        """Boxes that are given in camera axes."""
        view = self._view
        return Boxes(view.turn @ boxes.turns, view.camera + boxes.places @ view.turn.T, boxes.halves)

    def _opening(self, travel_m: float) -> Opening:
        opening = self._openings.at(travel_m)
        if opening is not self._current:
            self._current = opening
            count = opening.layers.fragments.shape[1]
            self._values, self._front = np.zeros(count, np.float32), np.zeros(count, np.float32)
            self._over = np.zeros(len(opening.layers.pixels), np.float32)
            self._keep[:] = 1.0
            self._span = spans_of(opening.layers.pixels, *self._keep.shape)
        return opening
