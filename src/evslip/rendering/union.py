"""What several bodies hide of the lamp together.

Where two of them hide part of it at once, it matters whether they hide the same part. The lamp's disc is cut in
STRIPS. In each of them, a box as the lamp sees it covers from its left rim to its right one, over the part of the
strip's height that it reaches into. Intervals of several boxes are joined, and a gap between them is kept.
"""

import numpy as np

from evslip.rendering.lanes import (
    HALF,
    LAMP_X,
    LAMP_Y,
    LAMP_Z,
    LANES,
    MORE,
    ONE,
    ROOM,
    SEEN_NOW,
    SUM_HIDDEN,
    SUM_OUTLINED,
    TWO,
    ZERO,
    U,
    V,
    W,
    f32,
    formula,
    kernel,
)  # fmt: skip
from evslip.rendering.outline import STEEP, held

STRIPS = 8
LEAST, SOFT = f32(3e-3), f32(0.04)
"""Bodies are joined where more than one hides part of the lamp: those but the darkest together LEAST of it, wholly from
SOFT on."""
WIDE = f32(0.06)
"""Under a lamp of a larger angular radius, boxes are measured in strips wherever they hide part of it: a box smaller
than the lamp's cone hides more than the product of its wedges."""
PER_DISC = f32(1 / np.pi)
FAR, TINY = f32(1e6), f32(1e-9)
HEIGHT = f32(2 / STRIPS)
_RIMS = np.linspace(-1, 1, STRIPS + 1)
_AREAS = (_RIMS * np.sqrt(1 - _RIMS**2) + np.arcsin(_RIMS)) / 2
CHORDS = (np.diff(_AREAS) / np.diff(_RIMS)).astype(np.float32)
"""Mean half chords of the unit disc, strip by strip."""
EDGES = 12
"""Of a box: the outermost of them are its outline, from wherever it is seen."""

LOW, HIGH, GAP_LOW, GAP_HIGH, LOST = (MORE + k * STRIPS * LANES for k in range(5))
"""State of each strip: the joint interval, the largest gap in it, the length of other gaps."""
X0, Y0, SLOPE, Y1, SENSE = (MORE + 5 * STRIPS * LANES + k * EDGES * LANES for k in range(5))
"""Edges of one box before the lamp's disc; 1 or -1 for those of its outline, as they run, 0 for others."""
PX, PY, PZ, UNITED, OWN, BOXED, BLUR_X, BLUR_Y, PER_DEPTH = (
    MORE + (5 * STRIPS + 5 * EDGES + k) * LANES for k in range(9)
)


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
def join(S, n, joined, count, boxes, edges, kinds, joint):
    """SEEN_NOW of a group of casters: SEEN_NOW so far is what the darkest of them leaves. The union of the boxes
    `joined` (the first `count`), over the sum of their shares, is that of the casters. edges: of
    `edges_of`; boxes, kinds, joint: of `casters.Reception`.
    """
    m00, m01, m02, m10, m11, m12 = joint[0], joint[1], joint[2], joint[3], joint[4], joint[5]
    m20, m21, m22, o0, o1, o2 = joint[6], joint[7], joint[8], joint[9], joint[10], joint[11]
    distance, blur_x, blur_y, lamp_radius = joint[12], joint[13], joint[14], joint[15]
    for i in range(n):
        u, v, w = S[U + i], S[V + i], S[W + i]
        z = o2 + m20 * u + m21 * v + m22 * w
        S[LAMP_X + i] = o0 + m00 * u + m01 * v + m02 * w
        S[LAMP_Y + i] = o1 + m10 * u + m11 * v + m12 * w
        S[LAMP_Z + i], S[PER_DEPTH + i] = z, ONE / (distance - z)
        S[OWN + i], S[BOXED + i] = ZERO, ZERO
        S[BLUR_X + i], S[BLUR_Y + i] = S[ROOM + i] * blur_x + TINY, S[ROOM + i] * blur_y + TINY
    # Strips and edges are written out: at constant distances in S, loops need no check for overlap.
    for strip in range(STRIPS):
        S[LOW + strip * LANES : LOW + (strip + 1) * LANES] = FAR
        S[HIGH + strip * LANES : HIGH + (strip + 1) * LANES] = -FAR
    S[GAP_LOW : GAP_LOW + 3 * STRIPS * LANES] = ZERO
    for j in range(count):
        box = joined[j]
        boxed = ONE if kinds[box, 1] < 0 else ZERO
        _enter(S, n, boxes[box])
        h = (boxes[box, 15], boxes[box, 16], boxes[box, 17])
        _project(S, n, 0 * LANES, edges[box, 0], lamp_radius)
        _sense(S, n, 0 * LANES, 1 * LANES, 2 * LANES, -ONE, -ONE, h[1], h[2])
        _project(S, n, 1 * LANES, edges[box, 1], lamp_radius)
        _sense(S, n, 1 * LANES, 1 * LANES, 2 * LANES, ONE, -ONE, h[1], h[2])
        _project(S, n, 2 * LANES, edges[box, 2], lamp_radius)
        _sense(S, n, 2 * LANES, 1 * LANES, 2 * LANES, -ONE, ONE, h[1], h[2])
        _project(S, n, 3 * LANES, edges[box, 3], lamp_radius)
        _sense(S, n, 3 * LANES, 1 * LANES, 2 * LANES, ONE, ONE, h[1], h[2])
        _project(S, n, 4 * LANES, edges[box, 4], lamp_radius)
        _sense(S, n, 4 * LANES, 2 * LANES, 0 * LANES, -ONE, -ONE, h[2], h[0])
        _project(S, n, 5 * LANES, edges[box, 5], lamp_radius)
        _sense(S, n, 5 * LANES, 2 * LANES, 0 * LANES, ONE, -ONE, h[2], h[0])
        _project(S, n, 6 * LANES, edges[box, 6], lamp_radius)
        _sense(S, n, 6 * LANES, 2 * LANES, 0 * LANES, -ONE, ONE, h[2], h[0])
        _project(S, n, 7 * LANES, edges[box, 7], lamp_radius)
        _sense(S, n, 7 * LANES, 2 * LANES, 0 * LANES, ONE, ONE, h[2], h[0])
        _project(S, n, 8 * LANES, edges[box, 8], lamp_radius)
        _sense(S, n, 8 * LANES, 0 * LANES, 1 * LANES, -ONE, -ONE, h[0], h[1])
        _project(S, n, 9 * LANES, edges[box, 9], lamp_radius)
        _sense(S, n, 9 * LANES, 0 * LANES, 1 * LANES, ONE, -ONE, h[0], h[1])
        _project(S, n, 10 * LANES, edges[box, 10], lamp_radius)
        _sense(S, n, 10 * LANES, 0 * LANES, 1 * LANES, -ONE, ONE, h[0], h[1])
        _project(S, n, 11 * LANES, edges[box, 11], lamp_radius)
        _sense(S, n, 11 * LANES, 0 * LANES, 1 * LANES, ONE, ONE, h[0], h[1])
        _add(S, n, 0, f32(-1.0), CHORDS[0], boxed)
        _add(S, n, 1 * LANES, f32(-0.75), CHORDS[1], boxed)
        _add(S, n, 2 * LANES, f32(-0.5), CHORDS[2], boxed)
        _add(S, n, 3 * LANES, f32(-0.25), CHORDS[3], boxed)
        _add(S, n, 4 * LANES, f32(0.0), CHORDS[4], boxed)
        _add(S, n, 5 * LANES, f32(0.25), CHORDS[5], boxed)
        _add(S, n, 6 * LANES, f32(0.5), CHORDS[6], boxed)
        _add(S, n, 7 * LANES, f32(0.75), CHORDS[7], boxed)
    for i in range(n):
        total = ZERO
        for strip in range(STRIPS):
            at = strip * LANES + i
            gap = max(S[GAP_HIGH + at] - S[GAP_LOW + at], ZERO) + S[LOST + at]
            total += max(S[HIGH + at] - S[LOW + at] - gap, ZERO)
        S[UNITED + i] = total
    wide = ONE if lamp_radius > WIDE * distance else ZERO
    for i in range(n):
        share = min((S[UNITED + i] + TINY) / (S[OWN + i] + TINY), ONE)
        hidden = min(share * (S[BOXED + i] * (HEIGHT * PER_DISC) + S[SUM_OUTLINED + i]), ONE)
        most = ONE - S[SEEN_NOW + i]
        weight = max(wide, min(max((S[SUM_HIDDEN + i] - most - LEAST) / SOFT, ZERO), ONE))
        S[SEEN_NOW + i] = min(max(S[SEEN_NOW + i] + weight * (most - hidden), ZERO), S[SEEN_NOW + i])


@formula
def _project(S, n, at, edge, lamp_radius):
    """One edge of an outline before the disc, in units of the lamp's radius, widened by the pixel's blur."""
    ax, ay, az = edge[0, 0], edge[0, 1], edge[0, 2]
    bx, by, bz = edge[1, 0], edge[1, 1], edge[1, 2]
    for i in range(n):
        x, y, z = S[LAMP_X + i], S[LAMP_Y + i], S[LAMP_Z + i]
        ta, tb = (az - z) * S[PER_DEPTH + i], (bz - z) * S[PER_DEPTH + i]
        wide_a, wide_b = lamp_radius * max(ta, ZERO), lamp_radius * max(tb, ZERO)
        x0, y0 = (ax - x + x * ta) / (wide_a + S[BLUR_X + i]), (ay - y + y * ta) / (wide_a + S[BLUR_Y + i])
        x1, y1 = (bx - x + x * tb) / (wide_b + S[BLUR_X + i]), (by - y + y * tb) / (wide_b + S[BLUR_Y + i])
        rise = y1 - y0
        S[X0 + at + i], S[Y0 + at + i], S[Y1 + at + i] = x0, y0, y1
        S[SLOPE + at + i] = (x1 - x0) / (rise + TINY if rise >= ZERO else rise - TINY)


@formula
def _enter(S, n, box):
    """PX, PY, PZ = the points in a box's frame."""
    for i in range(n):
        u, v, w = S[U + i], S[V + i], S[W + i]
        S[PX + i] = box[0] * u + box[1] * v + box[2] * w + box[9]
        S[PY + i] = box[3] * u + box[4] * v + box[5] * w + box[10]
        S[PZ + i] = box[6] * u + box[7] * v + box[8] * w + box[11]


@formula
def _sense(S, n, at, b, c, sign_b, sign_c, half_b, half_c):
    """Whether an edge is part of the outline that a point sees: one of its two faces, across b and c, looks there."""
    for i in range(n):
        seen_b = ONE if sign_b * S[PX + b + i] > half_b else ZERO
        seen_c = ONE if sign_c * S[PX + c + i] > half_c else ZERO
        S[SENSE + at + i] = sign_b * sign_c * (seen_c - seen_b)


@formula
def _bound(S, at, bottom, top, chord, up, down, height):
    """With one more edge: integrals over height of the two boundaries of the outline, held within +-chord, and the
    height of one of them."""
    y, slope = S[Y0 + at], S[SLOPE + at]
    start, end = min(max(y, bottom), top), min(max(S[Y1 + at], bottom), top)
    first, last = S[X0 + at] + (start - y) * slope, S[X0 + at] + (end - y) * slope
    across = last - first
    middle = min(max(HALF * (first + last), -chord), chord)
    mean = (held(last, chord) - held(first, chord)) / across if abs(across) > STEEP else middle
    rise = S[SENSE + at] * (end - start)
    risen, fallen = max(rise, ZERO), max(-rise, ZERO)
    return up + risen * mean, down + fallen * mean, height + risen


@formula
def _add(S, n, at, bottom, chord, boxed):
    """Join a box's interval to those of one strip, from height `bottom` on. Where the box reaches into part of the
    strip's height alone, it counts as so much narrower about its middle. The larger of two gaps is kept for others to
    fill."""
    top = bottom + HEIGHT
    for i in range(n):
        up, down, height = ZERO, ZERO, ZERO
        up, down, height = _bound(S, i + 0 * LANES, bottom, top, chord, up, down, height)
        up, down, height = _bound(S, i + 1 * LANES, bottom, top, chord, up, down, height)
        up, down, height = _bound(S, i + 2 * LANES, bottom, top, chord, up, down, height)
        up, down, height = _bound(S, i + 3 * LANES, bottom, top, chord, up, down, height)
        up, down, height = _bound(S, i + 4 * LANES, bottom, top, chord, up, down, height)
        up, down, height = _bound(S, i + 5 * LANES, bottom, top, chord, up, down, height)
        up, down, height = _bound(S, i + 6 * LANES, bottom, top, chord, up, down, height)
        up, down, height = _bound(S, i + 7 * LANES, bottom, top, chord, up, down, height)
        up, down, height = _bound(S, i + 8 * LANES, bottom, top, chord, up, down, height)
        up, down, height = _bound(S, i + 9 * LANES, bottom, top, chord, up, down, height)
        up, down, height = _bound(S, i + 10 * LANES, bottom, top, chord, up, down, height)
        up, down, height = _bound(S, i + 11 * LANES, bottom, top, chord, up, down, height)
        middle = HALF * (up + down) / (height + TINY)
        half = HALF * abs(up - down) * (ONE / HEIGHT)
        left, right = middle - half, middle + half
        S[OWN + i] += TWO * half
        S[BOXED + i] += TWO * half * boxed
        low, high = S[LOW + at + i], S[HIGH + at + i]
        gap_low, gap_high, lost = S[GAP_LOW + at + i], S[GAP_HIGH + at + i], S[LOST + at + i]
        some, first = right > left, low > high
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
def overlaps(S, n, wide):
    """Whether `join` matters to any of the points: more than one caster hides part of the lamp, or under a wide lamp
    any."""
    most = ZERO
    for i in range(n):
        seen = S[SEEN_NOW + i]
        most = max(most, seen if wide else min(S[SUM_HIDDEN + i] - (ONE - seen), seen))
    return most > LEAST
