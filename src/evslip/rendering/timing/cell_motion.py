"""Motion of each part of the backdrop in the image: surface, background, shadows and the lamp's light.

The image is divided into cells. For each the farthest way that anything in it moves between two poses is found; it says
when the cell is drawn anew, see `update_schedule`.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from evslip.config.params import Params
from evslip.physics.robots.catalogue import robot_of
from evslip.rendering.camera import Camera
from evslip.rendering.geometry.hand import shadow_boxes
from evslip.rendering.geometry.links import caster_count
from evslip.rendering.poses import ScenePoses
from evslip.rendering.raycast.setting import Lamp
from evslip.rendering.scratch import TILE_H, TILE_W
from evslip.rendering.timing import schedule
from evslip.scene.shapes import shape_of
from evslip.scene.shapes.surface import BOX_CORNERS

ROWS, COLUMNS = 17, 6
"""About so many cells; they are made of whole tiles."""
LAG, LIGHT_LAG = 5, 16
"""A cell is drawn at least in every so-manieth frame, and the light on it."""
HIGHLIGHT = 0.2
"""A highlight on a glossy table that moves by a pixel counts as this much: it is broad."""
STEADY_PX = 0.05
"""An edge that has moved so far is drawn anew: over less than that, what it covers of a pixel grows as time does. An
object's edge has uncovered something, so the cells around it are drawn anew, too. So is the light on them where the
surface has moved so far below an object that is about to stand on it: the gap between them is dark."""
SWAY_PX = 0.1
"""Farthest that what trembles may be from the line between two drawings; the parabola that it is blended along leaves
out a part of that."""
GAP_M = 0.01
"""Height over the surface that counts as near; an object higher than that uncovers light that was drawn before."""
ASIDE_PX = 2.0
"""Distance from an object's corners at which it may cover pixels."""
LOWEST = 0.05
"""Least height of the lamp over a point of a body, as a share of the lamp's own, at which its shadow is followed."""
ASIDE_M = 0.02
"""Distance from a body's shadow at which it is still dark, beyond its penumbra."""
STEP_M = 1e-4
"""For differences in place of derivatives."""


class Cells(NamedTuple):
    """A grid over the image; the last row and column may be cut."""

    rows: int
    columns: int
    height: int
    """Height of a cell, in pixels."""
    width: int


class Sway(NamedTuple):
    """Way of what trembles to and fro, which is back before it has moved far."""

    t_us: np.ndarray
    """Times of the frames, float64 (m,)."""
    places: np.ndarray
    """Places in the image, in pixels, of what the corners of the cells show; (m, rows + 1, columns + 1, 2)."""
    limit_px: float
    """Farthest that any of them may be from the line, in time, between two drawings."""


def divide(height: int, width: int) -> Cells:
    """The cells of an image."""
    tall, wide = -(-height // (ROWS * TILE_H)) * TILE_H, -(-width // (COLUMNS * TILE_W)) * TILE_W
    return Cells(-(-height // tall), -(-width // wide), tall, wide)


def cell_motion(
    poses: ScenePoses, camera: Camera, params: Params, lamp: Lamp, is_glossy: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Farthest movement in pixels of surface, background, shadows and lamp in each cell between consecutive poses, and
    that of the light on the surface alone, of shape (m - 1, rows, columns) each; where an object uncovers something, as
    much as asks for a new drawing.

    camera: a pinhole. The movement is found over LAG poses at a time, and shared out among them; over each where
    something trembles, since it may be back where it was LAG poses before.
    """
    lag = LAG if params.vibration.is_default else 1
    sampled = np.append(np.arange(0, len(poses.travel_m) - 1, lag), len(poses.travel_m) - 1)
    steps = np.diff(sampled)
    found = _motion_between(poses.some(sampled), camera, params, lamp, is_glossy)
    whole, light = (np.repeat(motion / steps[:, None, None], steps, 0) for motion in found)
    return whole, light


def cell_sway(poses: ScenePoses, camera: Camera, params: Params, stretch: float) -> Sway | None:
    """Way of surface and background; None where nothing trembles. stretch: as of `Camera.stretch`."""
    if params.vibration.is_default:
        return None
    pixels, shape, _ = _corners_of_cells(camera)
    hits, _ = schedule.scene_hits(poses, camera, pixels, params.background.radius_m)
    moved = stretch * np.cumsum(_project_next(poses, camera, hits) - pixels, axis=0)
    places = np.concatenate([np.zeros((1, *shape, 2)), moved.reshape(-1, *shape, 2)])
    return Sway(poses.at_us.astype(np.float64), places, SWAY_PX)


def _corners_of_cells(camera: Camera) -> tuple[np.ndarray, tuple[int, int], tuple[np.ndarray, np.ndarray]]:
    """Places in the image (n, 2), the shape of their grid, and their x and y."""
    cells = divide(camera.height, camera.width)
    x = np.minimum(np.arange(cells.columns + 1) * cells.width, camera.width)
    y = np.minimum(np.arange(cells.rows + 1) * cells.height, camera.height)
    pixels = np.stack(np.meshgrid(x, y), -1).reshape(-1, 2).astype(float)
    return pixels, (len(y), len(x)), (x, y)


def _motion_between(
    poses: ScenePoses, camera: Camera, params: Params, lamp: Lamp, is_glossy: bool
) -> tuple[np.ndarray, np.ndarray]:
    pixels, corners, (x, y) = _corners_of_cells(camera)
    hits, is_surface = schedule.scene_hits(poses, camera, pixels, params.background.radius_m)
    landing = _project_next(poses, camera, schedule.carried_on(poses, hits, is_surface))
    shape = (len(hits), *corners)
    motion = _largest(_length(landing - pixels).reshape(shape))
    light = np.zeros_like(motion)
    if lamp.luminance > 0:
        steps = [(_project_next(poses, camera, hits + STEP_M * axis) - landing) / STEP_M for axis in np.eye(3)[:2]]
        ground = _Ground(hits[..., :2].reshape(*shape, 2), is_surface.reshape(shape), landing - pixels, *steps)
        for corners in _bodies(poses, params):
            _follow_shadow(motion, light, corners, lamp, ground)
        corners = lamp.position + lamp.radius_m * BOX_CORNERS
        image, shift = _follow_points(poses, camera, corners)
        _at_least(motion, shift, _touched(image, x, y, 0.0))
        if is_glossy:
            _, shift = _follow_points(poses, camera, corners * (1, 1, -1))
            np.maximum(light, HIGHLIGHT * shift[:, None, None], out=light)
    corners = schedule.posed_corners(poses.object_position, poses.object_rotation, shape_of(params).outline())
    around = _touched(_project(poses, camera, corners), x, y, ASIDE_PX)
    often = params.render.max_motion_px / STEADY_PX
    uncovered = often * schedule.object_motion(poses, camera, params)
    height = corners[..., 2].min(1)
    below = around & (np.minimum(height[1:], height[:-1]) < GAP_M)[:, None, None]
    _at_least(light, uncovered, below)
    light = np.where(below, often * np.maximum(motion, light), light)
    _at_least(motion, uncovered, around)
    return np.maximum(motion, light), light


def _follow_points(poses: ScenePoses, camera: Camera, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Images (m, k, 3) of points (k, 3) that stand still in the world, and the farthest that any moves between
    consecutive poses, (m - 1,); 0 where one is not before the camera."""
    image = _project(poses, camera, np.broadcast_to(points, (len(poses.travel_m), *points.shape)))
    ahead = np.all(image[..., 2] > schedule.NEAR_M, 1)
    shift = _length(np.diff(image[..., :2], axis=0)).max(1)
    return image, np.where(ahead[1:] & ahead[:-1], shift, 0.0)


class _Ground(NamedTuple):
    """The surface at the cells' corners."""

    places: np.ndarray
    """In the world, of shape (m - 1, rows + 1, columns + 1, 2)."""
    is_surface: np.ndarray
    """Whether it is seen there, of shape (m - 1, rows + 1, columns + 1)."""
    moved: np.ndarray
    """Way that it moves in the image until the next pose, of shape (m - 1, n, 2)."""
    along_x: np.ndarray
    """Way that a step in the world moves it there, in pixels per metre, of shape (m - 1, n, 2)."""
    along_y: np.ndarray


def _bodies(poses: ScenePoses, params: Params) -> Iterator[np.ndarray]:
    """Corners (m, k, 3) of all that casts shadows: object, gripper, links and distractors."""
    yield schedule.posed_corners(poses.object_position, poses.object_rotation, shape_of(params).outline())
    boxes = shadow_boxes(float(np.median(poses.travel_m)), gripper=robot_of(params.robot).gripper)
    corners = boxes.places[:, None] + (boxes.halves[:, None] * BOX_CORNERS) @ boxes.turns.transpose(0, 2, 1)
    yield schedule.posed_corners(poses.hand_position, poses.hand_rotation, corners.reshape(-1, 3))
    links = poses.links
    if links is not None:
        for k in range(caster_count(links.arm)):
            yield schedule.posed_corners(links.places[:, k], links.turns[:, k], schedule.link_corners(links.arm, k))
    yield from schedule.distractor_corners(poses)


def _follow_shadow(motion: np.ndarray, light: np.ndarray, corners: np.ndarray, lamp: Lamp, ground: _Ground) -> None:
    """Raise the motion to that of a body's shadow on the surface, and `light` to that of an edge which counts as much;
    corners (m, k, 3): the body's.

    The shadow moves over the surface, which moves in the image itself: below what the hand carries, one undoes the
    other.
    """
    over = np.maximum(lamp.position[2] - corners[..., 2:], LOWEST * lamp.position[2])
    fall = np.maximum(corners[..., 2:], 0.0) / over
    shadow = corners[..., :2] + (corners[..., :2] - lamp.position[:2]) * fall
    aside = ASIDE_M + lamp.radius_m * fall.max(1)
    low, high = shadow.min(1) - aside, shadow.max(1) + aside
    low, high = np.minimum(low[1:], low[:-1]), np.maximum(high[1:], high[:-1])
    seen = ground.is_surface[..., None]
    some, whole = _largest(seen), _least(seen)
    first = np.where(whole, _least(ground.places), -np.inf)
    last = np.where(whole, _largest(ground.places), np.inf)
    where = np.all(some & (low[:, None, None] < last) & (high[:, None, None] > first), -1)
    shift = np.diff(shadow, axis=0)
    middle = shift.mean(1)
    spread = _length(shift - middle[:, None]).max(1)
    moved = ground.moved + ground.along_x * middle[:, None, :1] + ground.along_y * middle[:, None, 1:]
    steepness = np.hypot(_length(ground.along_x), _length(ground.along_y))
    way = np.where(ground.is_surface, (_length(moved) + steepness * spread[:, None]).reshape(seen.shape[:-1]), 0.0)
    way = np.where(where, _largest(way), 0.0)
    # Sharpest where the body is lowest; a wide penumbra may move farther.
    penumbra = steepness * (lamp.radius_m * np.minimum(fall[1:], fall[:-1]).min((1, 2)))[:, None]
    soft = np.maximum(1.0, schedule.SOFT * _least(penumbra.reshape(seen.shape[:-1])))
    np.maximum(motion, way, out=motion)
    np.maximum(light, way / soft, out=light)


def _length(vectors: np.ndarray) -> np.ndarray:
    return np.hypot(vectors[..., 0], vectors[..., 1])


def _project(poses: ScenePoses, camera: Camera, points: np.ndarray) -> np.ndarray:
    """Points (m, k, 3) of the world in the images of all poses, as of `Camera.project`."""
    return camera.project(schedule.into(poses.camera_position[:, None], poses.camera_rotation, points))


def _largest(values: np.ndarray) -> np.ndarray:
    """Largest of values (m, rows + 1, columns + 1, ...) at the corners of each cell."""
    pairs = np.maximum(values[:, 1:], values[:, :-1])
    return np.maximum(pairs[:, :, 1:], pairs[:, :, :-1])


def _least(values: np.ndarray) -> np.ndarray:
    pairs = np.minimum(values[:, 1:], values[:, :-1])
    return np.minimum(pairs[:, :, 1:], pairs[:, :, :-1])


def _at_least(motion: np.ndarray, least: np.ndarray, where: np.ndarray) -> None:
    """Raise the motion to `least` (m - 1,) in the cells (m - 1, rows, columns) that `where` marks."""
    np.maximum(motion, np.where(where, least[:, None, None], 0.0), out=motion)


def _touched(image: np.ndarray, x: np.ndarray, y: np.ndarray, aside_px: float) -> np.ndarray:
    """Cells that the points (m, k, 3) of an image may lie in, in either of two consecutive poses: of shape (m - 1,
    rows, columns). All of them where a point is not before the camera."""
    ahead = image[..., 2] > schedule.NEAR_M
    low = np.where(ahead[..., None], image[..., :2], -np.inf).min(1) - aside_px
    high = np.where(ahead[..., None], image[..., :2], np.inf).max(1) + aside_px
    low, high = np.minimum(low[1:], low[:-1]), np.maximum(high[1:], high[:-1])
    across = (low[:, :1] < x[1:]) & (high[:, :1] > x[:-1])
    down = (low[:, 1:] < y[1:]) & (high[:, 1:] > y[:-1])
    return down[:, :, None] & across[:, None, :]


def _project_next(poses: ScenePoses, camera: Camera, points: np.ndarray) -> np.ndarray:
    """Places of points (m - 1, k, 3) of the world in the image of the next pose."""
    return camera.project(schedule.into(poses.camera_position[1:, None], poses.camera_rotation[1:], points))[..., :2]
