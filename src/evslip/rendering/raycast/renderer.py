"""The fast renderer: every surface is a formula, so that a frame is a few passes of plain arithmetic."""

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from evslip.config.params import Params
from evslip.events.frame import ARM
from evslip.rendering.camera import Camera
from evslip.rendering.distractors.bodies import DistractorBodies
from evslip.rendering.distractors.distractor import Distractor
from evslip.rendering.geometry.hand import Boxes, block_parts, box_parts, joined
from evslip.rendering.geometry.links import MOST_LINKS, caster_count, hulls, solids
from evslip.rendering.geometry.supersampling import RED
from evslip.rendering.lens import SPREAD, Lens
from evslip.rendering.materials.paint import GRIPPER_GLOSS
from evslip.rendering.poses import ScenePoses
from evslip.rendering.raycast.arm import Arm
from evslip.rendering.raycast.backdrop import TableLight, draw_backdrop
from evslip.rendering.raycast.body import make_body
from evslip.rendering.raycast.foreground_layer import ForegroundLayer, LayerBuffer, spans_of
from evslip.rendering.raycast.gripper import add_front, dim_behind, merge_gripper, shade_gripper
from evslip.rendering.raycast.openings import Opening, Openings
from evslip.rendering.raycast.setting import LUMA, prepare
from evslip.rendering.raycast.table_light import light_table
from evslip.rendering.raycast.uncovered import Uncovered, due_runs
from evslip.rendering.scratch import make_scratch
from evslip.rendering.shading.illumination import Illumination, illuminate
from evslip.rendering.shadows.casters import ARM_PART, OBJECT_PART, cast
from evslip.rendering.shadows.mesh_shadow import outlines_of
from evslip.rendering.timing.cell_motion import GAP_M, LAG, LIGHT_LAG, Cells, cell_motion, cell_sway, divide
from evslip.rendering.timing.foreground import foreground_motion
from evslip.rendering.timing.redraw import Redraw
from evslip.rendering.timing.schedule import arm_motion, distractor_motion
from evslip.rendering.timing.update_schedule import LIGHT_STEPS, CellPlan, plan_cells, plan_single, plan_still
from evslip.rendering.viewpoint import View
from evslip.utils.errors import ConfigError


class Raycaster:
    """Draws one sample, one colour channel, at one resolution."""

    def __init__(
        self,
        params: Params,
        camera: Camera,
        held_travel_m: float,
        channel: int = LUMA,
        openings: Openings | None = None,
        distractors: Sequence[Distractor] = (),
    ):
        """held_travel_m: finger travel while the object is held, as in `Openings`; `openings`: those of another
        channel, which are the same; distractors: those of the poses that are drawn."""
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
        self.albedo_row, self._is_glossy = RED + channel, self.setting.table.reflectance > 0
        # Body of each caster, and of each box that keeps light from all around away.
        self._casting = np.array([OBJECT_PART, *box_parts(camera.fingers, camera.gripper), *[ARM_PART] * MOST_LINKS])
        self._blocking = np.array([OBJECT_PART, *block_parts(camera.fingers)])
        self._body = make_body(params, camera, channel)
        self._arm = Arm(camera, GRIPPER_GLOSS)
        self._distractor_bodies, self._distractors = DistractorBodies(distractors, camera, channel), distractors
        self._openings = openings or Openings(camera, held_travel_m)
        self._current: Opening | None = None
        self._channels: list[Raycaster] = []
        self._image, self._keep = np.zeros((height, width), np.float32), np.ones((height, width), np.float32)
        self._cells = divide(height, width)
        nothing = np.zeros((height, 2), np.int64)
        self._everything = np.broadcast_to(np.array([0, width]), (height, 1, 2)).copy()
        self._without_object = Uncovered(nothing[None], np.zeros_like(self._image), nothing, nothing)
        self._whole, self._alone = plan_still(self._cells), plan_still(Cells(1, 1, height, width))

    def draw(self, poses: ScenePoses, index: int, scale: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
        """Luminance in cd/m2 times `scale`, float32, and body indices, uint8, both new arrays (height, width)."""
        layers = [self._alone] * (2 if len(self._distractor_bodies) else 1)
        lights, buffer = self._light_buffer(1), LayerBuffer(1, [1] * len(layers), *self._image.shape)
        self._place(poses, index)
        self._grip(poses, index)
        light = self._illumination()
        self._draw_light(lights, self._whole.slots[0], light)
        self._draw_backdrop(buffer, self._whole.slots[0], lights, self._whole, 0)
        if len(self._distractor_bodies):
            self._draw_distractors(buffer.layer(0, 0), light)
        self._draw_foreground(buffer.layer(len(layers) - 1, 0), light)
        return self._composite(buffer, self._whole, layers, 0, scale)

    def draw_sequence(
        self, poses: ScenePoses, scale: float = 1.0, *, live: bool = False
    ) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Frames as of `draw`, of all poses in turn, which have to be as close as `schedule.frame_times` has them.

        Each cell of the backdrop, the light on it, and what stands before it, is drawn as often as it moves by as much
        as a frame may, see `update_schedule` and `foreground`; so a frame is ready LIGHT_LAG + LAG frames after it was
        begun. live: the object's poses may change until a frame is asked for; the foreground is then drawn no earlier,
        and the backdrop behind the object, too.
        """
        count = len(poses.travel_m)
        changes = np.diff(self._openings.rounded(poses.travel_m)) != 0
        scene, limit = (poses, self.camera, self.params, self.setting.lamp), self.params.render.max_motion_px
        moved, light_moved = (self._sensor.stretch() * way for way in cell_motion(*scene, self._is_glossy))
        sway = cell_sway(poses, self.camera, self.params, self._sensor.stretch())
        behind = plan_cells(moved, changes, limit, sway=sway)
        if sway is not None:
            sway = sway._replace(limit_px=LIGHT_STEPS * sway.limit_px)
        shine = plan_cells(light_moved, changes, LIGHT_STEPS * limit, LIGHT_LAG, together=True, sway=sway)
        motions = [] if live else [foreground_motion(*scene)]
        if len(self._distractor_bodies):
            aside = np.maximum(distractor_motion(poses, self.camera), arm_motion(poses, self.camera))
            motions.insert(0, aside[:, None, None])
        layers = [
            plan_cells(self._sensor.stretch() * way, changes, limit, LIGHT_LAG, ahead=LIGHT_LAG + LAG)
            for way in motions
        ]
        redraw = Redraw(*scene) if live else None
        if live:
            layers.append(plan_single(count))
        lit, drawn, *kept = (int(plan.before.max()) + 1 for plan in (shine, behind, *layers))
        lights, buffer = self._light_buffer(lit), LayerBuffer(drawn, kept, *self._image.shape)
        for step in range(count + LIGHT_LAG + LAG):
            if step < count and max(plan.slots[step].max() for plan in (shine, *layers)) >= 0:
                self._place(poses, step, live)
                self._grip(poses, step, self._openings.about)
                light = self._illumination()
                if shine.slots[step].max() >= 0:
                    self._draw_light(lights, shine.slots[step], light)
                aside, own = int(layers[0].slots[step, 0, 0]), int(layers[-1].slots[step, 0, 0])
                if len(layers) > 1 and aside >= 0:
                    self._draw_distractors(buffer.layer(0, aside), light)
                if own >= 0:
                    self._draw_foreground(buffer.layer(len(layers) - 1, own), light)
            index = step - LIGHT_LAG
            if 0 <= index < count:
                self._place(poses, index, live)
                if poses.mounts is None:
                    self._grip(poses, index)
                self._draw_backdrop(buffer, behind.slots[index], lights, shine, index)
            if index >= LAG:
                if redraw is not None and redraw.is_due(poses, index - LAG):
                    self._place(poses, index - LAG)
                    self._grip(poses, index - LAG, self._openings.about)
                    self._draw_foreground(buffer.layer(len(layers) - 1, 0), self._illumination())
                yield self._composite(buffer, behind, layers, index - LAG, scale)

    def _light_buffer(self, slots: int) -> tuple[np.ndarray, np.ndarray]:
        """Light on the surface: what its texture is multiplied with, and what is mirrored, if anything."""
        shape = (slots, *self._image.shape)
        return np.zeros(shape, np.float32), np.zeros(shape if self._is_glossy else (0, 0, 0), np.float32)

    def _place(self, poses: ScenePoses, index: int, alone: bool = False) -> None:
        """Put camera, object and arm where they are. alone: to draw the backdrop as if no object hid any of it."""
        self._at_us = int(poses.at_us[index])
        camera = poses.camera_position[index], poses.camera_rotation[index], self.camera.focal_px
        self._view = View(*camera, poses.object_position[index], poses.object_rotation[index])
        if not alone:
            self._body.cover(self._view)
        self._links = None if poses.links is None else (poses.links, index)
        sky = poses.background_turns[index]
        self._sky_view = self._view._replace(camera=sky.T @ self._view.camera, turn=sky.T @ self._view.turn)
        # How much the gripper hides of what is behind it changes from frame to frame where the camera trembles.
        whole, body = self._without_object._replace(seen=self._everything), self._body
        self._uncovered = whole if alone else Uncovered(self._everything, body.total, body.touched, body.full)

    def _grip(self, poses: ScenePoses, index: int, displaced: Callable[[float, Camera], Opening] | None = None) -> None:
        """Put the gripper where it is. displaced: what finds its opening where vibration moves the camera."""
        camera = poses.mounted(self.camera, index)
        find = self._openings.at if displaced is None or poses.mounts is None else displaced
        opening = find(poses.travel_m[index], camera)
        self._uncovered = self._uncovered._replace(seen=opening.layers.seen)
        if opening is not self._current:
            self._current, self._layers = opening, opening.layers
            count = opening.layers.fragments.shape[1]
            self._front = np.zeros(count, np.float32)
            self._over = np.zeros(len(opening.layers.pixels), np.float32)
            self._keep[:] = 1.0
            self._span = spans_of(opening.layers.pixels, *self._keep.shape)

    def _draw_light(self, lights: tuple[np.ndarray, np.ndarray], slots: np.ndarray, light: Illumination) -> None:
        """Draw the light on the surface in the cells that are due into their slots."""
        view, uncovered = self._view, self._uncovered
        if view.place[2] - np.abs(view.axes[2]) @ self._body.half > GAP_M:
            uncovered = self._without_object._replace(seen=uncovered.seen)
        runs = due_runs(slots, self._cells, self.camera.width, uncovered)
        light_table(self._scratch, runs, view, self.setting, light, uncovered, lights)

    def _draw_backdrop(
        self, buffer: LayerBuffer, slots: np.ndarray, lights: tuple[np.ndarray, np.ndarray], shine: CellPlan, index: int
    ) -> None:
        """Draw the cells that are due into their slots, in the light of the frame's number in the plan `shine`."""
        runs = due_runs(slots, self._cells, self.camera.width, self._uncovered)
        light = TableLight(*lights, *(part[index] for part in shine[1:]))
        own, out = (self._view, self._sky_view, self.setting, light), (buffer.backdrops, buffer.grounds)
        draw_backdrop(self._scratch, runs, *own, self._cells, self._uncovered, out)

    def _draw_distractors(self, layer: ForegroundLayer, light: Illumination) -> None:
        """Draw the distractors, and the arm among them."""
        seen = self._links is not None and self._arm.cover(*self._links, self._view)
        arm = self._arm if seen else None
        self._distractor_bodies.draw(layer, self._scratch, self._at_us, self._view, light, arm)

    def _draw_foreground(self, layer: ForegroundLayer, light: Illumination) -> None:
        layers, view, body, arm = self._layers, self._view, self._body, self._arm
        # Distractors may stand before the arm, so it is among them where there are any.
        if self._links is not None and not len(self._distractor_bodies) and arm.cover(*self._links, view):
            layer.wipe(self._span, body.touched, arm.touched)
            arm.mark(layer.marks, ARM)
            dim_behind(layer.light, layer.clear, arm.total, arm.touched)
            arm.draw(layer.light, self._scratch, view, light)
        else:
            layer.wipe(self._span, body.touched)
        step_m = float(view.turn[:, 2] @ (view.camera - view.place)) / view.focal
        values = shade_gripper(self._scratch, light, layers.fragments, self.albedo_row, GRIPPER_GLOSS, step_m)
        body.order(self._front, layers)
        fragments = (self._front, layers.fragments, layers.pixels, layers.starts)
        merge_gripper(layer.light, layer.clear, self._keep, self._over, values, *fragments)
        dim_behind(layer.light, layer.clear, body.total, body.touched)
        body.draw(layer.light, self._keep, self._scratch, view, light)
        add_front(layer.light, layer.marks, self._keep, body.total, body.touched, self._over, *fragments)

    def _composite(
        self, buffer: LayerBuffer, behind: CellPlan, before: Sequence[CellPlan], index: int, scale: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """The frame of this number in the plans of backdrop and layers."""
        bodies = buffer.composite(behind, before, index, self._cells, self._image)
        return self._lens.form(self._image, scale, SPREAD), self._lens.bend_mask(bodies)

    def color(self, poses: ScenePoses, index: int, scale: float = 1.0) -> np.ndarray:
        """Linear RGB in cd/m2 times `scale`, float32 of shape (height, width, 3)."""
        if not self._channels:
            own = self.params, self._sensor, self._held_m
            same = self._openings, self._distractors
            self._channels = [Raycaster(*own, channel, *same) for channel in range(3)]
        return np.stack([one.draw(poses, index, scale)[0] for one in self._channels], -1)

    def _illumination(self) -> Illumination:
        """The light, and what stands before the lamp: object, gripper's boxes, arm's links and distractors."""
        view, opening, solid = self._view, self._current, self._body.solid
        assert opening is not None
        lamp, turn = view.turn.T @ (self.setting.lamp.position - view.camera), view.turn.T
        own = Boxes((turn @ view.axes)[None], (turn @ (view.place - view.camera))[None], self._body.half[None])
        boxes = joined([own, opening.boxes])
        numbers = np.full(len(boxes.places), -1)
        meshes, turns, places = [], np.zeros((0, 3, 3)), np.zeros((0, 3))
        if solid is not None:
            meshes, turns, places, numbers[0] = [solid], own.turns, own.places, 0
        if self._links is not None:
            poses, index = self._links
            arm, count = poses.arm, caster_count(poses.arm)
            middles = (poses.middles[index] - view.camera) @ turn.T
            links = Boxes(turn @ poses.turns[index], middles, hulls(arm).halves)
            boxes = joined([boxes, Boxes(*(part[:count] for part in links))])
            numbers = np.concatenate([numbers, len(meshes) + np.arange(count)])
            origins = (poses.places[index, :count] - view.camera) @ turn.T
            meshes = [*meshes, *solids(arm)]
            turns, places = np.concatenate([turns, links.turns[:count]]), np.concatenate([places, origins])
        parts, others = self._casting[: len(numbers)], self._distractor_bodies.boxes(self._at_us, view)
        if len(self._distractor_bodies):
            round_ones = np.array([one is not None for one in self._distractor_bodies.solids])
            boxes, parts = joined([boxes, others]), np.concatenate([parts, self._distractor_bodies.parts])
            numbers = np.concatenate([numbers, np.where(round_ones, len(meshes) + np.cumsum(round_ones) - 1, -1)])
            meshes = [*meshes, *(one for one in self._distractor_bodies.solids if one is not None)]
            turns = np.concatenate([turns, others.turns[round_ones]])
            places = np.concatenate([places, others.places[round_ones]])
        outlines = outlines_of(meshes, places, turns, lamp, turn[:, :2] @ -view.turn[:2, 2])
        casters = cast(lamp, self.setting.lamp.radius_m, boxes, parts, numbers, outlines)
        standing = Boxes(*(part[self._distractor_bodies.on_table] for part in others))
        blockers = joined([own, opening.blockers])
        return illuminate(view, self._sky_view.turn, self.setting, casters, blockers, self._blocking, standing)
