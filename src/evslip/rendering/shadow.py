"""How much of the lamp a box hides: smooth at every size of lamp and pixel."""

import math

import numpy as np

from evslip.rendering.lanes import HALF, ONE, ROOM, SEEN, SEEN_NOW, TWO, ZERO, U, V, W, f32, formula, kernel

TINY = f32(1e-12)


@formula
def disc_share(x):
    """Share of a unit disc on the inner side of a line at signed distance x; polynomial, within 0.013,
    that leaves 0 and 1 with slope 0."""
    x = min(max(x, -ONE), ONE)
    y = x * x
    return HALF + x * (f32(0.63662) + y * (f32(-0.0232) + y * f32(-0.1134)))


@formula
def risen(height):
    """Mean of max(0, height + y) over a unit disc in y, for height in [-1, 1]: the cosine of a lamp that is cut by the
    receiver's horizon, in units of its angular radius. Fit to the integral within 0.002; 0 at -1 and `height` at 1.
    """
    y = height * height
    return HALF * height + f32(0.2122066) + y * (f32(0.3255868) - y * f32(0.0377934))


@formula
def past_corner(ay, az, dy, dz, lamp_radius, lamp_distance, right_y, right_z, down_y, down_z, room):
    """How far the lamp at (dy, dz) stands past the line to a corner at (ay, az), in units of the penumbra's half width.

    The penumbra is widened by what half a pixel's steps (right, down) turn that line, so that no shadow edge is sharper
    than a pixel, or than the `room` that the pixel has left; a step along the line, as towards the foot of a
    standing box, turns nothing.
    """
    square = ay * ay + az * az
    turned = lamp_distance * (abs(right_y * az - right_z * ay) + abs(down_y * az - down_z * ay))
    return (dy * az - dz * ay) * math.sqrt(square) / (lamp_radius * square + HALF * room * turned + TINY)


@formula
def wedge(py, pz, ly, lz, hy, hz, lamp_radius, lamp_distance, right_y, right_z, down_y, down_z, soft, room):
    """Share of the lamp's disc inside the wedge that the rectangle |y| <= hy, |z| <= hz subtends from (py, pz).

    The wedge's rims are the farthest corners to either side. Corners between them count as well: it changes nothing
    for a point, but a pixel near the rectangle's edge reaches to both sides of it, and its shadow must pass on smoothly
    from one corner to the next. So must it where a point comes to lie inside, over a pixel's step but at least `soft`.
    """
    # Mirrored so that the point lies at positive y and z; then only three corners can be rims.
    mirror_y = ONE if py > ZERO else -ONE
    mirror_z = ONE if pz > ZERO else -ONE
    right_y, down_y = right_y * mirror_y, down_y * mirror_y
    right_z, down_z = right_z * mirror_z, down_z * mirror_z
    py, pz = abs(py), abs(pz)
    dy, dz = ly * mirror_y - py, lz * mirror_z - pz
    near_y, near_z = hy - py, hz - pz
    first = past_corner(near_y, -hz - pz, dy, dz, lamp_radius, lamp_distance, right_y, right_z, down_y, down_z, room)
    middle = past_corner(near_y, near_z, dy, dz, lamp_radius, lamp_distance, right_y, right_z, down_y, down_z, room)
    last = past_corner(-hy - py, near_z, dy, dz, lamp_radius, lamp_distance, right_y, right_z, down_y, down_z, room)
    between = disc_share(max(first, middle)) + disc_share(max(-last, -middle)) - ONE
    inside_y = near_y / (abs(right_y) + abs(down_y) + soft)
    inside_z = near_z / (abs(right_z) + abs(down_z) + soft)
    return max(max(ZERO, between), disc_share(TWO * min(inside_y, inside_z)))


@kernel
def hide(S, n, turn, move, lamp, half, lamp_radius, steps):
    """SEEN_NOW = min(SEEN_NOW, share of the lamp that a box leaves visible from the points U, V, W).

    turn (3, 3), move (3,): receiver frame -> box frame; lamp (3,): its centre in the box frame; half (3,): the box;
    steps (2, 3): of `pixel_steps`. The box's silhouette is the intersection of its three wedges; their shares are
    multiplied.
    """
    m00, m01, m02 = turn[0, 0], turn[0, 1], turn[0, 2]
    m10, m11, m12 = turn[1, 0], turn[1, 1], turn[1, 2]
    m20, m21, m22 = turn[2, 0], turn[2, 1], turn[2, 2]
    o0, o1, o2 = move[0], move[1], move[2]
    l0, l1, l2 = lamp[0], lamp[1], lamp[2]
    h0, h1, h2 = half[0], half[1], half[2]
    r0, r1, r2 = steps[0, 0], steps[0, 1], steps[0, 2]
    d0, d1, d2 = steps[1, 0], steps[1, 1], steps[1, 2]
    far0, far1, far2 = math.sqrt(l1 * l1 + l2 * l2), math.sqrt(l2 * l2 + l0 * l0), math.sqrt(l0 * l0 + l1 * l1)
    soft = math.sqrt(r0 * r0 + r1 * r1 + r2 * r2 + d0 * d0 + d1 * d1 + d2 * d2) * f32(0.25) + TINY
    for i in range(n):
        u, v, w, room = S[U + i], S[V + i], S[W + i], S[ROOM + i]
        x = o0 + m00 * u + m01 * v + m02 * w
        y = o1 + m10 * u + m11 * v + m12 * w
        z = o2 + m20 * u + m21 * v + m22 * w
        hidden = wedge(y, z, l1, l2, h1, h2, lamp_radius, far0, r1, r2, d1, d2, soft, room)
        hidden *= wedge(z, x, l2, l0, h2, h0, lamp_radius, far1, r2, r0, d2, d0, soft, room)
        hidden *= wedge(x, y, l0, l1, h0, h1, lamp_radius, far2, r0, r1, d0, d1, soft, room)
        S[SEEN_NOW + i] = min(S[SEEN_NOW + i], ONE - hidden)


@kernel
def begin_group(S, n):
    for i in range(n):
        S[SEEN_NOW + i] = ONE


@kernel
def end_group(S, n):
    for i in range(n):
        S[SEEN + i] *= S[SEEN_NOW + i]


@kernel
def pixel_steps(turn, right, down, half, steps):
    """steps (2, 3): how a receiver point moves, in the box frame, from one pixel to the next; right, down (3,): the
    same in the receiver frame. No longer than the mean half side of the box: a shadow much smaller than its pixel, as
    close to the horizon, is nothing to be spread."""
    longest = (half[0] + half[1] + half[2]) / 3
    for m in range(2):
        step = right if m == 0 else down
        length = math.sqrt(step[0] ** 2 + step[1] ** 2 + step[2] ** 2)
        scale = min(1.0, longest / (length + 1e-12))
        for k in range(3):
            steps[m, k] = f32(scale * (turn[k, 0] * step[0] + turn[k, 1] * step[1] + turn[k, 2] * step[2]))


@kernel
def change_frame(from_turn, from_place, to_turn, to_place, turn, move):
    """turn (3, 3), move (3,): coordinates in one frame -> in another; columns of a frame's turn are its axes."""
    for i in range(3):
        total = 0.0
        for j in range(3):
            total += to_turn[j, i] * (from_place[j] - to_place[j])
        move[i] = f32(total)
        for k in range(3):
            total = 0.0
            for j in range(3):
                total += to_turn[j, i] * from_turn[j, k]
            turn[i, k] = f32(total)


@kernel
def may_shadow(receiver, receiver_radius, caster, caster_radius, lamp, lamp_radius):
    """Whether a caster's bounding sphere touches the cone from the lamp to a receiver's bounding sphere."""
    along = 0.0
    length = 0.0
    for k in range(3):
        length += (lamp[k] - receiver[k]) ** 2
        along += (lamp[k] - receiver[k]) * (caster[k] - receiver[k])
    share = min(1.0, max(0.0, along / length))
    gap = 0.0
    for k in range(3):
        gap += (receiver[k] + share * (lamp[k] - receiver[k]) - caster[k]) ** 2
    return math.sqrt(gap) < caster_radius + receiver_radius * (1 - share) + lamp_radius * share


@kernel
def box_may_shadow(u, v, w, reach, turn, move, half, lamp, lamp_radius):
    """As `may_shadow`, for the box itself and so with fewer false alarms. u, v, w, reach: sphere around the receiver in
    its frame; turn, move, half, lamp: as in `hide`."""
    start = (
        turn[0, 0] * u + turn[0, 1] * v + turn[0, 2] * w + move[0],
        turn[1, 0] * u + turn[1, 1] * v + turn[1, 2] * w + move[1],
        turn[2, 0] * u + turn[2, 1] * v + turn[2, 2] * w + move[2],
    )
    size, away, length = 0.0, 0.0, 0.0
    for k in range(3):
        size += half[k] ** 2
        away += start[k] ** 2
        length += (lamp[k] - start[k]) ** 2
    # The cone from lamp to receiver, widened everywhere to its width at the far end of the box.
    margin = reach + lamp_radius * min(1.0, math.sqrt(away / length) + math.sqrt(size / length))
    first, last = 0.0, 1.0
    for k in range(3):
        step = lamp[k] - start[k]
        step = step if abs(step) > 1e-9 else 1e-9
        a, b = (-half[k] - margin - start[k]) / step, (half[k] + margin - start[k]) / step
        first, last = max(first, min(a, b)), min(last, max(a, b))
    return first <= last


@kernel
def place_lamp(caster_turns, caster_places, lamp, lamps):
    """lamps (k, 3): the lamp's centre in every caster's frame."""
    for k in range(caster_places.shape[0]):
        for j in range(3):
            total = 0.0
            for i in range(3):
                total += caster_turns[k, i, j] * (lamp[i] - caster_places[k, i])
            lamps[k, j] = f32(total)


def casters(
    camera_position: np.ndarray, camera_rotation: np.ndarray, part_turns: np.ndarray, part_places: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """World frames of the gripper's parts, which are given in camera axes."""
    turns, places = camera_rotation @ part_turns, camera_position + part_places @ camera_rotation.T
    return np.ascontiguousarray(turns), np.ascontiguousarray(places)
