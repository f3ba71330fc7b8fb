"""All that can stand before the lamp in one frame, and what it hides from points anywhere.

Each caster is a box or an outline. Casters and points are given in camera axes.
"""

import math
from typing import NamedTuple

import numpy as np

from evslip.rendering.geometry.hand import Boxes
from evslip.rendering.geometry.simd_minmax import larger, smaller
from evslip.rendering.scratch import HALF, ONE, ZERO, blocks, f32, kernel, repeat_last
from evslip.rendering.shadows.box_shadow import box_may_shadow, describe_boxes, hide, pixel_steps
from evslip.rendering.shadows.mesh_shadow import PIXEL_BLUR, Outlines, shade_behind
from evslip.rendering.slots import HIDDEN, PART, ROOM, SEEN, U, V, W
from evslip.utils.refcount import without_refcount

OBJECT_PART, ARM_PART, NO_PART = 3, 4, 255
"""Numbers of bodies after those of the gripper in `hand`; the last one has no caster."""
GROUP, FEW = 1024, 32
"""Points of a patch that look for casters together, first many, then few: fewer ask fewer casters, and more often."""
PAST, RIM_M = f32(0.6), f32(0.005)
"""Room around points that share their casters: so much of their extent instead of half of it, and more."""
GAP_M = 1e-6
"""Least height over a plane at which a caster may shadow it."""


class Casters(NamedTuple):
    """Boxes and outlines, described to the passes."""

    boxes: np.ndarray
    """Rows of `box_shadow.describe_boxes`, float32 (k, BOX)."""
    outlines_of: np.ndarray
    """Number of the outline that casts the shadow instead of the box, or -1; int64 (k,)."""
    parts: np.ndarray
    """Number of the body that each belongs to, which it does not shadow: int64 (k,)."""
    sizes: np.ndarray
    """Half diagonals of the boxes, (k,)."""
    edges: np.ndarray
    """Edges and starts of `Outlines`."""
    starts: np.ndarray
    outlines: np.ndarray
    """Rows: turn (9) and move (3) to an outline's frame, the lamp's distance, its plane (3) and a pixel's blur (2);
    float32 (o, 18)."""
    lamp_radius: np.float32


class Patches(NamedTuple):
    """Runs of points that share the size of their pixels and lie in a plane, or may."""

    starts: np.ndarray
    """First point of each, then n; int64 (t + 1,)."""
    steps: np.ndarray
    """From one pixel to the next, right and down, where the points are; (t, 2, 3)."""
    planes: np.ndarray
    """Normal and offset of the plane that they lie in, of a body that nothing below the plane shadows; normal 0 and
    offset -1 where there is none; (t, 4)."""


def cast(
    lamp: np.ndarray, lamp_radius: float, boxes: Boxes, parts: np.ndarray, numbers: np.ndarray, outlines: Outlines
) -> Casters:
    """Casters of a frame. lamp (3,): its centre; parts, numbers: `parts` and `outlines_of` of `Casters`."""
    rows = np.zeros((len(outlines.origins), 18), np.float32)
    turns = outlines.frames.transpose(0, 2, 1)
    rows[:, :9], rows[:, 13:16] = turns.reshape(-1, 9), outlines.planes
    rows[:, 9:12] = -np.squeeze(turns @ outlines.origins[..., None], -1)
    rows[:, 12] = np.linalg.norm(lamp - outlines.origins, axis=1)
    sizes = np.linalg.norm(boxes.halves, axis=1)
    described = describe_boxes(boxes, lamp), numbers, parts, sizes
    return Casters(*described, outlines.edges, outlines.starts, rows, np.float32(lamp_radius))


@kernel
def lamp_share(scratch, casters, places, rooms, parts, lit, patches, layered):
    """Share of the lamp that casters leave visible from points, float32 (n,).

    places (3, n), rooms (n,), parts (n,): of the points; lit (n,): what the lamp gives where nothing stands between:
    where it is 0, nobody asks. layered: some casters may lie behind the points; see `hide_behind`.
    """
    S, casters, seen = scratch.slots, without_refcount(casters), np.ones(rooms.size, np.float32)
    asked, chosen = np.empty(casters.parts.size, np.int64), np.empty(casters.edges.shape[0], np.int64)
    at, end, patch, count = 0, 0, 0, 0
    while at < seen.size:
        if at == end:
            while at >= patches.starts[patch + 1]:
                patch += 1
            end = min(at + GROUP, patches.starts[patch + 1])
            near = around(places[0, at:end], places[1, at:end], places[2, at:end])
            count = _ask(asked, casters, near, patches.planes[patch], patches.steps[patch])
        n = min(FEW, end - at) if count > 0 else end - at
        own, brightest = lit[at : at + n], ZERO
        for i in range(n if count > 0 else 0):
            brightest = larger(brightest, own[i])
        if brightest > ZERO:
            _load(S, n, places[:, at : at + n], rooms[at : at + n], parts[at : at + n])
            _shade_few(S, blocks(n), casters, asked[:count], chosen, layered)
            for i in range(n):
                seen[at + i] = S[SEEN + i]
        at += n
    return seen


@kernel
def _load(S, n, places, rooms, parts):
    """Points into the slots, the last one repeated to fill up the block."""
    x, y, z = places[0], places[1], places[2]
    for i in range(rooms.size):
        S[U + i], S[V + i], S[W + i], S[ROOM + i], S[PART + i], S[SEEN + i] = x[i], y[i], z[i], rooms[i], parts[i], ONE
    for slot in (U, V, W, ROOM, PART, SEEN):
        repeat_last(S, slot, n)


@kernel
def _ask(asked, casters, near, plane, steps):
    """Choose the casters that may shadow points `near`, as of `around`, of which any corner lies above a plane, and set
    how far their shadows are blurred over a pixel; returns how many. plane, steps: of `Patches`."""
    count = 0
    for k in range(asked.size):
        box, top = casters.boxes[k], -plane[3]
        for axis in range(3):
            along = plane[0] * box[3 * axis] + plane[1] * box[3 * axis + 1] + plane[2] * box[3 * axis + 2]
            top += abs(along) * box[15 + axis] - along * box[9 + axis]
        if top <= GAP_M:
            continue
        pixel_steps(box, steps)
        if not box_may_shadow(near, box, casters.lamp_radius):
            continue
        asked[count] = k
        count += 1
        o = casters.outlines_of[k]
        for j in range(2 if o >= 0 else 0):
            width = PIXEL_BLUR * _width(casters.outlines[o], j, steps)
            casters.outlines[o, 16 + j] = f32(min(width, casters.sizes[k]))
    return count


@kernel
def _width(frame, axis, steps):
    square = 0.0
    for m in range(2):
        way = 0.0
        for j in range(3):
            way += frame[3 * axis + j] * steps[m, j]
        square += way * way
    return math.sqrt(square)


@kernel
def _shade_few(S, n, casters, asked, chosen, layered):
    """SEEN = what the darkest of the casters asked leaves visible.

    Where two bodies hide part of the lamp, they are taken to hide the same part: with the exact union of their outlines
    (eight strips of the lamp's disc), 0.4 % of all events were others.
    """
    near, radius = around(S[U : U + n], S[V : V + n], S[W : W + n]), casters.lamp_radius
    least, most = S[PART], S[PART]
    for i in range(n):
        least, most = smaller(least, S[PART + i]), larger(most, S[PART + i])
    for k in asked:
        part, o = f32(casters.parts[k]), casters.outlines_of[k]
        if (least == part and most == part) or not box_may_shadow(near, casters.boxes[k], radius):
            continue
        if o < 0:
            hide(S, n, casters.boxes[k], radius)
        else:
            own = casters.edges[casters.starts[o] : casters.starts[o + 1]]
            if not shade_behind(S, n, near, casters.outlines[o], own, chosen, radius, layered):
                continue
        for i in range(n):
            S[SEEN + i] = min(S[SEEN + i], ONE if S[PART + i] == part else max(ONE - S[HIDDEN + i], ZERO))


@kernel
def around(x, y, z):
    """A box around points (n,) with room for the blur of shadows at its rim: its middle, the radius of a sphere that
    holds it, and its half sides."""
    low_x, high_x, low_y, high_y, low_z, high_z = x[0], x[0], y[0], y[0], z[0], z[0]
    for i in range(x.size):
        low_x, high_x = smaller(low_x, x[i]), larger(high_x, x[i])
        low_y, high_y = smaller(low_y, y[i]), larger(high_y, y[i])
        low_z, high_z = smaller(low_z, z[i]), larger(high_z, z[i])
    dx, dy, dz = high_x - low_x, high_y - low_y, high_z - low_z
    reach = PAST * math.sqrt(dx * dx + dy * dy + dz * dz) + RIM_M
    middle = HALF * (low_x + high_x), HALF * (low_y + high_y), HALF * (low_z + high_z)
    return (*middle, reach, PAST * dx + RIM_M, PAST * dy + RIM_M, PAST * dz + RIM_M)
