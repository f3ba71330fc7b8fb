"""Share of the lamp that a box hides: smooth at every size of lamp and pixel."""

import math

import numpy as np

from evslip.rendering.geometry.hand import Boxes
from evslip.rendering.scratch import HALF, ONE, TWO, ZERO, f32, formula, kernel
from evslip.rendering.slots import HIDDEN, ROOM, U, V, W

TINY = f32(1e-12)
BOX = 24
"""Floats that describe a box to the passes; see `describe_boxes`."""


@formula
def disc_share(x):
    """Share of a unit disc on the inner side of a line at signed distance x; polynomial, within 0.013,
    that leaves 0 and 1 with slope 0."""
    x = min(max(x, -ONE), ONE)
    y = x * x
    return HALF + x * (f32(0.63662) + y * (f32(-0.0232) + y * f32(-0.1134)))


@formula
def fading(inside):
    """Weight that a corner still has for a point that lies `inside` half widths of a pixel's step inside the box."""
    return min(max(TWO - TWO * inside, ZERO), ONE)


@formula
def past_corner(ay, az, away, lamp_radius, lamp_distance, right, down, room):
    """Distance of the lamp at `away` past the line to a corner at (ay, az), in units of the penumbra's half width.

    The penumbra is widened by what half a pixel's steps (right, down) turn that line, so that no shadow edge is sharper
    than a pixel, or than the `room` that the pixel has left; a step along the line, as towards the foot of a
    standing box, turns nothing.
    """
    square = ay * ay + az * az
    turned = lamp_distance * (abs(right[0] * az - right[1] * ay) + abs(down[0] * az - down[1] * ay))
    return (away[0] * az - away[1] * ay) * math.sqrt(square) / (lamp_radius * square + HALF * room * turned + TINY)


@formula
def wedge(point, lamp, half, lamp_radius, lamp_distance, right, down, soft, room):
    """Share of the lamp's disc inside the wedge that the rectangle |y| <= half[0], |z| <= half[1] subtends from a
    point; all places and steps are (y, z).

    The wedge's rims are the farthest corners to either side. Corners between them count as well: it changes nothing
    for a point, but a pixel near the rectangle's edge reaches to both sides of it, and its shadow must pass on smoothly
    from one corner to the next. So must it where a point comes to lie inside, over a pixel's step but at least `soft`.
    """
    # Mirrored so that the point lies at positive y and z; then only three corners can be rims.
    hy, hz = half
    mirror_y = ONE if point[0] > ZERO else -ONE
    mirror_z = ONE if point[1] > ZERO else -ONE
    right, down = (right[0] * mirror_y, right[1] * mirror_z), (down[0] * mirror_y, down[1] * mirror_z)
    py, pz = abs(point[0]), abs(point[1])
    away = lamp[0] * mirror_y - py, lamp[1] * mirror_z - pz
    near_y, near_z = hy - py, hz - pz
    first = past_corner(near_y, -hz - pz, away, lamp_radius, lamp_distance, right, down, room)
    middle = past_corner(near_y, near_z, away, lamp_radius, lamp_distance, right, down, room)
    last = past_corner(-hy - py, near_z, away, lamp_radius, lamp_distance, right, down, room)
    inside_y = near_y / max(abs(right[0]) + abs(down[0]), soft)
    inside_z = near_z / max(abs(right[1]) + abs(down[1]), soft)
    # From within, a farther corner is no rim; and which of two it would be changes where the point is mirrored.
    before = max(disc_share(first) * fading(inside_y), disc_share(middle))
    behind = max(disc_share(-last) * fading(inside_z), disc_share(-middle))
    between = before + behind - ONE
    return max(max(ZERO, between), disc_share(TWO * min(inside_y, inside_z)))


@kernel
def hide(S, n, box, lamp_radius):
    """HIDDEN = share of the lamp that a box hides from the points U, V, W.

    box (BOX,): see `describe_boxes`. The box's silhouette is the intersection of its three wedges; their shares are
    multiplied.
    """
    m00, m01, m02, m10, m11, m12, m20, m21, m22 = box[0], box[1], box[2], box[3], box[4], box[5], box[6], box[7], box[8]
    o0, o1, o2, l0, l1, l2, h0, h1, h2 = box[9], box[10], box[11], box[12], box[13], box[14], box[15], box[16], box[17]
    r0, r1, r2, d0, d1, d2 = box[18], box[19], box[20], box[21], box[22], box[23]
    far0, far1, far2 = math.sqrt(l1 * l1 + l2 * l2), math.sqrt(l2 * l2 + l0 * l0), math.sqrt(l0 * l0 + l1 * l1)
    soft = math.sqrt(r0 * r0 + r1 * r1 + r2 * r2 + d0 * d0 + d1 * d1 + d2 * d2) * f32(0.25) + TINY
    for i in range(n):
        u, v, w, room = S[U + i], S[V + i], S[W + i], S[ROOM + i]
        x = o0 + m00 * u + m01 * v + m02 * w
        y = o1 + m10 * u + m11 * v + m12 * w
        z = o2 + m20 * u + m21 * v + m22 * w
        hidden = wedge((y, z), (l1, l2), (h1, h2), lamp_radius, far0, (r1, r2), (d1, d2), soft, room)
        hidden *= wedge((z, x), (l2, l0), (h2, h0), lamp_radius, far1, (r2, r0), (d2, d0), soft, room)
        hidden *= wedge((x, y), (l0, l1), (h0, h1), lamp_radius, far2, (r0, r1), (d0, d1), soft, room)
        S[HIDDEN + i] = hidden


def describe_boxes(boxes: Boxes, lamp: np.ndarray) -> np.ndarray:
    """Boxes as the passes take them, float32 (k, BOX): turn (9) and move (3) into each one's frame, the lamp's centre
    there (3), half sides (3), and room for `pixel_steps` (6)."""
    rows, turns = np.zeros((len(boxes.places), BOX), np.float32), boxes.turns.transpose(0, 2, 1)
    rows[:, :9], rows[:, 15:18] = turns.reshape(-1, 9), boxes.halves
    rows[:, 9:12] = -np.squeeze(turns @ boxes.places[..., None], -1)
    rows[:, 12:15] = np.squeeze(turns @ (lamp - boxes.places)[..., None], -1)
    return rows


@kernel
def pixel_steps(box, steps):
    """Set a receiver point's steps from one pixel to the next in the box's frame; steps (2, 3): right and down. No
    longer than the mean half side of the box: a shadow much smaller than its pixel, as close to the horizon, is nothing
    to be spread."""
    longest = (box[15] + box[16] + box[17]) / 3
    for m in range(2):
        step = steps[m]
        length = math.sqrt(step[0] ** 2 + step[1] ** 2 + step[2] ** 2)
        scale = min(1.0, longest / (length + 1e-12))
        for k in range(3):
            along = box[3 * k] * step[0] + box[3 * k + 1] * step[1] + box[3 * k + 2] * step[2]
            box[18 + 3 * m + k] = f32(scale * along)


@formula
def extent(turn, k, reach, du, dv, dw):
    """Reach of receivers along an axis of another frame: the box around them, or the sphere. turn: from their
    frame to that one, by rows."""
    return min(reach, abs(turn[3 * k]) * du + abs(turn[3 * k + 1]) * dv + abs(turn[3 * k + 2]) * dw)


@kernel
def box_may_shadow(near, box, lamp_radius):
    """Whether a box may touch the cone from the lamp to receivers. near: what is around these, as of `casters.around`;
    box: of `describe_boxes`."""
    u, v, w, reach, du, dv, dw = near
    start = (
        box[0] * u + box[1] * v + box[2] * w + box[9],
        box[3] * u + box[4] * v + box[5] * w + box[10],
        box[6] * u + box[7] * v + box[8] * w + box[11],
    )
    lamp, half = (box[12], box[13], box[14]), (box[15], box[16], box[17])
    size, away, length = 0.0, 0.0, 0.0
    for k in range(3):
        size += half[k] ** 2
        away += start[k] ** 2
        length += (lamp[k] - start[k]) ** 2
    # The cone from lamp to receiver, widened everywhere to its width at the far end of the box.
    cone = lamp_radius * min(1.0, math.sqrt(away / length) + math.sqrt(size / length))
    first, last = 0.0, 1.0
    for k in range(3):
        margin = cone + extent(box, k, reach, du, dv, dw) + abs(box[18 + k]) + abs(box[21 + k])  # and a pixel's blur
        step = lamp[k] - start[k]
        step = step if abs(step) > 1e-9 else 1e-9
        a, b = (-half[k] - margin - start[k]) / step, (half[k] + margin - start[k]) / step
        first, last = max(first, min(a, b)), min(last, max(a, b))
    return first <= last
