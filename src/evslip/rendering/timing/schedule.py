"""Times at which to draw a frame: often enough that nothing moves far in the image, and no oftener."""

from collections.abc import Iterator

import numpy as np
from scipy.spatial import ConvexHull

from evslip.config.params import Params
from evslip.physics.robots.description import Arm
from evslip.physics.trajectory import Trajectory
from evslip.rendering.camera import Camera, hand_camera
from evslip.rendering.geometry.links import hulls, in_view
from evslip.rendering.geometry.supersampling import X, Z
from evslip.rendering.lamp import lamp_position
from evslip.rendering.poses import ScenePoses
from evslip.rendering.raycast.layers import resolve
from evslip.scene.shapes import shape_of
from evslip.scene.shapes.surface import BOX_CORNERS
from evslip.utils.errors import ConfigError

GRID = 7
"""Motion of the scene behind the object is measured at GRID x GRID places of the image."""
NEAR_M = 0.02
"""Corners of object and arm closer to the camera plane than this are not followed."""
SOFT = 0.2
"""A shadow that moves by this share of its penumbra's radius counts as a sharp edge that moves by a pixel."""
NEAR_SHADOW_M = 0.3
"""Distance from the object at which a passer's shadow counts as near: what the camera sees around it."""
LEAST_POINTS = 8
"""Least number of points of the gripper in view, for its motion to be followed."""
TICK_SLACK = 0.25
"""Share by which points may move farther between frames that have to come at given times, so that there are no more of
them than needed."""
LINK_CHECKS = 50
"""Every so many poses, it is seen which of the arm's links are in view."""


def frame_times(
    traj: Trajectory,
    start_us: int,
    end_us: int,
    *,
    camera: Camera | None = None,
    max_motion_px: float | None = None,
    every_us: int | None = None,
) -> np.ndarray:
    """Times in microseconds, int64, strictly increasing from `start_us` to `end_us`.

    Between two of them no point of object or arm and no place of surface or background moves farther in the image than
    `max_motion_px` (default: the parameters' render.max_motion_px, at the camera's resolution), and no more time passes
    than one period of render.min_rate_hz. `every_us`: each multiple of it after the start is among them; then points
    move farther by TICK_SLACK at most. Raises ConfigError.
    """
    check_span(traj, start_us, end_us)
    params = traj.params
    camera = camera or hand_camera(params)
    inside = traj.t_us[(traj.t_us > start_us) & (traj.t_us < end_us)]
    knots = np.concatenate([[start_us], inside, [end_us]]).astype(np.int64)
    motion = image_motion(ScenePoses(traj, camera, knots), camera, params)
    limit = max_motion_px or params.render.max_motion_px
    frames = np.maximum(motion / limit, np.diff(knots) * 1e-6 * params.render.min_rate_hz)
    progress = np.concatenate([[0.0], np.cumsum(frames)])
    if every_us is None:
        count = max(1, int(np.ceil(progress[-1] - 1e-9)))
        wanted = np.linspace(0.0, progress[-1], count + 1)
    else:
        ticks = np.append(np.arange(start_us, end_us, every_us), end_us)
        at = np.interp(ticks, knots, progress)
        counts = np.maximum(1, np.ceil(np.diff(at) / (1 + TICK_SLACK))).astype(int)
        wanted = np.interp(np.arange(counts.sum() + 1), np.append(0, np.cumsum(counts)), at)
    times = np.interp(wanted, progress, knots.astype(np.float64))
    return np.unique(np.round(times).astype(np.int64))


def check_times(traj: Trajectory, times_us: np.ndarray) -> None:
    """Raise ConfigError unless there are times, and all lie in the trajectory."""
    first, last = int(traj.t_us[0]), int(traj.t_us[-1])
    if not len(times_us) or times_us.min() < first or times_us.max() > last:
        found = f"{times_us.min()} to {times_us.max()} us" if len(times_us) else "no time"
        raise ConfigError(f"times_us: {found}; expected times in the trajectory, {first} to {last} us")


def check_span(traj: Trajectory, start_us: int, end_us: int) -> None:
    """Raise ConfigError unless the span is a piece of the trajectory."""
    first, last = int(traj.t_us[0]), int(traj.t_us[-1])
    if not first <= start_us < end_us <= last:
        raise ConfigError(f"span: {start_us} to {end_us} us is not inside the trajectory's {first} to {last} us")


def image_motion(poses: ScenePoses, camera: Camera, params: Params) -> np.ndarray:
    """Farthest movement in pixels of any visible point between consecutive poses; of shape (m - 1,).

    Under a lens with distortion: an upper bound.
    """
    plain, radius_m = camera.pinhole(), params.background.radius_m
    moved = np.maximum(object_motion(poses, plain, params), _scene_motion(poses, plain, radius_m))
    moved = np.maximum(moved, gripper_motion(poses, plain))
    moved = np.maximum(moved, distractor_motion(poses, plain))
    moved = np.maximum(moved, passing_shadow_motion(poses, plain, params))
    return camera.stretch() * np.maximum(moved, arm_motion(poses, plain))


def object_motion(poses: ScenePoses, camera: Camera, params: Params) -> np.ndarray:
    """Farthest movement in pixels of the object's corners between consecutive poses, (m - 1,); 0 out of view."""
    corners = shape_of(params).outline()
    return _corner_motion(poses, camera, poses.object_position, poses.object_rotation, corners)


def gripper_motion(poses: ScenePoses, camera: Camera) -> np.ndarray | float:
    """Farthest movement of what is seen of the gripper, (m - 1,), its fingers as wide open as in the middle; 0 where
    the camera does not tremble, and the gripper stands still in the image."""
    if poses.mounts is None:
        return 0.0
    points = resolve(camera, float(np.median(poses.travel_m))).fragments[X : Z + 1].T.astype(np.float64)
    if len(points) < LEAST_POINTS:
        return 0.0
    # What moves farthest lies on the hull of place and nearness, on which the motion in the image depends linearly.
    image = camera.project(points)
    hull = ConvexHull(np.column_stack([image[:, :2] / camera.focal_px, 1 / image[:, 2]]), qhull_options="QJ").vertices
    corners = camera.position + points[hull] @ camera.rotation.T
    return _corner_motion(poses, camera, poses.hand_position, poses.hand_rotation, corners)


def distractor_corners(poses: ScenePoses) -> Iterator[np.ndarray]:
    """Corners (m, k, 3) of each distractor in the world."""
    for one in poses.distractors:
        yield one.places(poses.at_us)[:, None] + one.shape.outline() @ one.axes.T


def distractor_motion(poses: ScenePoses, camera: Camera) -> np.ndarray:
    """Farthest movement of the distractors' corners while they are in view, (m - 1,)."""
    motion = np.zeros(len(poses.travel_m) - 1)
    for corners in distractor_corners(poses):
        motion = np.maximum(motion, _farthest_motion(poses, camera, corners))
    return motion


def passing_shadow_motion(poses: ScenePoses, camera: Camera, params: Params) -> np.ndarray:
    """Movement of the shadows that passers throw about the object, (m - 1,), where they are near; that of a soft one
    counts less, see SOFT."""
    motion, light = np.zeros(len(poses.travel_m) - 1), params.light
    moving = [one for one in poses.distractors if not one.is_still]
    if not moving or light.luminance_cd_m2 == 0:
        return motion
    lamp = lamp_position(params)
    away = np.linalg.norm(poses.object_position - lamp, axis=1)
    px_per_m = camera.focal_px / np.linalg.norm(poses.object_position - poses.camera_position, axis=1)
    for one in moving:
        way = one.places(poses.at_us) - lamp
        scale = away / np.linalg.norm(way, axis=1)
        shadow = lamp + way * scale[:, None]
        penumbra = light.radius_m * np.abs(scale - 1)
        reach = NEAR_SHADOW_M + penumbra + scale * float(np.linalg.norm(one.shape.half_m))
        near = np.linalg.norm(shadow - poses.object_position, axis=1) < reach
        shift = np.linalg.norm(np.diff(shadow, axis=0), axis=1) * px_per_m[1:]
        soft = np.maximum(1.0, SOFT * penumbra * px_per_m)[1:]
        motion = np.maximum(motion, np.where(near[1:] | near[:-1], shift / soft, 0.0))
    return motion


def arm_motion(poses: ScenePoses, camera: Camera) -> np.ndarray | float:
    """Farthest movement of the corners of the arm's links, (m - 1,); 0 where there is no arm."""
    links = poses.links
    if links is None:
        return 0.0
    parts = hulls(links.arm)
    slopes = camera.width / 2 / camera.focal_px, camera.height / 2 / camera.focal_px
    motion = np.zeros(len(poses.camera_position) - 1)
    for k in range(len(parts.centres)):
        one = slice(k, k + 1)
        looks = range(0, len(poses.camera_position), LINK_CHECKS)
        if any(
            in_view(
                links.places[i, one], links.turns[i, one], parts.centres[one], parts.halves[one],
                poses.camera_position[i], poses.camera_rotation[i], *slopes,
            )
            for i in looks
        ):  # fmt: skip
            motion = np.maximum(
                motion, _corner_motion(poses, camera, links.places[:, k], links.turns[:, k], link_corners(links.arm, k))
            )
    return motion


def link_corners(arm: Arm, k: int) -> np.ndarray:
    """Corners (8, 3) of the box around a link, in its frame."""
    parts = hulls(arm)
    return parts.centres[k] + BOX_CORNERS * parts.halves[k]


def posed_corners(places: np.ndarray, turns: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Corners (k, 3) of a body in the world, (m, k, 3); places (m, 3), turns (m, 3, 3): its poses."""
    return places[:, None] + corners @ turns.transpose(0, 2, 1)


def _corner_motion(
    poses: ScenePoses, camera: Camera, places: np.ndarray, turns: np.ndarray, corners: np.ndarray
) -> np.ndarray:
    """Farthest movement of a body's corners (k, 3) while it is in view; places (m, 3), turns (m, 3, 3): its poses."""
    return _farthest_motion(poses, camera, posed_corners(places, turns, corners))


def _farthest_motion(poses: ScenePoses, camera: Camera, world: np.ndarray) -> np.ndarray:
    """Farthest movement of points (m, k, 3) of the world while any of them may be in view."""
    image = camera.project(into(poses.camera_position[:, None], poses.camera_rotation, world))
    ahead = image[..., 2] > NEAR_M
    moved = np.hypot(*np.moveaxis(np.diff(image[..., :2], axis=0), -1, 0))
    moved = np.where(ahead[1:] & ahead[:-1], moved, 0.0).max(1)
    low = np.where(ahead[..., None], image[..., :2], np.inf).min(1)
    high = np.where(ahead[..., None], image[..., :2], -np.inf).max(1)
    visible = np.all((low < (camera.width, camera.height)) & (high > 0), 1)
    return np.where(np.logical_or(visible[1:], visible[:-1]), moved, 0.0)


def _scene_motion(poses: ScenePoses, camera: Camera, radius_m: float) -> np.ndarray:
    x, y = np.meshgrid(np.linspace(0, camera.width, GRID), np.linspace(0, camera.height, GRID))
    pixels = np.stack([x.ravel(), y.ravel()], 1)
    hits = carried_on(poses, *scene_hits(poses, camera, pixels, radius_m))
    points = into(poses.camera_position[1:, None], poses.camera_rotation[1:], hits)
    moved = camera.project(points)[..., :2] - pixels
    return np.hypot(moved[..., 0], moved[..., 1]).max(1)


def scene_hits(poses: ScenePoses, camera: Camera, pixels: np.ndarray, radius_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Surface and background that each pose but the last sees at places (k, 2) of the image: points of the world
    (m - 1, k, 3), and whether they lie on the surface, (m - 1, k). camera: a pinhole."""
    rays = np.stack([pixels[:, 0] - camera.width / 2, camera.height / 2 - pixels[:, 1]], 1) / camera.focal_px
    rays = np.concatenate([rays, np.full((len(rays), 1), -1.0)], 1)
    origin = poses.camera_position[:-1, None]
    rays = rays @ poses.camera_rotation[:-1].transpose(0, 2, 1)
    a, b = np.sum(rays * rays, -1), np.sum(origin * rays, -1)
    distance = (np.sqrt(b * b - a * (np.sum(origin * origin, -1) - radius_m**2)) - b) / a
    drop = np.minimum(rays[..., 2], -1e-9)
    to_surface = np.where(drop > -1e-9, np.inf, -origin[..., 2] / drop)
    return origin + np.minimum(distance, to_surface)[..., None] * rays, to_surface < distance


def carried_on(poses: ScenePoses, hits: np.ndarray, is_surface: np.ndarray) -> np.ndarray:
    """Places at the next pose of what `scene_hits` found: the background may turn."""
    turns = poses.background_turns
    if (turns == turns[0]).all():
        return hits
    moved = hits @ (turns[1:] @ turns[:-1].transpose(0, 2, 1)).transpose(0, 2, 1)
    return np.where(is_surface[..., None], hits, moved)


def into(position: np.ndarray, rotation: np.ndarray, points: np.ndarray) -> np.ndarray:
    """World points (m, k, 3) in the axes of frames (m, 1, 3), (m, 3, 3)."""
    return (points - position) @ rotation
