"""Light on the table behind object and hand: what its texture is multiplied with, and what it mirrors.

Shadows of hand and object nearly stand still before a camera on the hand while the texture flows under them: light is
drawn in fewer frames than the texture, and blended between them, see `update_schedule`.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from evslip.rendering.geometry.plane import meet_plane
from evslip.rendering.materials.paint import WIDTH
from evslip.rendering.raycast.setting import Setting, table_origin, table_plane
from evslip.rendering.raycast.uncovered import Uncovered, aim_rays, look_below_horizon
from evslip.rendering.scratch import ONE, ZERO, Scratch, blocks, f32, kernel
from evslip.rendering.shading.environment_reflection import glint, mirror
from evslip.rendering.shading.illumination import Illumination
from evslip.rendering.shading.sphere import meet_sphere
from evslip.rendering.shading.surface_light import light_plane, received_light
from evslip.rendering.shadows.casters import NO_PART, Patches, lamp_share
from evslip.rendering.shadows.occlusion import PITCH, between, between_columns, open_run, openness
from evslip.rendering.slots import GLOSS, GROUND, LIT, OPEN, RAY_X, RAY_Y, RESULT, ROOM
from evslip.rendering.viewpoint import View


class TablePoints(NamedTuple):
    """Places of the table, one a pixel, and what falls on them where nothing stands between."""

    where: np.ndarray
    """Flat index in the slots of the light; int64 (n,)."""
    places: np.ndarray
    """In camera axes, float32 (3, n); float32 (n,) what follows."""
    rooms: np.ndarray
    """Share of the pixel that the point stands for."""
    opened: np.ndarray
    """Share of the light from all around that reaches it."""
    lit: np.ndarray
    """Light of the lamp, as luminance of white."""
    glossy: np.ndarray
    """Mirrored lamp."""
    mirrored: np.ndarray
    """Mirrored background."""


def light_table(
    scratch: Scratch, runs: np.ndarray, view: View, setting: Setting, light: Illumination, uncovered: Uncovered,
    out: tuple[np.ndarray, np.ndarray],
) -> None:  # fmt: skip
    """Draw the light of `uncovered.due_runs` into `out`: what the texture is multiplied with, and what is mirrored,
    (slots, height, width) each; the latter only where the table shines."""
    height, width = out[0].shape[1:]
    count, glossy = int((runs[:, 2] - runs[:, 1]).sum()), setting.table.reflectance > 0
    arrays = [np.empty((3, count), np.float32)] + [np.empty(count, np.float32) for _ in range(5)]
    points = TablePoints(np.empty(count, np.int64), *arrays)
    patches = Patches(np.zeros(len(runs) + 1, np.int64), np.zeros((len(runs), 2, 3)), np.zeros((len(runs), 4)))
    plane = table_plane(view, setting)
    nodes = open_nodes(scratch, height, width, view, setting.sky.radius_m, plane, light.blockers)
    lamp, sky, table = setting.lamp, setting.sky, setting.table
    origin = table_origin(view, table.tile_m)
    centre = (lamp.position - origin).astype(np.float32)
    strength = centre, np.float32(lamp.luminance * lamp.radius_m**2), np.float32(lamp.radius_m)
    camera = view.camera.astype(np.float32), view.turn.astype(np.float32), view.focal, np.float32(sky.radius_m)
    openings = nodes, between_columns(nodes, width)
    shine = np.float32(table.reflectance), table.reflection
    _gather(scratch, runs, camera, plane, strength, shine, openings, uncovered, points, patches)
    parts = np.full(count, NO_PART, np.float32)
    seen = lamp_share(scratch, light.casters, points.places, points.rooms, parts, points.lit, patches, False)
    received = received_light(table.ambient, points.opened, points.lit, seen, points.glossy, points.mirrored)
    for image, values in zip(out if glossy else out[:1], received, strict=False):
        image.reshape(-1)[points.where] = values


def open_nodes(
    scratch: Scratch, height: int, width: int, view: View, radius_m: float, plane: np.ndarray, blockers: np.ndarray
) -> np.ndarray:
    """Openness of the surface where the rays through every PITCH-th corner of pixels meet it, with a margin."""
    rays = _node_rays(height, width, view.focal)
    down = -(plane[:3] @ rays)
    below = down > view.camera[2] / radius_m
    places = np.ascontiguousarray(rays[:, below] * (view.camera[2] / down[below]), np.float32)
    normals = np.repeat(plane[:3, None], places.shape[1], 1)
    parts = np.full(places.shape[1], NO_PART, np.float32)
    nodes = np.ones(rays.shape[1], np.float32)
    nodes[below] = openness(scratch, places, normals, parts, blockers, np.zeros(len(blockers), np.float32), True)
    return nodes.reshape(height // PITCH + 2, width // PITCH + 2)


@lru_cache(maxsize=4)
def _node_rays(height: int, width: int, focal: float) -> np.ndarray:
    """Rays through the nodes, (3, rows x columns)."""
    x = (np.arange(width // PITCH + 2) * PITCH - width * 0.5) / focal
    y = (height * 0.5 - np.arange(height // PITCH + 2) * PITCH) / focal
    return np.stack((*np.meshgrid(x, y), np.full((len(y), len(x)), -1.0))).reshape(3, -1)


@kernel
def _gather(scratch, runs, camera, plane, strength, shine, openings, uncovered, points, patches):
    """Fill in `TablePoints` and the steps of each run of pixels."""
    S, (place, turn, focal, radius), (height, width) = scratch.slots, camera, uncovered.total.shape
    pixel, at = f32(1.0 / focal), 0
    for r in range(runs.shape[0]):
        run = runs[r]
        row, start, n = run[0], run[1], run[2] - run[1]
        m = blocks(n)
        aim_rays(S, run, height, width, pixel, uncovered)
        open_run(S, n, openings[1], start, row)
        for i in range(n):
            if S[ROOM + i] < ONE:
                x, y = S[RAY_X + i] * f32(focal) + f32(width * 0.5), f32(height * 0.5) - S[RAY_Y + i] * f32(focal)
                S[OPEN + i] = between(openings[0], x * f32(1 / PITCH), y * f32(1 / PITCH))
        meet_sphere(S, m, turn, place, radius, pixel)
        look_below_horizon(S, m, turn, pixel)
        meet_plane(S, m, plane, pixel)
        light_plane(S, m, *strength)
        if shine[0] > ZERO:
            glint(S, m, plane, strength[0], WIDTH, shine[0])
            mirror(S, m, plane, shine[1])
        _step(patches.steps[r], patches.planes[r], plane, S[RAY_X + n // 2], S[RAY_Y + n // 2], focal)
        for i in range(n):
            x, y = S[RAY_X + i], S[RAY_Y + i]
            away = plane[9] / min(plane[0] * x + plane[1] * y - plane[2], f32(-1e-5))
            points.places[0, at + i], points.places[1, at + i], points.places[2, at + i] = away * x, away * y, -away
            points.where[at + i] = (run[3] * height + row) * width + start + i
            points.rooms[at + i], points.opened[at + i] = S[ROOM + i], S[OPEN + i]
            points.lit[at + i] = S[LIT + i] if S[GROUND + i] > ZERO else ZERO
            points.glossy[at + i] = S[GLOSS + i] if shine[0] > ZERO else ZERO
            points.mirrored[at + i] = S[RESULT + i] if shine[0] > ZERO else ZERO
        at += n
        patches.starts[r + 1] = at


@kernel
def _step(steps, own, plane, x, y, focal):
    """Steps on the surface from one pixel to the next, right and down, where a ray (x, y, -1) meets it; and the plane
    itself."""
    facing = min(plane[0] * x + plane[1] * y - plane[2], -1e-4)
    away = plane[9] / facing / focal
    ray_x, ray_y, ray_z = x, y, -ONE
    for m in range(2):
        tilt, sign = plane[m] / facing, 1.0 - 2.0 * m
        steps[m, 0] = sign * away * ((1.0 - m) - ray_x * tilt)
        steps[m, 1] = sign * away * (m - ray_y * tilt)
        steps[m, 2] = -sign * away * ray_z * tilt
    own[0], own[1], own[2], own[3] = plane[0], plane[1], plane[2], plane[9]
