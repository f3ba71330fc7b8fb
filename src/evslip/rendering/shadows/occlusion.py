"""Share of the light from all around that the bodies nearby keep away: ambient occlusion.

The share of a point's surroundings that a box fills, weighted with the cosine to the normal, is its form factor: a sum
over the edges of the faces that look to the point (Lambert's formula; Baum, Rushmeier and Winget 1989).
"""

import math

import numpy as np

from evslip.rendering.geometry.face_visibility import faces_seen, matters
from evslip.rendering.geometry.simd_minmax import larger
from evslip.rendering.scratch import HALF, ONE, ZERO, clamped, f32, formula, kernel, slot
from evslip.rendering.shadows.box_shadow import BOX, describe_box
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
FACE_NODES = 13
"""Nodes along each side of a cuboid's face."""


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

    box: of `box_shadow.describe_box`. above: the whole box lies above the points' horizon. Where it does not, the part
    above is that of a sphere with the same flow of light (Snyder 1996, Hill 2016).
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
    """Unit vector to a corner."""
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
def describe_blockers(casters, axes, place):
    """Rows of `box_shadow.describe_box` for the boxes that stand in for all bodies, (k, BOX)."""
    boxes = np.zeros((casters.block_places.shape[0], BOX), np.float32)
    for k in range(boxes.shape[0]):
        turn, middle, half = casters.block_turns[k], casters.block_places[k], casters.block_halves[k]
        describe_box(boxes[k], axes, place, turn, middle, half, casters.lamp)
    return boxes


@kernel
def _block_all(S, n, boxes, above):
    for i in range(n):
        S[W + i], S[NORMAL_X + i], S[NORMAL_Y + i], S[NORMAL_Z + i], S[OPEN + i] = ZERO, ZERO, ZERO, ONE, ONE
    for k in range(boxes.shape[0]):
        block(S, n, boxes[k], above)


@kernel
def surface_nodes(S, width, height, view, radius, origin, casters):
    """Openness of the surface where the rays through every PITCH-th corner of pixels meet it, with a margin; and the
    same for the middle of every column."""
    camera, turn, focal = view.camera, view.turn, view.focal
    nodes = np.ones((height // PITCH + 2, width // PITCH + 2), np.float32)
    boxes, flat = describe_blockers(casters, np.eye(3), origin), nodes.reshape(-1)
    where, n, columns = np.empty(SLOT, np.int64), 0, nodes.shape[1]
    for k in range(flat.size):
        x, y = ((k % columns) * PITCH - width * 0.5) / focal, (height * 0.5 - (k // columns) * PITCH) / focal
        drop = turn[2, 2] - turn[2, 0] * x - turn[2, 1] * y
        if drop > camera[2] / radius:
            away = camera[2] / drop
            S[U + n] = f32(camera[0] - origin[0] + away * (turn[0, 0] * x + turn[0, 1] * y - turn[0, 2]))
            S[V + n] = f32(camera[1] - origin[1] + away * (turn[1, 0] * x + turn[1, 1] * y - turn[1, 2]))
            where[n] = k
            n += 1
        if n == SLOT or (k == flat.size - 1 and n > 0):
            _block_all(S, n, boxes, True)
            for i in range(n):
                flat[where[i]] = S[OPEN + i]
            n = 0
    rows = np.empty((nodes.shape[0], width), np.float32)
    for j in range(nodes.shape[0]):
        for x in range(width):
            left, right = nodes[j, x // PITCH], nodes[j, x // PITCH + 1]
            rows[j, x] = left + (right - left) * ((f32(x % PITCH) + HALF) / f32(PITCH))
    return nodes, rows


@kernel
def open_run(S, n, rows, column, row):
    """OPEN of n pixels from `column` on in a row; rows: of `surface_nodes`."""
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


@kernel
def face_nodes(S, half_u, half_v, boxes, nodes):
    """Openness at FACE_NODES x FACE_NODES places of a rectangle |u| <= half_u, |v| <= half_v, whose normal is the third
    axis."""
    flat = nodes.reshape(-1)
    for start in range(0, flat.size, SLOT):
        n = min(SLOT, flat.size - start)
        for i in range(n):
            row, column = (start + i) // FACE_NODES, (start + i) % FACE_NODES
            S[U + i] = f32((2.0 * column / (FACE_NODES - 1) - 1) * half_u)
            S[V + i] = f32((2.0 * row / (FACE_NODES - 1) - 1) * half_v)
        _block_all(S, n, boxes, False)
        for i in range(n):
            flat[start + i] = S[OPEN + i]


@kernel
def open_face(S, n, half_u, half_v, nodes):
    """OPEN at the points U, V of a face with such nodes."""
    scale_u, scale_v = HALF * f32(FACE_NODES - 1) / half_u, HALF * f32(FACE_NODES - 1) / half_v
    for i in range(n):
        S[OPEN + i] = between(nodes, (S[U + i] + half_u) * scale_u, (S[V + i] + half_v) * scale_v)


@kernel
def faces_any(S, n, box):
    """Whether any point sees some of a box above its horizon."""
    m00, m01, m02, m10, m11, m12, m20, m21, m22 = box[0], box[1], box[2], box[3], box[4], box[5], box[6], box[7], box[8]
    highest = -ONE
    for i in range(n):
        u, v, w, p, q, r = S[U + i], S[V + i], S[W + i], S[NORMAL_X + i], S[NORMAL_Y + i], S[NORMAL_Z + i]
        a, b, c = m00 * p + m01 * q + m02 * r, m10 * p + m11 * q + m12 * r, m20 * p + m21 * q + m22 * r
        x = m00 * u + m01 * v + m02 * w + box[9]
        y = m10 * u + m11 * v + m12 * w + box[10]
        z = m20 * u + m21 * v + m22 * w + box[11]
        top = abs(a) * box[15] + abs(b) * box[16] + abs(c) * box[17] - a * x - b * y - c * z
        highest = larger(highest, top)
    return highest > ZERO
