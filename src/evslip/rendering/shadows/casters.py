"""All that can stand before the lamp in one frame, and what it hides from points anywhere.

Each caster is a box, or an outline for which a box stands in where the shadows of several casters are joined.
"""

import math
from typing import NamedTuple

import numpy as np

from evslip.rendering.geometry.simd_minmax import larger, smaller
from evslip.rendering.scratch import HALF, ONE, ZERO, f32, formula, kernel
from evslip.rendering.shadows.box_shadow import (
    BOX,
    begin_group,
    box_may_shadow,
    change_frame,
    describe_box,
    end_group,
    hide,
    may_shadow,
    pixel_steps,
    take_in,
)
from evslip.rendering.shadows.mesh_shadow import PIXEL_BLUR, shade_behind
from evslip.rendering.shadows.union import EDGES, MOST, WIDE, edges_of, join, note, overlap
from evslip.rendering.slots import U, V, W

OBJECT_PART, ARM_PART, NO_PART = 3, 4, 255
"""Numbers of bodies after those of the gripper in `hand`; the last one has no caster."""
FEW = 32
"""Points that look for casters together: fewer cast fewer shadows, and more looking."""
PAST, RIM_M = f32(0.6), f32(0.005)
"""Room around points that share their casters: so much of their extent instead of half of it, and more."""


class Casters(NamedTuple):
    """Boxes and outlines in the world, and what follows from them."""

    lamp: np.ndarray
    """Its centre, (3,)."""
    lamp_radius: float
    turns: np.ndarray
    """Axes of the boxes as columns, (k, 3, 3)."""
    places: np.ndarray
    """Their centres, (k, 3)."""
    halves: np.ndarray
    """Their half sides, (k, 3)."""
    parts: np.ndarray
    """Number of the body that each belongs to, which it does not shadow: int64 (k,)."""
    sizes: np.ndarray
    """Their half diagonals, (k,)."""
    outlines: np.ndarray
    """Number of the outline that casts the shadow instead of the box, or -1; int64 (k,)."""
    edges: np.ndarray
    """Edges of all outlines, each in its own frame, float32 (m, 2, 3)."""
    starts: np.ndarray
    """First edge of every outline, then m; int64 (o + 1,)."""
    frames: np.ndarray
    """Axes of the outlines' frames as columns, (o, 3, 3); see `mesh_shadow.Outline`."""
    origins: np.ndarray
    """(o, 3)."""
    planes: np.ndarray
    """(o, 3)."""
    frame: np.ndarray
    """Axes of the lamp's frame in which the boxes are joined: the first two across the disc, (3, 3)."""
    origin: np.ndarray
    """(3,)."""
    rims: np.ndarray
    """Edges of the boxes there; see `union.edges_of`."""
    block_turns: np.ndarray
    """Axes of the boxes that stand in for the object, the palm and the fingers where they keep light from all around
    away; (b, 3, 3)."""
    block_places: np.ndarray
    block_halves: np.ndarray


class Reception(NamedTuple):
    """The casters as seen from one frame of receivers, in few arrays: they are handed on for every few pixels."""

    boxes: np.ndarray
    """Rows of `box_shadow.describe_box`, float32 (k, BOX)."""
    kinds: np.ndarray
    """Whether the caster is asked at all; the number of its outline or -1; that of its body; int64 (k, 3)."""
    edges: np.ndarray
    """Edges of all outlines, float32 (m, 2, 3)."""
    starts: np.ndarray
    outlines: np.ndarray
    """Rows: turn (9) and move (3) from the receivers' frame to an outline's, the lamp's distance, its plane (3)
    and a pixel's blur (2); float32 (o, 18)."""
    rims: np.ndarray
    """Edges of the boxes, float32 (k, EDGES, 2, 3)."""
    joint: np.ndarray
    """Turn (9) and move (3) to the frame in which boxes are joined, its distance from the lamp, a pixel's blur (2) and
    the lamp's radius; float32 (16,)."""
    scratch: np.ndarray


@kernel
def cast(lamp, lamp_radius, along, boxes, parts, blockers, outlines, contours):
    """Casters of a frame. along (3,): direction along which seams between bodies are sharpest, the fingers' closing
    axis. boxes: turns, places and halves; blockers: those of the boxes that keep light from all around away; contours:
    edges, starts, frames, origins and planes. Everything as in `Casters`."""
    turns, places, halves = boxes
    edges, starts, frames, origins, planes = contours
    count = places.shape[0]
    if count > MOST:
        raise ValueError("more casters of shadows than there are slots for")
    sizes = np.empty(count)
    for k in range(count):
        sizes[k] = math.sqrt(halves[k, 0] ** 2 + halves[k, 1] ** 2 + halves[k, 2] ** 2)
    origin, frame = places[0].copy(), np.empty((3, 3))
    towards = lamp - origin
    towards /= math.sqrt(np.sum(towards**2))
    first = along - towards * np.sum(along * towards)
    first /= math.sqrt(np.sum(first**2)) + 1e-12
    for j in range(3):
        a, b = (j + 1) % 3, (j + 2) % 3
        frame[j, 0], frame[j, 2] = first[j], towards[j]
        frame[j, 1] = towards[a] * first[b] - towards[b] * first[a]
    rims = np.empty((count, EDGES, 2, 3), np.float32)
    edges_of(turns, places, halves, frame, origin, rims)
    return Casters(
        lamp, lamp_radius, turns, places, halves, parts, sizes, outlines, edges, starts, frames, origins,
        planes, frame, origin, rims, blockers[0], blockers[1], blockers[2],
    )  # fmt: skip


@kernel
def receive(casters, axes, place):
    """The casters from a frame at `place` with `axes` as columns. Steps and blurs are still to be set, by `spread`."""
    count, number = casters.places.shape[0], casters.origins.shape[0]
    boxes, kinds = np.zeros((count, BOX), np.float32), np.zeros((count, 3), np.int64)
    outlines, joint = np.zeros((number, 18), np.float32), np.zeros(16, np.float32)
    for k in range(count):
        describe_box(boxes[k], axes, place, casters.turns[k], casters.places[k], casters.halves[k], casters.lamp)
        kinds[k, 0], kinds[k, 1], kinds[k, 2] = 1, casters.outlines[k], casters.parts[k]
    longest = count
    for k in range(number):
        _put_frame(outlines[k], axes, place, casters.frames[k], casters.origins[k], casters.lamp)
        for j in range(3):
            outlines[k, 13 + j] = f32(casters.planes[k, j])
        longest = max(longest, casters.starts[k + 1] - casters.starts[k])
    _put_frame(joint, axes, place, casters.frame, casters.origin, casters.lamp)
    joint[15] = f32(casters.lamp_radius)
    scratch = np.empty((2, longest), np.int64)
    return Reception(boxes, kinds, casters.edges, casters.starts, outlines, casters.rims, joint, scratch)


@kernel
def _put_frame(row, axes, place, frame, origin, lamp):
    turn, move = np.empty((3, 3), np.float32), np.empty(3, np.float32)
    change_frame(axes, place, frame, origin, turn, move)
    away = 0.0
    for j in range(3):
        for i in range(3):
            row[3 * j + i] = turn[j, i]
        row[9 + j] = move[j]
        away += (lamp[j] - origin[j]) ** 2
    row[12] = f32(math.sqrt(away))


@kernel
def spread(reception, casters, right, down):
    """Set how far shadows are blurred over a pixel, whose steps are `right` and `down` (3,) in the receivers' frame."""
    for k in range(reception.kinds.shape[0]):
        if reception.kinds[k, 0] == 0:
            continue
        o = reception.kinds[k, 1]
        if o < 0:
            pixel_steps(reception.boxes[k], right, down)
        else:
            for j in range(2):
                width = _width(reception.outlines[o], j, right, down)
                reception.outlines[o, 16 + j] = f32(min(PIXEL_BLUR * width, casters.sizes[k]))
    for j in range(2):
        reception.joint[13 + j] = f32(PIXEL_BLUR * _width(reception.joint, j, right, down))


@kernel
def _width(frame, axis, right, down):
    a, b, c = frame[3 * axis], frame[3 * axis + 1], frame[3 * axis + 2]
    across, along = a * right[0] + b * right[1] + c * right[2], a * down[0] + b * down[1] + c * down[2]
    return math.sqrt(across**2 + along**2)


@kernel
def aim(reception, casters, middle, reach):
    """Choose the casters that may shadow points within `reach` of `middle` (3,), both in the world; whether any."""
    some = False
    for k in range(reception.kinds.shape[0]):
        near = may_shadow(middle, reach, casters.places[k], casters.sizes[k], casters.lamp, casters.lamp_radius)
        reception.kinds[k, 0] = 1 if near else 0
        some = some or near
    return some


@formula
def shade(S, n, reception, layered, joint_always):
    """SEEN *= share of the lamp that the chosen casters leave visible from the points U, V, W.

    layered: some casters may lie behind the points; see `hide_behind`. joint_always: their union counts under narrow
    lamps, too.
    """
    for first in range(0, n, FEW):
        part, count = S[first:], min(n - first, FEW)
        _shade_few(part, count, around(part, count), reception, layered, joint_always)


@kernel
def _shade_few(S, n, near, reception, layered, joint_always):
    """near: where the points are in the frame of the reception, as of `around`."""
    begin_group(S, n)
    boxes, kinds, edges, starts, outlines, rims, joint, scratch = reception
    radius, count, hiding = joint[15], 0, 0
    for k in range(kinds.shape[0]):
        if kinds[k, 0] == 0 or not box_may_shadow(near, boxes[k], radius):
            continue
        o = kinds[k, 1]
        if o < 0:
            hide(S, n, boxes[k], radius)
        else:
            own = edges[starts[o] : starts[o + 1]]
            if not shade_behind(S, n, near, outlines[o], own, scratch[1], radius, layered):
                continue
        hiding += take_in(S, n, f32(kinds[k, 2]), ONE if o >= 0 else ZERO)
        # Also one that hides nothing of any point: what a point sees must not hang on its neighbours.
        scratch[0, count] = k
        note(S, n, count, layered)
        count += 1
    wide = radius > WIDE * joint[12]
    if (wide or joint_always) and (hiding > 1 or (wide and hiding > 0)):
        first, last = overlap(S, n, wide)
        if first < last:
            join(S[first:], last - first, scratch[0], count, boxes, rims, kinds, joint)
    if hiding > 0:
        end_group(S, n)


@kernel
def around(S, n):
    """A box around the points U, V, W with room for the blur of shadows at its rim: its middle (u, v, w), the radius of
    a sphere that holds it, and its half sides."""
    low_u, high_u, low_v, high_v, low_w, high_w = S[U], S[U], S[V], S[V], S[W], S[W]
    for i in range(n):
        low_u, high_u = smaller(low_u, S[U + i]), larger(high_u, S[U + i])
        low_v, high_v = smaller(low_v, S[V + i]), larger(high_v, S[V + i])
        low_w, high_w = smaller(low_w, S[W + i]), larger(high_w, S[W + i])
    du, dv, dw = high_u - low_u, high_v - low_v, high_w - low_w
    reach = PAST * math.sqrt(du * du + dv * dv + dw * dw) + RIM_M
    middle = HALF * (low_u + high_u), HALF * (low_v + high_v), HALF * (low_w + high_w)
    return (*middle, reach, PAST * du + RIM_M, PAST * dv + RIM_M, PAST * dw + RIM_M)
