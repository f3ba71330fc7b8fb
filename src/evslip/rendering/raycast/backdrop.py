"""Everything behind the object and the hand: the texture of the surface times the light on it, and the background."""

import math
from typing import NamedTuple

import numpy as np

from evslip.rendering.geometry.plane import meet_plane
from evslip.rendering.geometry.simd_minmax import larger, smaller
from evslip.rendering.materials.texels import TRIANGLE, sample_along, sample_around, unfold
from evslip.rendering.raycast.setting import Setting, table_plane
from evslip.rendering.raycast.uncovered import Uncovered, aim_rays, look_below_horizon
from evslip.rendering.scratch import HALF, ONE, ZERO, Scratch, blocks, clamped, f32, formula, kernel
from evslip.rendering.shading.sphere import draw_lamp, meet_sphere, unroll
from evslip.rendering.slots import GROUND, LIT, RESULT, TEX
from evslip.rendering.timing.cell_motion import Cells
from evslip.rendering.viewpoint import View
from evslip.utils.refcount import without_refcount

ENDLESS = f32(1e30)


class Surface(NamedTuple):
    """Values that all pixels which see the surface share, in single precision."""

    cells: np.ndarray
    """Texels of `texels.bake`."""
    levels: np.ndarray
    per_m: np.float32
    """Repetitions of the texture a metre."""
    plane: np.ndarray
    """Numbers of `plane.describe`."""


class Sphere(NamedTuple):
    """Values that all pixels which see the background share, in single precision."""

    cells: np.ndarray
    levels: np.ndarray
    repetitions: np.float32
    radius: np.float32
    luminance: np.float32
    camera: np.ndarray
    turn: np.ndarray
    towards: np.ndarray
    """Unit vector to the lamp in camera axes."""
    angle: np.float32
    """The lamp's angular radius."""
    lamp_luminance: np.float32


class TableLight(NamedTuple):
    """Light of `table_light.light_table` in one frame: of each cell, up to three drawings and their weights."""

    received: np.ndarray
    """Light that the texture is multiplied with, float32 (slots, height, width)."""
    mirrored: np.ndarray
    """Light that is mirrored, (slots, height, width); (0, 0, 0) on a matt surface."""
    before: np.ndarray
    """Slots and weights of `CellPlan`, (rows, columns)."""
    earlier: np.ndarray
    after: np.ndarray
    shares: np.ndarray


def draw_backdrop(
    scratch: Scratch, runs: np.ndarray, view: View, sky_view: View, setting: Setting, light: TableLight, cells: Cells,
    uncovered: Uncovered, out: tuple[np.ndarray, np.ndarray],
) -> None:  # fmt: skip
    """Draw `uncovered.due_runs` into `out`: luminance, and whether it is the surface, 1, or the background, 0; both
    (slots, height, width). sky_view: the camera in the background's axes."""
    lamp, table, sky = setting.lamp, setting.table, setting.sky
    surface = Surface(table.cells, table.levels, np.float32(1.0 / table.tile_m), table_plane(view, setting))
    camera, turn = sky_view.camera.astype(np.float32), sky_view.turn.astype(np.float32)
    way = view.turn.T @ (lamp.position - view.camera)
    away = float(np.linalg.norm(way))
    angle = np.float32(math.asin(min(1.0, lamp.radius_m / away)))
    shape = np.float32(sky.repetitions), np.float32(sky.radius_m), np.float32(sky.luminance)
    towards, bright = (way / away).astype(np.float32), np.float32(lamp.luminance)
    sphere = Sphere(sky.cells, sky.levels, *shape, camera, turn, towards, angle, bright)
    _draw(scratch, runs, out, light, (cells.height, cells.width), view.focal, surface, sphere, uncovered)


@kernel
def _draw(scratch, runs, out, light, cell, focal, surface, sphere, uncovered):
    (S, loaded), light, surface = without_refcount((scratch, light, surface))
    sphere, uncovered = without_refcount((sphere, uncovered))
    height, width = uncovered.total.shape
    pixel, glossy = f32(1.0 / focal), light.mirrored.size > 0
    backdrops, grounds = without_refcount((out[0].reshape(-1), out[1].reshape(-1)))
    received, mirrored = without_refcount((light.received.reshape(-1), light.mirrored.reshape(-1)))
    for r in range(runs.shape[0]):
        run = runs[r]
        row, start, n, i, j = run[0], run[1], run[2] - run[1], run[0] // cell[0], run[1] // cell[1]
        aim_rays(S, run, height, width, pixel, uncovered)
        lowest = _shade_sphere(S, blocks(n), loaded, pixel, sphere, _lamp_in(sphere, run, height, width, f32(focal)))
        if lowest > -ENDLESS:
            if lowest < ONE:
                look_below_horizon(S, blocks(n), sphere.turn, pixel)
            meet_plane(S, blocks(n), surface.plane, pixel)
            unfold(S, blocks(n), surface.per_m, ZERO, -surface.per_m, ZERO, True)
            sample_along(S, blocks(n), surface.cells, loaded, surface.levels)
            place, shares = row * width + start, (light.shares[i, j, 0], light.shares[i, j, 1])
            first, second = light.before[i, j] * height * width + place, light.after[i, j] * height * width + place
            third = light.earlier[i, j] * height * width + place
            _blend(S, n, received, first, second, third, shares)
            for k in range(clamped(n)):
                S[TEX + k] *= S[LIT + k]
            if glossy:
                _blend(S, n, mirrored, first, second, third, shares)
                for k in range(clamped(n)):
                    S[TEX + k] += S[LIT + k]
            if lowest >= ONE:
                for k in range(clamped(n)):
                    S[RESULT + k] = S[TEX + k]
            else:
                for k in range(clamped(n)):
                    S[RESULT + k] += min(ONE, max(ZERO, S[GROUND + k])) * (S[TEX + k] - S[RESULT + k])
        at = (run[3] * height + row) * width + start
        shades, marks = backdrops[at : at + n], grounds[at : at + n]
        for k in range(shades.size):
            shades[k] = S[RESULT + k]
        for k in range(marks.size):
            marks[k] = 1 if S[GROUND + k] >= HALF else 0


@formula
def _blend(S, n, light, first, second, third, shares):
    """LIT = three drawings of a light, each from its place on, with weights of `CellPlan`."""
    here, later, before = light[first : first + n], light[second : second + n], light[third : third + n]
    share, bend = shares
    if share == ZERO:
        for k in range(here.size):
            S[LIT + k] = here[k]
    else:
        for k in range(here.size):
            light_now = here[k] + share * (later[k] - here[k]) + bend * (before[k] - here[k])
            S[LIT + k] = max(light_now, ZERO)


@kernel
def _shade_sphere(S, n, loaded, pixel, sphere, lamp_here):
    """GROUND, and RESULT where there is background. Returns the least share of a pixel that is below the horizon, or
    -ENDLESS if all are above it."""
    meet_sphere(S, n, sphere.turn, sphere.camera, sphere.radius, pixel)
    lowest, highest = ENDLESS, -ENDLESS
    for i in range(n):
        lowest, highest = smaller(lowest, S[GROUND + i]), larger(highest, S[GROUND + i])
    if lowest < ONE:
        if sphere.luminance > ZERO:
            aspect = sphere.levels[0, 1] / sphere.levels[0, 2]
            horizon = HALF if aspect > ONE else ZERO  # a panorama has it in the middle
            unroll(S, n, sphere.repetitions, sphere.radius, pixel, aspect, horizon)
            sample_around(S, n, sphere.cells, loaded, sphere.levels, True, TRIANGLE)
            for i in range(n):
                S[RESULT + i] = S[TEX + i] * sphere.luminance
        else:
            for i in range(n):
                S[RESULT + i] = ZERO
        if lamp_here:
            draw_lamp(S, n, sphere.towards, sphere.angle, pixel, sphere.lamp_luminance)
    return lowest if highest > ZERO else -ENDLESS


@kernel
def _lamp_in(sphere, run, height, width, focal):
    """Whether the lamp's disc may be seen in a run of pixels."""
    towards, ahead = sphere.towards, -float(sphere.towards[2])
    if ahead < 0.3:
        return False
    margin = 1.2 * focal * math.tan(sphere.angle) / ahead**2 + 2.0
    x, y = width * 0.5 + focal * towards[0] / ahead, height * 0.5 - focal * towards[1] / ahead
    return run[1] - margin < x < run[2] + margin and run[0] - margin < y < run[0] + 1 + margin
