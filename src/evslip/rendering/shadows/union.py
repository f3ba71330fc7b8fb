"""Share of the lamp that several bodies hide together.

Where two of them hide part of it at once, it matters whether they hide the same part. The lamp's disc is cut in
STRIPS. In each of them, a box as the lamp sees it covers from its left rim to its right one, over the part of the
strip's height that it reaches into. Intervals of several boxes are joined, and a gap between them is kept.
"""

import numpy as np

from evslip.rendering.geometry.face_visibility import faces_seen, matters
from evslip.rendering.geometry.simd_minmax import larger, smaller
from evslip.rendering.scratch import BLOCK, HALF, ONE, TWO, ZERO, clamped, f32, formula, kernel, slot
from evslip.rendering.shadows.mesh_shadow import STEEP, held
from evslip.rendering.slots import (
    HIDDEN,
    LAMP_X,
    LAMP_Y,
    LAMP_Z,
    MORE,
    ROOM,
    SEEN_NOW,
    SLOT,
    SUM_HIDDEN,
    SUM_OUTLINED,
    U,
    V,
    W,
)

STRIPS = 8
LEAST, SOFT = f32(3e-3), f32(0.04)
"""Bodies are joined where more than one hides part of the lamp: those but the darkest together LEAST of it, wholly from
SOFT on."""
WIDE = f32(0.06)
"""Under a lamp of a larger angular radius, boxes are measured in strips wherever they hide part of it: a box smaller
than the lamp's cone hides more than the product of its wedges."""
RIM_M = f32(5e-4)
"""From so far behind a face's plane on, the face counts as seen, and from the plane on wholly: a pixel is wider than
its middle, and part of one next to a box may lie under it, whether it stands there or is lifted a little."""
PER_DISC, PER_RIM, PER_LEAST = f32(1 / np.pi), ONE / RIM_M, ONE / LEAST
FAR, TINY = f32(1e6), f32(1e-9)
SLIVER = f32(0.01)
"""A box that covers less of a strip's width, in radii of the lamp, is left out: the gap to it would count."""
HEIGHT = f32(2 / STRIPS)
_RIMS = np.linspace(-1, 1, STRIPS + 1)
_AREAS = (_RIMS * np.sqrt(1 - _RIMS**2) + np.arcsin(_RIMS)) / 2
CHORDS = (np.diff(_AREAS) / np.diff(_RIMS)).astype(np.float32)
"""Mean half chords of the unit disc, strip by strip."""
EDGES = 12
"""Edges of a box: the outermost of them are its outline, from wherever it is seen."""

LOW, HIGH, GAP_LOW, GAP_HIGH, LOST, UP, DOWN, TALL = (MORE + k * STRIPS * SLOT for k in range(8))
"""State of each strip: the joint interval, the largest gap in it, the length of other gaps; of the box at hand the
integrals over height of its two boundaries, and the height of one of them."""
X0, Y0, SLOPE, Y1, SENSE = (MORE + (8 * STRIPS + k) * SLOT for k in range(5))
"""One edge before the lamp's disc; up to 1 or -1 for one of the outline, as it runs, 0 for another."""
PX, PY, PZ, UNITED, OWN, BOXED, BLUR_X, BLUR_Y, PER_DEPTH = (MORE + (8 * STRIPS + 5 + k) * SLOT for k in range(9))
COUNTED, MOST = MORE + (8 * STRIPS + 14) * SLOT, 24
"""Weights of the boxes of at most so many casters."""


@kernel
def edges_of(turns, places, halves, frame, origin, edges):
    """Fill in edges (k, EDGES, 2, 3): both ends of the edges of boxes, in the lamp's frame. turns, places, halves: the
    boxes, in the world as frame and origin."""
    corner = np.zeros(3)
    for k in range(places.shape[0]):
        for m in range(EDGES):
            a, sides = m // 4, m % 4
            b, c = (a + 1) % 3, (a + 2) % 3
            for end in range(2):
                corner[a] = (2 * end - 1) * halves[k, a]
                corner[b] = (2 * (sides % 2) - 1) * halves[k, b]
                corner[c] = (2 * (sides // 2) - 1) * halves[k, c]
                for i in range(3):
                    total = 0.0
                    for j in range(3):
                        world = places[k, j] - origin[j]
                        for q in range(3):
                            world += turns[k, j, q] * corner[q]
                        total += frame[j, i] * world
                    edges[k, m, end, i] = f32(total)


@kernel
def note(S, n, j, layered):
    """Weight of the box of caster number j where shadows are joined. layered: it may lie behind some points, or be
    their own body; where it hides (HIDDEN) next to nothing by itself, it does not count."""
    n, counted = clamped(n), slot(COUNTED + j * SLOT)
    for i in range(n):
        S[counted + i] = min(S[HIDDEN + i] * PER_LEAST, ONE) if layered else ONE


@kernel
def join(S, n, joined, count, boxes, edges, kinds, joint):
    """SEEN_NOW of a group of casters: SEEN_NOW so far is what the darkest of them leaves. The union of the boxes
    `joined` (the first `count`), over the sum of their shares, is that of the casters. edges: of
    `edges_of`; boxes, kinds, joint: of `casters.Reception`.
    """
    m00, m01, m02, m10, m11, m12 = joint[0], joint[1], joint[2], joint[3], joint[4], joint[5]
    m20, m21, m22, o0, o1, o2 = joint[6], joint[7], joint[8], joint[9], joint[10], joint[11]
    n = clamped(n)
    distance, blur_x, blur_y, lamp_radius = joint[12], joint[13], joint[14], joint[15]
    for i in range(n):
        u, v, w = S[U + i], S[V + i], S[W + i]
        z = o2 + m20 * u + m21 * v + m22 * w
        S[LAMP_X + i] = o0 + m00 * u + m01 * v + m02 * w
        S[LAMP_Y + i] = o1 + m10 * u + m11 * v + m12 * w
        S[LAMP_Z + i], S[PER_DEPTH + i] = z, ONE / (distance - z)
        S[OWN + i], S[BOXED + i], S[UNITED + i] = ZERO, ZERO, ZERO
        S[BLUR_X + i], S[BLUR_Y + i] = S[ROOM + i] * blur_x + TINY, S[ROOM + i] * blur_y + TINY
    # Strips and edges are written out: at constant distances in S, loops need no check for overlap.
    for strip in range(STRIPS):
        _clear(S, n, strip * SLOT)
    for j in range(count):
        box = joined[j]
        boxed, counted = ONE if kinds[box, 1] < 0 else ZERO, COUNTED + j * SLOT
        half = (boxes[box, 15], boxes[box, 16], boxes[box, 17])
        _enter(S, n, boxes[box])
        never, always = faces_seen(S, n, PX, half, RIM_M)
        for edge in range(EDGES):
            b, c = (edge // 4 + 1) % 3, (edge // 4 + 2) % 3
            above_b, above_c = edge % 2, edge % 4 // 2
            if not matters(never, always, 1 << (2 * b + above_b), 1 << (2 * c + above_c)):
                continue
            sign_b, sign_c = f32(2 * above_b - 1), f32(2 * above_c - 1)
            _sense(S, n, PX + b * SLOT, PX + c * SLOT, counted, sign_b, sign_c, half[b], half[c])
            low, high = _project(S, n, edges[box, edge], lamp_radius)
            # Strips are written out: at constant distances in S, loops need no check for overlap.
            if low < f32(-0.75):
                _bound(S, n, 0 * SLOT, f32(-1.0), CHORDS[0])
            if low < f32(-0.5) and high > f32(-0.75):
                _bound(S, n, 1 * SLOT, f32(-0.75), CHORDS[1])
            if low < f32(-0.25) and high > f32(-0.5):
                _bound(S, n, 2 * SLOT, f32(-0.5), CHORDS[2])
            if low < f32(0.0) and high > f32(-0.25):
                _bound(S, n, 3 * SLOT, f32(-0.25), CHORDS[3])
            if low < f32(0.25) and high > f32(0.0):
                _bound(S, n, 4 * SLOT, f32(0.0), CHORDS[4])
            if low < f32(0.5) and high > f32(0.25):
                _bound(S, n, 5 * SLOT, f32(0.25), CHORDS[5])
            if low < f32(0.75) and high > f32(0.5):
                _bound(S, n, 6 * SLOT, f32(0.5), CHORDS[6])
            if high > f32(0.75):
                _bound(S, n, 7 * SLOT, f32(0.75), CHORDS[7])
        _add(S, n, 0 * SLOT, boxed)
        _add(S, n, 1 * SLOT, boxed)
        _add(S, n, 2 * SLOT, boxed)
        _add(S, n, 3 * SLOT, boxed)
        _add(S, n, 4 * SLOT, boxed)
        _add(S, n, 5 * SLOT, boxed)
        _add(S, n, 6 * SLOT, boxed)
        _add(S, n, 7 * SLOT, boxed)
    for strip in range(STRIPS):
        _measure(S, n, strip * SLOT)
    wide = ONE if lamp_radius > WIDE * distance else ZERO
    for i in range(n):
        share = min((S[UNITED + i] + TINY) / (S[OWN + i] + TINY), ONE)
        hidden = min(share * (S[BOXED + i] * (HEIGHT * PER_DISC) + S[SUM_OUTLINED + i]), ONE)
        most = ONE - S[SEEN_NOW + i]
        weight = max(wide, min(max((S[SUM_HIDDEN + i] - most - LEAST) / SOFT, ZERO), ONE))
        S[SEEN_NOW + i] = min(max(S[SEEN_NOW + i] + weight * (most - hidden), ZERO), S[SEEN_NOW + i])


@formula
def _clear(S, n, at):
    n, at = clamped(n), slot(at)
    for i in range(n):
        S[LOW + at + i], S[HIGH + at + i], S[LOST + at + i] = FAR, -FAR, ZERO
        S[GAP_LOW + at + i], S[GAP_HIGH + at + i] = ZERO, ZERO
        S[UP + at + i], S[DOWN + at + i], S[TALL + at + i] = ZERO, ZERO, ZERO


@formula
def _measure(S, n, at):
    """Add the length of a strip's union."""
    n, at = clamped(n), slot(at)
    for i in range(n):
        gap = max(S[GAP_HIGH + at + i] - S[GAP_LOW + at + i], ZERO) + S[LOST + at + i]
        S[UNITED + i] += max(S[HIGH + at + i] - S[LOW + at + i] - gap, ZERO)


@formula
def _project(S, n, edge, lamp_radius):
    """An edge before the disc, in units of the lamp's radius, widened by the pixel's blur. Returns the lowest and the
    highest place it has for any point."""
    ax, ay, az = edge[0, 0], edge[0, 1], edge[0, 2]
    bx, by, bz = edge[1, 0], edge[1, 1], edge[1, 2]
    n, low, high = clamped(n), FAR, -FAR
    for i in range(n):
        x, y, z = S[LAMP_X + i], S[LAMP_Y + i], S[LAMP_Z + i]
        ta, tb = (az - z) * S[PER_DEPTH + i], (bz - z) * S[PER_DEPTH + i]
        wide_a, wide_b = lamp_radius * max(ta, ZERO), lamp_radius * max(tb, ZERO)
        x0, y0 = (ax - x + x * ta) / (wide_a + S[BLUR_X + i]), (ay - y + y * ta) / (wide_a + S[BLUR_Y + i])
        x1, y1 = (bx - x + x * tb) / (wide_b + S[BLUR_X + i]), (by - y + y * tb) / (wide_b + S[BLUR_Y + i])
        rise = y1 - y0
        S[X0 + i], S[Y0 + i], S[Y1 + i] = x0, y0, y1
        S[SLOPE + i] = (x1 - x0) / (rise + TINY if rise >= ZERO else rise - TINY)
        low, high = smaller(low, smaller(y0, y1)), larger(high, larger(y0, y1))
    return low, high


@formula
def _enter(S, n, box):
    """PX, PY, PZ = the points in a box's frame."""
    for i in range(n):
        u, v, w = S[U + i], S[V + i], S[W + i]
        S[PX + i] = box[0] * u + box[1] * v + box[2] * w + box[9]
        S[PY + i] = box[3] * u + box[4] * v + box[5] * w + box[10]
        S[PZ + i] = box[6] * u + box[7] * v + box[8] * w + box[11]


@formula
def _sense(S, n, b, c, counted, sign_b, sign_c, half_b, half_c):
    """Share of an edge in the outline that a point sees: one of its two faces, across b and c, looks there."""
    n, b, c, counted = clamped(n), slot(b), slot(c), slot(counted)
    for i in range(n):
        seen_b = min(max(ONE + (sign_b * S[b + i] - half_b) * PER_RIM, ZERO), ONE)
        seen_c = min(max(ONE + (sign_c * S[c + i] - half_c) * PER_RIM, ZERO), ONE)
        S[SENSE + i] = sign_b * sign_c * (seen_c - seen_b) * S[counted + i]


@formula
def _bound(S, n, at, bottom, chord):
    """Add an edge to a strip from height `bottom` on: its integral over height, held within +-chord."""
    n, at, top = clamped(n), slot(at), bottom + HEIGHT
    for i in range(n):
        y, slope = S[Y0 + i], S[SLOPE + i]
        start, end = min(max(y, bottom), top), min(max(S[Y1 + i], bottom), top)
        first, last = S[X0 + i] + (start - y) * slope, S[X0 + i] + (end - y) * slope
        across = last - first
        middle = min(max(HALF * (first + last), -chord), chord)
        mean = (held(last, chord) - held(first, chord)) / across if abs(across) > STEEP else middle
        rise = S[SENSE + i] * (end - start)
        risen, fallen = max(rise, ZERO), max(-rise, ZERO)
        S[UP + at + i] += risen * mean
        S[DOWN + at + i] += fallen * mean
        S[TALL + at + i] += risen


@formula
def _add(S, n, at, boxed):
    """Join a box's interval to those of a strip. Where the box reaches into part of the strip's height alone, it counts
    as so much narrower about its middle. The larger of two gaps is kept for others to fill."""
    n, at = clamped(n), slot(at)
    for i in range(n):
        up, down, height = S[UP + at + i], S[DOWN + at + i], S[TALL + at + i]
        S[UP + at + i], S[DOWN + at + i], S[TALL + at + i] = ZERO, ZERO, ZERO
        middle = HALF * (up + down) / (height + TINY)
        half = HALF * abs(up - down) * (ONE / HEIGHT)
        left, right = middle - half, middle + half
        S[OWN + i] += TWO * half
        S[BOXED + i] += TWO * half * boxed
        low, high = S[LOW + at + i], S[HIGH + at + i]
        gap_low, gap_high, lost = S[GAP_LOW + at + i], S[GAP_HIGH + at + i], S[LOST + at + i]
        some, first = right - left > SLIVER, low > high
        # What is left of the gap on either side; of two remainders the larger one.
        below, above = min(left, gap_high) - gap_low, gap_high - max(right, gap_low)
        old = max(gap_high - gap_low, ZERO)
        upper = above > below
        kept_low = max(right, gap_low) if upper else gap_low
        kept_high = gap_high if upper else min(left, gap_high)
        kept = max(kept_high - kept_low, ZERO)
        lost += max(min(below, above), ZERO) if old > ZERO else ZERO
        # A gap between the new interval and all others.
        between_low, between_high = (high, left) if left > high else (right, low)
        between = ZERO if first else max(between_high - between_low, ZERO)
        wider = between > kept
        lost += min(between, kept)
        S[GAP_LOW + at + i] = (between_low if wider else kept_low) if some else gap_low
        S[GAP_HIGH + at + i] = (between_high if wider else kept_high) if some else gap_high
        S[LOST + at + i] = lost if some else S[LOST + at + i]
        S[LOW + at + i] = min(low, left) if some else low
        S[HIGH + at + i] = max(high, right) if some else high


@kernel
def overlap(S, n, wide):
    """The points that `join` matters to, first and past the last in whole BLOCKs: more than one caster hides part of
    the lamp, or under a wide lamp any."""
    first, last = n, 0
    for start in range(0, n, BLOCK):
        past, most = min(start + BLOCK, n), ZERO
        for i in range(start, past):
            seen = S[SEEN_NOW + i]
            most = larger(most, seen if wide else min(S[SUM_HIDDEN + i] - (ONE - seen), seen))
        if most > LEAST:
            first, last = min(first, start), past
    return first, last
