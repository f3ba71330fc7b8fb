"""How much of the lamp a box hides: smooth at every size of lamp and pixel."""

import math

import numpy as np

from evslip.render.lanes import HALF, ONE, SEEN, SEEN_NOW, ZERO, U, V, W, f32, kernel

TINY = f32(1e-9)


@kernel
def disc_share(x):
    """Share of a unit disc on the inner side of a line at signed distance x; polynomial, within 0.013,
    that leaves 0 and 1 with slope 0."""
    x = min(max(x, -ONE), ONE)
    y = x * x
    return HALF + x * (f32(0.63662) + y * (f32(-0.0232) + y * f32(-0.1134)))


@kernel
def risen(height):
    """Mean of max(0, height + y) over a unit disc in y, for height in [-1, 1]: the cosine of a lamp that is cut by the
    receiver's horizon, in units of its angular radius. Fit to the integral within 0.002; 0 at -1 and `height` at 1.
    """
    y = height * height
    return HALF * height + f32(0.2122066) + y * (f32(0.3255868) - y * f32(0.0377934))


@kernel
def wedge(py, pz, ly, lz, hy, hz, lamp_radius, blur):
    """Share of the lamp's disc inside the wedge that the rectangle |y| <= hy, |z| <= hz subtends from (py, pz).

    The two tangent lines cut the disc; `blur` widens their penumbrae to the pixel's own width, in the units of the
    cross products below, so that no shadow edge is sharper than a pixel.
    """
    # Mirrored so that the point lies at positive y and z; then the corners seen at the rims are always the same two.
    ly = ly if py > ZERO else -ly
    lz = lz if pz > ZERO else -lz
    py, pz = abs(py), abs(pz)
    beside_y = py > hy
    beside_z = pz > hz
    ay = hy - py
    az = (-hz if beside_y else hz) - pz
    by = (-hy if beside_z else hy) - py
    bz = hz - pz
    dy = ly - py
    dz = lz - pz
    first = (dy * az - dz * ay) / (lamp_radius * math.sqrt(ay * ay + az * az) + blur)
    second = (by * dz - bz * dy) / (lamp_radius * math.sqrt(by * by + bz * bz) + blur)
    share = max(ZERO, disc_share(first) + disc_share(second) - ONE)
    return share if (beside_y or beside_z) else ONE


@kernel
def hide(S, n, turn, move, lamp, half, lamp_radius, blur):
    """SEEN_NOW = min(SEEN_NOW, share of the lamp that a box leaves visible from the points U, V, W).

    turn (3, 3), move (3,): receiver frame -> box frame; lamp (3,): its centre in the box frame; half (3,): the box;
    blur (3,): as in `wedge`, for the projections along x, y, z. The box's silhouette is the intersection of its three
    wedges; their shares are multiplied.
    """
    m00, m01, m02 = turn[0, 0], turn[0, 1], turn[0, 2]
    m10, m11, m12 = turn[1, 0], turn[1, 1], turn[1, 2]
    m20, m21, m22 = turn[2, 0], turn[2, 1], turn[2, 2]
    o0, o1, o2 = move[0], move[1], move[2]
    l0, l1, l2 = lamp[0], lamp[1], lamp[2]
    h0, h1, h2 = half[0], half[1], half[2]
    k0, k1, k2 = blur[0] + TINY, blur[1] + TINY, blur[2] + TINY
    for i in range(n):
        u, v, w = S[U + i], S[V + i], S[W + i]
        x = o0 + m00 * u + m01 * v + m02 * w
        y = o1 + m10 * u + m11 * v + m12 * w
        z = o2 + m20 * u + m21 * v + m22 * w
        hidden = wedge(y, z, l1, l2, h1, h2, lamp_radius, k0)
        hidden *= wedge(z, x, l2, l0, h2, h0, lamp_radius, k1)
        hidden *= wedge(x, y, l0, l1, h0, h1, lamp_radius, k2)
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
def pixel_blur(turn, lamp, right, down, blur):
    """blur (3,) for `wedge`: half of what one pixel's steps on the receiver change in its cross products.

    right, down (3,): the receiver point's movement by one pixel, in the receiver frame.
    """
    for k in range(3):
        blur[k] = ZERO
    for step in (right, down):
        x = turn[0, 0] * step[0] + turn[0, 1] * step[1] + turn[0, 2] * step[2]
        y = turn[1, 0] * step[0] + turn[1, 1] * step[1] + turn[1, 2] * step[2]
        z = turn[2, 0] * step[0] + turn[2, 1] * step[1] + turn[2, 2] * step[2]
        blur[0] += HALF * abs(lamp[2] * y - lamp[1] * z)
        blur[1] += HALF * abs(lamp[0] * z - lamp[2] * x)
        blur[2] += HALF * abs(lamp[1] * x - lamp[0] * y)


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
def place_lamp(caster_turns, caster_places, lamp, lamps):
    """lamps (k, 3): the lamp's centre in every caster's frame."""
    for k in range(caster_places.shape[0]):
        for j in range(3):
            total = 0.0
            for i in range(3):
                total += caster_turns[k, i, j] * (lamp[i] - caster_places[k, i])
            lamps[k, j] = f32(total)


def casters(
    camera_position: np.ndarray,
    camera_rotation: np.ndarray,
    object_position: np.ndarray,
    object_rotation: np.ndarray,
    part_turns: np.ndarray,
    part_places: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """World frames of all casters, the object first, then the gripper's parts, which are given in camera axes."""
    turns = np.concatenate([object_rotation[None], camera_rotation @ part_turns])
    places = np.concatenate([object_position[None], camera_position + part_places @ camera_rotation.T])
    return np.ascontiguousarray(turns), np.ascontiguousarray(places)
