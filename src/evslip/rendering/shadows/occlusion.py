"""Share of the light from all around that the bodies nearby keep away: ambient occlusion.

The share of a point's surroundings that a box fills, weighted with the cosine to the normal, is its form factor: a sum
over the edges of the faces that look to the point (Lambert's formula; Baum, Rushmeier and Winget 1989).
"""

import math

import numpy as np

from evslip.rendering.geometry.face_visibility import faces_seen, matters
from evslip.rendering.scratch import HALF, ONE, ZERO, clamped, f32, formula, kernel, slot
from evslip.rendering.slots import MORE, NORMAL_X, NORMAL_Y, NORMAL_Z, OPEN, SLOT, U, V, W

PITCH = 8
"""Pixels between the nodes at which the surface's occlusion is found; between them it is interpolated."""
CLEAR_M = f32(1e-4)
"""A point under a box that stands on it counts as this far beside it."""
NEAR_M, LEANING = f32(0.008), f32(0.8)
"""Less than this far over the surface, and with this cosine between the surface's normal and an axis of its own, a box
counts as partly standing."""
FACING, LEVEL = f32(0.7), f32(1e-6)
FLOW_X, FLOW_Y, FLOW_Z, PX, PY, PZ, NX, NY, NZ = (MORE + (24 + k) * SLOT for k in range(9))
DARK = f32(0.7)
"""Share of surrounding light that a body keeps away. What it sends back instead is taken as 0.3 of it: about that of
grey matt bodies, whose sides face half the sky."""


@formula
def arc(cosine, square):
    """Angle over its sine over 2 pi, of two unit vectors; within 1e-3 (Heitz, Dupuy, Hill and Neubelt 2016). square: of
    the sine."""
    x = abs(cosine)
    over = f32(0.8543985) + (f32(0.4965155) + f32(0.0145206) * x) * x
    near = over / (f32(3.4175940) + (f32(4.1616724) + x) * x)
    return near if cosine > ZERO else HALF / math.sqrt(max(square, f32(1e-12))) - near


@kernel
def block(S, n, box, above):
    """OPEN *= 1 - DARK * form factor of a box, seen from the points U, V, W with normals NORMAL.

    box: of `box_shadow.describe_boxes`. above: the whole box lies above the points' horizon. Where it does not, the
    part above is that of a sphere with the same flow of light (Snyder 1996, Hill 2016).
    """
    n = clamped(n)
    _into_box(S, n, box)
    h0, h1, h2 = box[15], box[16], box[17]
    # Corners and edges are written out: at constant distances in S, loops need no check for overlap.
    _see_corner(S, n, 0 * 3 * SLOT, -h0, -h1, -h2)
    _see_corner(S, n, 1 * 3 * SLOT, h0, -h1, -h2)
    _see_corner(S, n, 2 * 3 * SLOT, -h0, h1, -h2)
    _see_corner(S, n, 3 * 3 * SLOT, h0, h1, -h2)
    _see_corner(S, n, 4 * 3 * SLOT, -h0, -h1, h2)
    _see_corner(S, n, 5 * 3 * SLOT, h0, -h1, h2)
    _see_corner(S, n, 6 * 3 * SLOT, -h0, h1, h2)
    _see_corner(S, n, 7 * 3 * SLOT, h0, h1, h2)
    for i in range(n):
        S[FLOW_X + i], S[FLOW_Y + i], S[FLOW_Z + i] = ZERO, ZERO, ZERO
    never, always = faces_seen(S, n, PX, (h0, h1, h2), ZERO)
    if matters(never, always, 4, 16):
        _add_edge(S, n, 0 * 3 * SLOT, 1 * 3 * SLOT, 1 * SLOT, 2 * SLOT, -ONE, -ONE, h1, h2)
    if matters(never, always, 8, 16):
        _add_edge(S, n, 2 * 3 * SLOT, 3 * 3 * SLOT, 1 * SLOT, 2 * SLOT, ONE, -ONE, h1, h2)
    if matters(never, always, 4, 32):
        _add_edge(S, n, 4 * 3 * SLOT, 5 * 3 * SLOT, 1 * SLOT, 2 * SLOT, -ONE, ONE, h1, h2)
    if matters(never, always, 8, 32):
        _add_edge(S, n, 6 * 3 * SLOT, 7 * 3 * SLOT, 1 * SLOT, 2 * SLOT, ONE, ONE, h1, h2)
    if matters(never, always, 16, 1):
        _add_edge(S, n, 0 * 3 * SLOT, 2 * 3 * SLOT, 2 * SLOT, 0 * SLOT, -ONE, -ONE, h2, h0)
    if matters(never, always, 32, 1):
        _add_edge(S, n, 4 * 3 * SLOT, 6 * 3 * SLOT, 2 * SLOT, 0 * SLOT, ONE, -ONE, h2, h0)
    if matters(never, always, 16, 2):
        _add_edge(S, n, 1 * 3 * SLOT, 3 * 3 * SLOT, 2 * SLOT, 0 * SLOT, -ONE, ONE, h2, h0)
    if matters(never, always, 32, 2):
        _add_edge(S, n, 5 * 3 * SLOT, 7 * 3 * SLOT, 2 * SLOT, 0 * SLOT, ONE, ONE, h2, h0)
    if matters(never, always, 1, 4):
        _add_edge(S, n, 0 * 3 * SLOT, 4 * 3 * SLOT, 0 * SLOT, 1 * SLOT, -ONE, -ONE, h0, h1)
    if matters(never, always, 2, 4):
        _add_edge(S, n, 1 * 3 * SLOT, 5 * 3 * SLOT, 0 * SLOT, 1 * SLOT, ONE, -ONE, h0, h1)
    if matters(never, always, 1, 8):
        _add_edge(S, n, 2 * 3 * SLOT, 6 * 3 * SLOT, 0 * SLOT, 1 * SLOT, -ONE, ONE, h0, h1)
    if matters(never, always, 2, 8):
        _add_edge(S, n, 3 * 3 * SLOT, 7 * 3 * SLOT, 0 * SLOT, 1 * SLOT, ONE, ONE, h0, h1)
    for i in range(n):
        x, y, z = S[FLOW_X + i], S[FLOW_Y + i], S[FLOW_Z + i]
        level = x * S[NX + i] + y * S[NY + i] + z * S[NZ + i]
        if not above:
            length = math.sqrt(x * x + y * y + z * z)
            level = (length * length + level) / (length + ONE)
        S[OPEN + i] *= ONE - DARK * min(max(level, ZERO), ONE)


@kernel
def _into_box(S, n, box):
    """Points and normals in the box's frame. Points under a box that stands on their plane are moved beside it: nobody
    sees them, but what is interpolated between them and others shall be as it is beside the box."""
    m00, m01, m02, m10, m11, m12, m20, m21, m22 = box[0], box[1], box[2], box[3], box[4], box[5], box[6], box[7], box[8]
    o0, o1, o2, h0, h1, h2 = box[9], box[10], box[11], box[15], box[16], box[17]
    for i in range(n):
        u, v, w, p, q, r = S[U + i], S[V + i], S[W + i], S[NORMAL_X + i], S[NORMAL_Y + i], S[NORMAL_Z + i]
        x, y, z = m00 * u + m01 * v + m02 * w + o0, m10 * u + m11 * v + m12 * w + o1, m20 * u + m21 * v + m22 * w + o2
        a, b, c = m00 * p + m01 * q + m02 * r, m10 * p + m11 * q + m12 * r, m20 * p + m21 * q + m22 * r
        along = a * x + b * y + c * z
        gap = -along - abs(a) * h0 - abs(b) * h1 - abs(c) * h2
        d0, d1, d2 = x - a * along, y - b * along, z - c * along
        far = f32(1e6)
        out0 = (h0 + CLEAR_M) / (abs(d0) + LEVEL) if abs(a) < FACING else far
        out1 = (h1 + CLEAR_M) / (abs(d1) + LEVEL) if abs(b) < FACING else far
        out2 = (h2 + CLEAR_M) / (abs(d2) + LEVEL) if abs(c) < FACING else far
        standing = min(max((max(max(abs(a), abs(b)), abs(c)) - LEANING) * f32(5), ZERO), ONE)
        standing *= min(max(ONE - gap / NEAR_M, ZERO), ONE)
        push = standing * max(min(min(out0, out1), out2) - ONE, ZERO)
        S[PX + i], S[PY + i], S[PZ + i] = x + push * d0, y + push * d1, z + push * d2
        S[NX + i], S[NY + i], S[NZ + i] = a, b, c


@formula
def _see_corner(S, n, at, x, y, z):
    n, at = clamped(n), slot(MORE + at)
    for i in range(n):
        a, b, c = x - S[PX + i], y - S[PY + i], z - S[PZ + i]
        unit = ONE / math.sqrt(a * a + b * b + c * c + f32(1e-12))
        S[at + i], S[at + SLOT + i], S[at + 2 * SLOT + i] = a * unit, b * unit, c * unit


@formula
def _add_edge(S, n, first, second, b, c, sign_b, sign_c, half_b, half_c):
    """The flow of an edge along an axis, from corner `first` to `second`, between the faces across axes b and c."""
    n, first, second, b, c = clamped(n), slot(MORE + first), slot(MORE + second), slot(PX + b), slot(PX + c)
    for i in range(n):
        seen_b = ONE if sign_b * S[b + i] > half_b else ZERO
        seen_c = ONE if sign_c * S[c + i] > half_c else ZERO
        x0, y0, z0 = S[first + i], S[first + SLOT + i], S[first + 2 * SLOT + i]
        x1, y1, z1 = S[second + i], S[second + SLOT + i], S[second + 2 * SLOT + i]
        x, y, z = y0 * z1 - z0 * y1, z0 * x1 - x0 * z1, x0 * y1 - y0 * x1
        angle = arc(x0 * x1 + y0 * y1 + z0 * z1, x * x + y * y + z * z)
        weight = sign_b * sign_c * (seen_c - seen_b) * angle
        S[FLOW_X + i] += weight * x
        S[FLOW_Y + i] += weight * y
        S[FLOW_Z + i] += weight * z


@kernel
def openness(scratch, places, normals, parts, boxes, box_parts, above):
    """Share of the light from all around that boxes leave to points, float32 (n,).

    places, normals (3, n), parts (n,): of the points; boxes: of `box_shadow.describe_boxes`; box_parts: the body that
    each belongs to, from which it keeps no light away; above: all boxes lie wholly above the points' horizons.
    """
    S, opened = scratch.slots, np.ones(parts.size, np.float32)
    where = np.empty(parts.size, np.int64)
    for k in range(boxes.shape[0]):
        count = 0
        for i in range(parts.size):
            if parts[i] != box_parts[k] and (above or _rises(boxes[k], places, normals, i)):
                where[count] = i
                count += 1
        for start in range(0, count, SLOT):
            n = min(SLOT, count - start)
            for i in range(n):
                at = where[start + i]
                S[U + i], S[V + i], S[W + i] = places[0, at], places[1, at], places[2, at]
                S[NORMAL_X + i], S[NORMAL_Y + i], S[NORMAL_Z + i] = normals[0, at], normals[1, at], normals[2, at]
                S[OPEN + i] = ONE
            block(S, n, boxes[k], above)
            for i in range(n):
                opened[where[start + i]] *= S[OPEN + i]
    return opened


@formula
def _rises(box, places, normals, i):
    """Whether a box's highest corner is above the horizon of a point."""
    over = -(normals[0, i] * places[0, i] + normals[1, i] * places[1, i] + normals[2, i] * places[2, i])
    for axis in range(3):
        along = normals[0, i] * box[3 * axis] + normals[1, i] * box[3 * axis + 1] + normals[2, i] * box[3 * axis + 2]
        over += abs(along) * box[15 + axis] - along * box[9 + axis]
    return over > ZERO


def between_columns(nodes: np.ndarray, width: int) -> np.ndarray:
    """Values at the middle of every column, (rows, width), of nodes (rows, columns) that are PITCH apart."""
    at = (np.arange(width) + 0.5) / PITCH
    column = at.astype(int)
    share = (at - column).astype(np.float32)
    return nodes[:, column] + share * (nodes[:, column + 1] - nodes[:, column])


@kernel
def open_run(S, n, rows, column, row):
    """OPEN of n pixels from `column` on in a row; rows: of `between_columns`."""
    place = (f32(row) + HALF) * f32(1 / PITCH)
    upper, lower = rows[int(place)], rows[int(place) + 1]
    share = place - f32(int(place))
    for i in range(n):
        S[OPEN + i] = upper[column + i] + share * (lower[column + i] - upper[column + i])


@kernel
def between(nodes, x, y):
    """Bilinear value at (x, y), counted in nodes."""
    x, y = min(max(x, ZERO), f32(nodes.shape[1]) - f32(1.001)), min(max(y, ZERO), f32(nodes.shape[0]) - f32(1.001))
    column, row = int(x), int(y)
    x, y = x - f32(column), y - f32(row)
    upper = nodes[row, column] + x * (nodes[row, column + 1] - nodes[row, column])
    lower = nodes[row + 1, column] + x * (nodes[row + 1, column + 1] - nodes[row + 1, column])
    return upper + y * (lower - upper)
