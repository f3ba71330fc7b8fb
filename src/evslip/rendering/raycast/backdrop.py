"""Everything behind the object and the hand: the surface with its shadows, and the background sphere."""

import math
from typing import NamedTuple

import numpy as np

from evslip.rendering.geometry.plane import PLANE, describe, meet_plane
from evslip.rendering.geometry.simd_minmax import larger, smaller
from evslip.rendering.materials.paint import WIDTH
from evslip.rendering.materials.texels import TRIANGLE, sample_along, sample_around, unfold
from evslip.rendering.scratch import (
    BLOCK,
    HALF,
    LEAST_ROOM,
    ONE,
    TILE_H,
    TILE_W,
    ZERO,
    blocks,
    f32,
    formula,
    kernel,
    repeat_last,
)
from evslip.rendering.shading.environment_reflection import glint, mirror
from evslip.rendering.shading.sphere import draw_lamp, glow, meet_sphere, unroll
from evslip.rendering.shading.surface_light import light_plane, reflect, reflect_below_horizon
from evslip.rendering.shadows.casters import NO_PART, aim, receive, shade, spread
from evslip.rendering.shadows.occlusion import PITCH, between, open_run, surface_nodes
from evslip.rendering.slots import GROUND, OPEN, PART, RAY_X, RAY_Y, RESULT, ROOM, SLOT
from evslip.utils.refcount import without_refcount

ENDLESS = f32(1e30)


class Uncovered(NamedTuple):
    """Parts of the backdrop that gripper and object leave."""

    seen: np.ndarray
    """See `layers.Layers`."""
    total: np.ndarray
    """This and what follows: see `body.Body`."""
    touched: np.ndarray
    full: np.ndarray


class Surface(NamedTuple):
    """Values that all pixels which see the surface share, in single precision."""

    cells: np.ndarray
    """Texels of `texels.bake`."""
    levels: np.ndarray
    per_m: np.float32
    """Repetitions of the texture a metre."""
    ambient: np.float32
    reflectance: np.float32
    power: np.float32
    """Strength of the lamp: luminance x radius^2."""
    lamp_radius: np.float32
    plane: np.ndarray
    """Numbers of `plane.describe`."""
    reflection: np.ndarray


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


@kernel
def backdrop(scratch, backdrops, grounds, slots, cells, view, setting, casters, uncovered):
    """Shade what is `Uncovered` in the cells that `slots` (rows, columns) does not leave out with -1: into that place
    of `backdrops` (n, height, width); and note in `grounds` whether it is the surface, 1, or the background, 0.

    cells: `update_schedule.Cells`; view: `viewpoint.View`; setting: `setting.Setting`.

    Where the object covers part of a pixel, the place shaded is the middle of the rest: under the middle of the pixel
    there may be darkness that nobody sees, as at the foot of an object that stands on the surface.
    """
    scene = compose(scratch.slots, backdrops.shape[1], backdrops.shape[2], view, setting, casters)
    _draw_tiles(scratch, backdrops, grounds, slots, cells, scene, uncovered)


@kernel
def compose(S, height, width, view, setting, casters):
    """Values that all pixels share: the view, the surface, the sphere, what casts shadows, and the openness of
    `surface_nodes`."""
    lamp, table, sky = setting.lamp, setting.table, setting.sky
    camera, turn, focal, tile_m = view.camera, view.turn, view.focal, table.tile_m
    # The plane's origin lies below the camera on a whole repetition of the texture, so that float32 suffices.
    origin = np.array([math.floor(camera[0] / tile_m) * tile_m, math.floor(camera[1] / tile_m) * tile_m, 0.0])
    axes = np.eye(3)
    plane = np.zeros(PLANE)
    describe(plane, origin, axes[0], axes[1], axes[2], turn, camera, lamp.position)
    flat, per_m, around, share = plane.astype(np.float32), f32(1.0 / tile_m), f32(table.ambient), f32(table.reflectance)
    power, radius = f32(lamp.luminance * lamp.radius_m**2), f32(lamp.radius_m)
    surface = Surface(table.cells, table.levels, per_m, around, share, power, radius, flat, table.reflection)
    seen_from = camera.astype(np.float32), turn.astype(np.float32)
    towards, angle = _bearing(camera, turn, lamp.position, lamp.radius_m)
    count, away, white, bright = f32(sky.repetitions), f32(sky.radius_m), f32(sky.luminance), f32(lamp.luminance)
    sphere = Sphere(sky.cells, sky.levels, count, away, white, seen_from[0], seen_from[1], towards, angle, bright)
    for i in range(SLOT):
        S[PART + i] = f32(NO_PART)
    nodes = surface_nodes(S, width, height, view, sky.radius_m, origin, casters)
    return (camera, turn, focal, sky.radius_m, plane), surface, sphere, (casters, receive(casters, axes, origin)), nodes


@kernel
def _draw_tiles(scratch, backdrops, grounds, slots, cells, scene, uncovered):
    (S, loaded), backdrops, grounds = without_refcount((scratch, backdrops, grounds))
    view, surface, sphere, shadows, nodes = without_refcount(scene)
    seen, total, touched, full = without_refcount(uncovered)
    height, width = backdrops.shape[1:]
    focal, reception = view[2], shadows[1]
    pixel = f32(1.0 / focal)
    for y0 in range(0, height, TILE_H):
        y1 = min(y0 + TILE_H, height)
        for x0 in range(0, width, TILE_W):
            x1 = min(x0 + TILE_W, width)
            slot = slots[y0 // cells.height, x0 // cells.width]
            if slot < 0:
                continue
            out, bodies = backdrops[slot], grounds[slot]
            shaded = choose_casters(x0, y0, x1, y1, height, width, view, shadows)
            lamp_here = lamp_in(sphere.towards, sphere.angle, x0, y0, x1, y1, height, width, focal)
            for row in range(y0, y1):
                for run in range(seen.shape[1]):
                    if seen[row, run, 0] >= x1:
                        break
                    first, last = max(seen[row, run, 0], x0), min(seen[row, run, 1], x1)
                    # A pixel that is covered wholly now may be less so in a frame that this one is blended into.
                    left, right = min(last, full[row, 0] + 1), max(first, full[row, 1] - 1)
                    if right - left < BLOCK:  # what is shaded in vain costs less than another run
                        left = right = last
                    for part in range(2):
                        start, past = (first, left) if part == 0 else (right, last)
                        if start >= past:
                            continue
                        n = past - start
                        aim_rays(S, n, row, start, height, width, pixel, nodes, total, touched)
                        _fill_up(S, n)
                        shade_rays(S, blocks(n), loaded, pixel, surface, sphere, reception, shaded, lamp_here)
                        shades, marks = out[row, start:past], bodies[row, start:past]
                        for i in range(shades.size):
                            shades[i] = S[RESULT + i]
                        for i in range(marks.size):
                            marks[i] = 1 if S[GROUND + i] >= HALF else 0


@kernel
def aim_rays(S, n, row, start, height, width, pixel, nodes, total, touched):
    """RAY, ROOM and OPEN of n pixels of a row."""
    left, up = f32(start) + HALF - f32(width * 0.5), (f32(height * 0.5) - f32(row) - HALF) * pixel
    for i in range(n):
        S[RAY_X + i], S[RAY_Y + i], S[ROOM + i] = (f32(i) + left) * pixel, up, ONE
    open_run(S, n, nodes[1], start, row)
    for column in range(max(start, touched[row, 0]), min(start + n, touched[row, 1])):
        if total[row, column] > ZERO:
            i = column - start
            shift_x, shift_y = uncovered_middle(total, row, column)
            S[RAY_X + i] += shift_x * pixel
            S[RAY_Y + i] -= shift_y * pixel
            S[ROOM + i] = ONE - total[row, column] + LEAST_ROOM
            at_x = (f32(column) + HALF + shift_x) * f32(1 / PITCH)
            S[OPEN + i] = between(nodes[0], at_x, (f32(row) + HALF + shift_y) * f32(1 / PITCH))


@formula
def _fill_up(S, n):
    """Repeat the last pixel to fill up the block."""
    repeat_last(S, RAY_X, n)
    repeat_last(S, RAY_Y, n)
    repeat_last(S, ROOM, n)
    repeat_last(S, OPEN, n)


@kernel
def uncovered_middle(total, row, column):
    """Offset in pixels from a partly covered pixel's middle to about the middle of what is left uncovered.

    total: coverage per pixel. Exact for a straight edge along rows or columns: the uncovered rest of such a pixel is a
    strip whose middle lies half the coverage away; the direction is the coverage's gradient.
    """
    height, width = total.shape
    up, down = max(row - 1, 0), min(row + 1, height - 1)
    left, right = max(column - 1, 0), min(column + 1, width - 1)
    x = f32(2) * (total[row, right] - total[row, left])
    x += total[up, right] - total[up, left] + total[down, right] - total[down, left]
    y = f32(2) * (total[down, column] - total[up, column])
    y += total[down, left] - total[up, left] + total[down, right] - total[up, right]
    scale = f32(-0.5) * total[row, column] / (max(abs(x), abs(y)) + f32(1e-6))
    return scale * x, scale * y


@formula
def shade_rays(S, n, loaded, pixel, surface, sphere, reception, shaded, lamp_here):
    """RESULT and GROUND for n rays."""
    meet_sphere(S, n, sphere.turn, sphere.camera, sphere.radius, pixel)
    lowest, highest = ENDLESS, -ENDLESS
    for i in range(n):
        lowest, highest = smaller(lowest, S[GROUND + i]), larger(highest, S[GROUND + i])
    if lowest < ONE:
        aspect = sphere.levels[0, 1] / sphere.levels[0, 2]
        horizon = HALF if aspect > ONE else ZERO  # a panorama has it in the middle
        unroll(S, n, sphere.repetitions, sphere.radius, pixel, aspect, horizon)
        sample_around(S, n, sphere.cells, loaded, sphere.levels, True, TRIANGLE)
        glow(S, n, sphere.luminance)
        if lamp_here:
            draw_lamp(S, n, sphere.towards, sphere.angle, pixel, sphere.lamp_luminance)
    if highest > ZERO:
        if lowest < ONE:
            _look_below_horizon(S, n, sphere.turn, pixel)
        plane = surface.plane
        meet_plane(S, n, plane, pixel)
        light_plane(S, n, plane, surface.power, surface.lamp_radius)
        if surface.reflectance > ZERO:
            glint(S, n, plane, WIDTH, surface.reflectance)
        if shaded:
            shade(S, n, reception, False, True)
        unfold(S, n, surface.per_m, ZERO, -surface.per_m, ZERO, True)
        sample_along(S, n, surface.cells, loaded, surface.levels)
        if lowest >= ONE:
            reflect(S, n, surface.ambient)
        else:
            reflect_below_horizon(S, n, surface.ambient)
        if surface.reflectance > ZERO:
            mirror(S, n, plane, surface.reflection)


@kernel
def _look_below_horizon(S, n, turn, pixel):
    """Move the rays of pixels that the horizon cuts to the middle of what is below it."""
    length = math.sqrt(turn[2, 0] * turn[2, 0] + turn[2, 1] * turn[2, 1]) + f32(1e-9)
    down_x, down_y = -pixel * turn[2, 0] / length, -pixel * turn[2, 1] / length
    for i in range(n):
        below = min(max(S[GROUND + i], LEAST_ROOM), ONE)
        shift = HALF * (ONE - below)
        S[RAY_X + i] += shift * down_x
        S[RAY_Y + i] += shift * down_y
        S[ROOM + i] *= below


@kernel
def choose_casters(x0, y0, x1, y1, height, width, view, shadows):
    """Find the casters that can shadow the surface in a tile, and how a pixel there steps each one's shadow. Returns
    whether there are any."""
    camera, turn, focal, sphere_radius, plane = view
    casters, reception = shadows
    reception.kinds[:, 0] = 0
    points = np.empty((5, 3))
    ray = np.empty(3)
    below = 0
    for m in range(5):
        x = 0.5 * (x0 + x1) if m == 4 else float(x1 if m % 2 else x0)
        y = 0.5 * (y0 + y1) if m == 4 else float(y1 if m >= 2 else y0)
        ray_x, ray_y = (x - width * 0.5) / focal, (height * 0.5 - y) / focal
        for j in range(3):
            ray[j] = turn[j, 0] * ray_x + turn[j, 1] * ray_y - turn[j, 2]
        # As far as the sphere's radius; beyond it there is no surface.
        drop = max(-ray[2], camera[2] / sphere_radius)
        below += ray[2] < -camera[2] / sphere_radius
        for j in range(2):
            points[m, j] = camera[j] + camera[2] / drop * ray[j]
        points[m, 2] = 0.0
    if below == 0:
        return False
    middle, spread_m = points[4], 0.0
    for m in range(4):
        spread_m = max(spread_m, math.sqrt((points[m, 0] - middle[0]) ** 2 + (points[m, 1] - middle[1]) ** 2))
    ray_x, ray_y = (0.5 * (x0 + x1) - width * 0.5) / focal, (height * 0.5 - 0.5 * (y0 + y1)) / focal
    facing = min(plane[0] * ray_x + plane[1] * ray_y - plane[2], -1e-4)
    distance = plane[9] / facing
    right, down = np.zeros(3), np.zeros(3)
    for j in range(2):
        along = turn[j, 0] * ray_x + turn[j, 1] * ray_y - turn[j, 2]
        right[j] = distance / focal * (turn[j, 0] - along * plane[0] / facing)
        down[j] = -distance / focal * (turn[j, 1] - along * plane[1] / facing)
    if not aim(reception, casters, middle, spread_m * 1.1 + 0.01):
        return False
    spread(reception, casters, right, down)
    return True


@kernel
def _bearing(camera, turn, lamp, lamp_radius):
    """Unit vector to the lamp in camera axes, and the lamp's angular radius."""
    towards, length = np.zeros(3, np.float32), 0.0
    for j in range(3):
        length += (lamp[j] - camera[j]) ** 2
    length = math.sqrt(length)
    for k in range(3):
        total = 0.0
        for j in range(3):
            total += turn[j, k] * (lamp[j] - camera[j])
        towards[k] = f32(total / length)
    return towards, f32(math.asin(min(1.0, lamp_radius / length)))


@kernel
def lamp_in(towards, angle, x0, y0, x1, y1, height, width, focal):
    """Whether the lamp's disc may be seen in a tile."""
    ahead = -float(towards[2])
    if ahead < 0.3:
        return False
    margin = 1.2 * focal * math.tan(angle) / ahead**2 + 2.0
    x, y = width * 0.5 + focal * towards[0] / ahead, height * 0.5 - focal * towards[1] / ahead
    return x0 - margin < x < x1 + margin and y0 - margin < y < y1 + margin
