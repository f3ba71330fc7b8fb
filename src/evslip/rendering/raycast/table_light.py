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
from evslip.rendering.scratch import ONE, TILE_W, ZERO, Scratch, blocks, f32, kernel
from evslip.rendering.shading.environment_reflection import glint, mirror
from evslip.rendering.shading.illumination import Illumination
from evslip.rendering.shading.sphere import meet_sphere
from evslip.rendering.shading.surface_light import light_plane, received_light
from evslip.rendering.shadows.casters import NO_PART, Patches, lamp_share
from evslip.rendering.shadows.occlusion import PITCH, between, between_columns, open_run, openness
from evslip.rendering.slots import GLOSS, GROUND, LIT, OPEN, RAY_X, RAY_Y, RESULT, ROOM
from evslip.rendering.viewpoint import View
from evslip.utils.refcount import without_refcount

ROWS, MOST = 8, 512
"""Height in pixels of the tiles of the image, TILE_W wide, whose points look for casters together, up to so many."""


class TablePoints(NamedTuple):
    """Places of the table and what falls on them where nothing stands between."""

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


class TableView(NamedTuple):
    """Values that all points share."""

    plane: np.ndarray
    """The surface, of `plane.describe`."""
    turn: np.ndarray
    """The camera's axes, and its place, float32."""
    camera: np.ndarray
    focal: float
    radius: np.float32
    """Radius of the background sphere in metres."""
    lamp: np.ndarray
    """Its centre in the surface's frame."""
    power: np.float32
    lamp_radius: np.float32
    reflectance: np.float32
    reflection: np.ndarray
    """See `setting.Table`."""
    nodes: np.ndarray
    """Openness, of `open_nodes`, and `between_columns` of it."""
    columns: np.ndarray


def light_table(
    scratch: Scratch, runs: np.ndarray, view: View, setting: Setting, light: Illumination, uncovered: Uncovered,
    out: tuple[np.ndarray, np.ndarray],
) -> None:  # fmt: skip
    """Draw the light of `uncovered.due_runs` into `out`: what the texture is multiplied with, and what is mirrored,
    (slots, height, width) each; the latter only where the table shines."""
    lamp, sky, table, plane = setting.lamp, setting.sky, setting.table, table_plane(view, setting)
    height, width = out[0].shape[1:]
    blockers = np.concatenate([light.blockers, light.standing])
    nodes = open_nodes(scratch, height, width, view, sky.radius_m, plane, blockers)
    centre = (lamp.position - table_origin(view, table.tile_m)).astype(np.float32)
    camera = view.turn.astype(np.float32), view.camera.astype(np.float32), view.focal, np.float32(sky.radius_m)
    strength = centre, np.float32(lamp.luminance * lamp.radius_m**2), np.float32(lamp.radius_m)
    shine = np.float32(table.reflectance), table.reflection
    own = TableView(plane, *camera, *strength, *shine, nodes, between_columns(nodes, width))
    starts = np.concatenate([[0], np.cumsum(runs[:, 2] - runs[:, 1])])
    count, (firsts, tiles) = int(starts[-1]), _tiles(runs, starts)
    points = TablePoints(np.empty((3, count), np.float32), *np.empty((5, count), np.float32))
    patches = Patches(firsts, np.zeros((len(tiles), 2, 3)), np.zeros((len(tiles), 4)))
    _gather(scratch, runs, starts, own, uncovered, points)
    _step(tiles, own, uncovered.total.shape, patches)
    parts = np.full(count, NO_PART, np.float32)
    seen = lamp_share(scratch, light.casters, points.places, points.rooms, parts, points.lit, patches, False)
    found = received_light(table.ambient, points.opened, points.lit, seen, points.glossy, points.mirrored)
    _put(runs, starts, *found, out)


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
def _tiles(runs, starts):
    """First point of each patch, which lies in one tile, then the number of all points; and the row and the column of
    each one's tile. starts: first point of each run."""
    firsts, tiles = np.zeros(2 * runs.shape[0] + 1, np.int64), np.empty((2 * runs.shape[0], 2), np.int64)
    count, row, column = 0, -1, -1
    for r in range(runs.shape[0]):
        at = runs[r, 1]
        while at < runs[r, 2]:
            own_row, own_column = runs[r, 0] // ROWS, at // TILE_W
            end, point = min((own_column + 1) * TILE_W, runs[r, 2]), starts[r] + at - runs[r, 1]
            if own_row != row or own_column != column or point + end - at - firsts[count - 1] > MOST:
                row, column = own_row, own_column
                firsts[count], tiles[count, 0], tiles[count, 1] = point, row, column
                count += 1
            at = end
    firsts[count] = starts[runs.shape[0]]
    return firsts[: count + 1], tiles[:count]


@kernel
def _gather(scratch, runs, starts, own, uncovered, points):
    """Fill in `TablePoints` of runs of pixels."""
    S, own, uncovered = scratch.slots, without_refcount(own), without_refcount(uncovered)
    (height, width), plane = uncovered.total.shape, own.plane
    pixel, glossy, middle = f32(1.0 / own.focal), own.reflectance > ZERO, (f32(width * 0.5), f32(height * 0.5))
    for r in range(runs.shape[0]):
        run, at = runs[r], starts[r]
        row, start, n = run[0], run[1], starts[r + 1] - at
        m = blocks(n)
        aim_rays(S, run, height, width, pixel, uncovered)
        open_run(S, n, own.columns, start, row)
        for i in range(n):
            if S[ROOM + i] < ONE:
                x, y = S[RAY_X + i] * f32(own.focal) + middle[0], middle[1] - S[RAY_Y + i] * f32(own.focal)
                S[OPEN + i] = between(own.nodes, x * f32(1 / PITCH), y * f32(1 / PITCH))
        meet_sphere(S, m, own.turn, own.camera, own.radius, pixel)
        look_below_horizon(S, m, own.turn, pixel)
        meet_plane(S, m, plane, pixel)
        light_plane(S, m, own.lamp, own.power, own.lamp_radius)
        if glossy:
            glint(S, m, plane, own.lamp, WIDTH, own.reflectance)
            mirror(S, m, plane, own.reflection)
        for i in range(n):
            x, y = S[RAY_X + i], S[RAY_Y + i]
            away = plane[9] / min(plane[0] * x + plane[1] * y - plane[2], f32(-1e-5))
            points.places[0, at + i], points.places[1, at + i], points.places[2, at + i] = away * x, away * y, -away
            points.rooms[at + i], points.opened[at + i] = S[ROOM + i], S[OPEN + i]
            points.lit[at + i] = S[LIT + i] if S[GROUND + i] > ZERO else ZERO
            points.glossy[at + i] = S[GLOSS + i] if glossy else ZERO
            points.mirrored[at + i] = S[RESULT + i] if glossy else ZERO


@kernel
def _put(runs, starts, received, mirrored, out):
    """Put the light of each pixel into its place."""
    for r in range(runs.shape[0]):
        row, slot, offset = runs[r, 0], runs[r, 3], starts[r] - runs[r, 1]
        for column in range(runs[r, 1], runs[r, 2]):
            out[0][slot, row, column] = received[column + offset]
            if out[1].size > 0:
                out[1][slot, row, column] = mirrored[column + offset]


@kernel
def _step(tiles, own, size, patches):
    """Fill in the steps from one pixel to the next, right and down, where the ray (x, y, -1) through the middle of each
    patch's tile meets the surface, and the plane itself. The tile's middle, not the points': which points are drawn
    together changes from frame to frame, and the blur of a shadow's edge must not change with it."""
    plane = own.plane
    for p in range(tiles.shape[0]):
        x, y = TILE_W * (tiles[p, 1] + 0.5) - size[1] / 2, size[0] / 2 - ROWS * (tiles[p, 0] + 0.5)
        ray = (x / own.focal, y / own.focal, -1.0)
        facing = min(plane[0] * ray[0] + plane[1] * ray[1] - plane[2], -1e-4)
        away = plane[9] / facing / own.focal
        for m in range(2):
            tilt, sign = plane[m] / facing, 1.0 - 2.0 * m
            for j in range(3):
                patches.steps[p, m, j] = sign * away * ((1.0 if j == m else 0.0) - ray[j] * tilt)
        for j in range(3):  # an assignment of slices compiles what it might complain with
            patches.planes[p, j] = plane[j]
        patches.planes[p, 3] = plane[9]
