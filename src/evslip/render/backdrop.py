"""Everything behind the object and the hand: the surface with its shadows, and the background sphere."""

import math

import numpy as np

from evslip.render.lanes import (
    GROUND, LANES, ONE, RAY_X, RAY_Y, RESULT, TILE_H, TILE_W, ZERO, f32, kernel,
)  # fmt: skip
from evslip.render.plane import PLANE, describe, meet_plane, reflect, reflect_below_horizon
from evslip.render.shadow import begin_group, change_frame, end_group, hide, may_shadow, pixel_blur, place_lamp
from evslip.render.sphere import draw_lamp, glow, meet_sphere, unroll
from evslip.render.texels import sample

PROBES = 4
"""Texture probes along the footprint of a pixel on the surface, which is seen at a grazing angle."""
ENDLESS = f32(1e30)


@kernel
def backdrop(
    out, bodies, S, fetched, camera, turn, focal, lamp, lamp_radius, lamp_luminance, gloss,
    surface_cells, surface_levels, tile_m, surface_ambient,
    sphere_cells, sphere_levels, repetitions, sphere_radius, sphere_luminance,
    caster_turns, caster_places, caster_halves, hidden, total, touched, full,
):  # fmt: skip
    """Shade every pixel that the gripper (hidden, bool per pixel) and the object (total, touched, full of `cover_box`)
    leave visible. Where the object covers part of a pixel, the place shaded is the middle of the rest: under the pixel's
    own middle there may be darkness that nobody sees, as at the foot of an object that stands on the surface.
    """
    height, width = out.shape
    pixel = f32(1.0 / focal)
    power = f32(lamp_luminance * lamp_radius**2)
    radius = f32(lamp_radius)
    camera32, turn32 = camera.astype(np.float32), turn.astype(np.float32)
    count = caster_places.shape[0]
    lamps = np.empty((count, 3), np.float32)
    place_lamp(caster_turns, caster_places, lamp, lamps)
    # The plane's origin lies below the camera on a whole repetition of the texture, so that float32 suffices.
    origin = np.array([math.floor(camera[0] / tile_m) * tile_m, math.floor(camera[1] / tile_m) * tile_m, 0.0])
    axes = np.eye(3)
    plane64 = np.zeros(PLANE)
    describe(plane64, origin, axes[0], axes[1], axes[2], turn, camera, lamp)
    plane = plane64.astype(np.float32)
    turns, moves = np.empty((count, 3, 3), np.float32), np.empty((count, 3), np.float32)
    reach = np.empty(count)
    for k in range(count):
        change_frame(axes, origin, caster_turns[k], caster_places[k], turns[k], moves[k])
        reach[k] = math.sqrt(caster_halves[k, 0] ** 2 + caster_halves[k, 1] ** 2 + caster_halves[k, 2] ** 2)
    blurs = np.zeros((count, 3), np.float32)
    active = np.zeros(count, np.bool_)
    to_lamp = np.empty(3, np.float32)
    lamp_distance = math.sqrt((lamp[0] - camera[0]) ** 2 + (lamp[1] - camera[1]) ** 2 + (lamp[2] - camera[2]) ** 2)
    for k in range(3):
        to_lamp[k] = f32(
            (turn[0, k] * (lamp[0] - camera[0]) + turn[1, k] * (lamp[1] - camera[1]) + turn[2, k] * (lamp[2] - camera[2]))
            / lamp_distance
        )
    lamp_angle = f32(math.asin(min(1.0, lamp_radius / lamp_distance)))
    lamp_ahead = to_lamp[2] < -0.3
    tiles_x = (width + TILE_W - 1) // TILE_W
    for tile in range(tiles_x * ((height + TILE_H - 1) // TILE_H)):
        x0, y0 = (tile % tiles_x) * TILE_W, (tile // tiles_x) * TILE_H
        x1, y1 = min(x0 + TILE_W, width), min(y0 + TILE_H, height)
        _aim(x0, y0, x1, y1, out, camera, turn, focal, lamp, lamp_radius, sphere_radius, origin,
             caster_places, reach, turns, lamps, active, blurs)  # fmt: skip
        lamp_here = False
        if lamp_ahead:
            lamp_x, lamp_y = width * 0.5 - focal * to_lamp[0] / to_lamp[2], height * 0.5 + focal * to_lamp[1] / to_lamp[2]
            margin = 1.3 * focal * math.tan(lamp_angle) / to_lamp[2] ** 2 + 2
            lamp_here = x0 - margin < lamp_x < x1 + margin and y0 - margin < lamp_y < y1 + margin
        for part in range(TILE_H + 1):
            # Whole rows first, then the pixels of the tile that the object covers partly.
            n = 0
            row, column = y0 + part, x0
            if part < TILE_H:
                if row >= y1:
                    continue
                if full[row, 0] <= x0 and full[row, 1] >= x1:
                    for x in range(x0, x1):
                        out[row, x] = ZERO
                    continue
                veiled = True
                for x in range(x0, x1):
                    veiled = veiled and hidden[row, x]
                if veiled:
                    continue
                ray_y = (f32(height * 0.5) - f32(row) - f32(0.5)) * pixel
                n = x1 - x0
                for i in range(n):
                    S[RAY_X + i] = (f32(x0 + i) + f32(0.5) - f32(width * 0.5)) * pixel
                    S[RAY_Y + i] = ray_y
            else:
                row = y0
            edge_row, edge_column = row, column
            while True:
                if part == TILE_H:
                    n, row, column, edge_row, edge_column = _edges(
                        S, edge_row, edge_column, x0, x1, y1, total, touched, full, pixel, fetched
                    )
                    if n == 0:
                        break
                meet_sphere(S, n, turn32, camera32, f32(sphere_radius), pixel)
                lowest, highest = ENDLESS, -ENDLESS
                for i in range(n):
                    lowest = min(lowest, S[GROUND + i])
                    highest = max(highest, S[GROUND + i])
                if part < TILE_H:
                    for i in range(n):
                        bodies[row, x0 + i] = 1 if S[GROUND + i] >= f32(0.5) else 0
                if part == TILE_H:
                    pass
                if lowest < ONE:
                    unroll(S, n, f32(repetitions), f32(sphere_radius), pixel, sphere_levels[0, 1])
                    _sample_edges(S, n, sphere_cells, fetched, sphere_levels)
                    glow(S, n, f32(sphere_luminance))
                    if lamp_here:
                        draw_lamp(S, n, to_lamp, lamp_angle, pixel, f32(lamp_luminance))
                break
    return
