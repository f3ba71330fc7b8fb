"""Light on a surface, of every body: what arrives from the lamp, and the one place where all light is summed."""

import math

from evslip.rendering.scratch import HALF, ONE, ZERO, f32, formula, kernel
from evslip.rendering.slots import GLOSS, GROUND, LIT, OPEN, RESULT, SEEN, TEX, U, V


@formula
def luminance(albedo, around, opening, lamp, seen, mirrored):
    """Luminance that a point sends to the camera.

    around: light from all around, as luminance of white, of which the share `opening` arrives; lamp: that of the lamp,
    of which no shadow takes the share `seen`; mirrored: the lamp's highlight, in the same shadow.
    """
    return albedo * (around * opening + lamp * seen) + mirrored * seen


@formula
def from_lamp(power, lamp_radius, towards, normal, view):
    """Luminance of white matt paint under the lamp, and share of the highlight, where nothing stands between.

    towards: from the point to the lamp's centre; normal, view: unit vectors, the latter to the camera; three each.
    """
    d0, d1, d2 = towards
    n0, n1, n2 = normal
    near = ONE / math.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
    lit = matt(power, near, (n0 * d0 + n1 * d1 + n2 * d2) * near, lamp_radius)
    h0, h1, h2 = d0 * near + view[0], d1 * near + view[1], d2 * near + view[2]
    shine = max(ZERO, n0 * h0 + n1 * h1 + n2 * h2)
    return lit, highlight(shine * shine / (h0 * h0 + h1 * h1 + h2 * h2 + f32(1e-9)))


@formula
def risen(height):
    """Mean of max(0, height + y) over a unit disc in y, for height in [-1, 1]: the cosine of a lamp that is cut by the
    receiver's horizon, in units of its angular radius. Fit to the integral within 0.002; 0 at -1 and `height` at 1.
    """
    y = height * height
    return HALF * height + f32(0.2122066) + y * (f32(0.3255868) - y * f32(0.0377934))


@formula
def matt(power, near, cosine, lamp_radius):
    """Luminance of white matt paint under a lamp that is a sphere, cut by the receiver's horizon.

    power: luminance x radius^2 of the lamp; near: 1 / way to its centre; cosine: of the angle at which that stands.
    """
    size = lamp_radius * near
    rise = min(max(cosine / size, -ONE), ONE)
    return power * near * near * (size * risen(rise) + max(cosine - size, ZERO))


@formula
def highlight(shine):
    """The highlight's share, of the square of the cosine of the half-way vector (Blinn-Phong, exponent 32)."""
    shine *= shine
    shine *= shine
    shine *= shine
    shine *= shine
    return shine


@kernel
def light_plane(S, n, plane, power, lamp_radius):
    """LIT, the luminance of a white matt surface, at the points U, V of a plane; GLOSS = 0, SEEN = 1.

    power: luminance x radius^2 of the lamp.
    """
    lamp_u, lamp_v, lamp_n = plane[12], plane[13], plane[14]
    for i in range(n):
        to_u, to_v = lamp_u - S[U + i], lamp_v - S[V + i]
        near = ONE / math.sqrt(to_u * to_u + to_v * to_v + lamp_n * lamp_n)
        S[LIT + i], S[SEEN + i], S[GLOSS + i] = matt(power, near, lamp_n * near, lamp_radius), ONE, ZERO


@kernel
def polish(S, n, plane, gloss):
    """GLOSS = a highlight of the strength `gloss`, which no texture filters (Blinn-Phong, exponent 32)."""
    height, camera_u, camera_v = plane[9], plane[10], plane[11]
    lamp_u, lamp_v, lamp_n = plane[12], plane[13], plane[14]
    for i in range(n):
        u, v = S[U + i], S[V + i]
        to_u, to_v = lamp_u - u, lamp_v - v
        near = ONE / math.sqrt(to_u * to_u + to_v * to_v + lamp_n * lamp_n)
        back_u, back_v = camera_u - u, camera_v - v
        inverse = ONE / math.sqrt(back_u * back_u + back_v * back_v + height * height)
        half_way_u, half_way_v = to_u * near + back_u * inverse, to_v * near + back_v * inverse
        half_way_n = lamp_n * near - height * inverse
        shine = half_way_u * half_way_u + half_way_v * half_way_v + half_way_n * half_way_n + f32(1e-9)
        shine = highlight(half_way_n * half_way_n / shine)
        S[GLOSS + i] = gloss * shine * S[LIT + i]


@kernel
def reflect(S, n, ambient):
    """RESULT = what the surface sends to the camera."""
    for i in range(n):
        S[RESULT + i] = luminance(S[TEX + i], ambient, S[OPEN + i], S[LIT + i], S[SEEN + i], S[GLOSS + i])


@kernel
def reflect_below_horizon(S, n, ambient):
    """RESULT as of `reflect`, over what RESULT holds already, in the GROUND share of each pixel."""
    for i in range(n):
        own = luminance(S[TEX + i], ambient, S[OPEN + i], S[LIT + i], S[SEEN + i], S[GLOSS + i])
        share = min(ONE, max(ZERO, S[GROUND + i]))
        S[RESULT + i] += share * (own - S[RESULT + i])
