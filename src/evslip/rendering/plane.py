"""Where rays meet a plane, how large a pixel is there, and what the lamp gives without shadows."""

import math

from evslip.rendering.lanes import (
    GLOSS,
    GROUND,
    HALF,
    LIT,
    MAJOR_U,
    MAJOR_V,
    MINOR_U,
    MINOR_V,
    ONE,
    OPEN,
    RAY_X,
    RAY_Y,
    RESULT,
    SEEN,
    TEX,
    TEXELS,
    ZERO,
    U,
    V,
    W,
    f32,
    kernel,
)  # fmt: skip
from evslip.rendering.shadow import risen

PLANE = 15
"""Floats that describe a plane to the passes; see `describe`."""
GRAZING = f32(-1e-5)


@kernel
def describe(plane, origin, u_axis, v_axis, normal, turn, camera, lamp):
    """plane (15,): the normal and both axes in camera axes (9), the height of the origin over the camera along the
    normal (1), the camera in the plane's u, v (2), the lamp in its u, v, normal (3)."""
    for k in range(3):
        plane[k], plane[3 + k], plane[6 + k] = 0.0, 0.0, 0.0
        for j in range(3):
            plane[k] += turn[j, k] * normal[j]
            plane[3 + k] += turn[j, k] * u_axis[j]
            plane[6 + k] += turn[j, k] * v_axis[j]
    for k in range(9, 15):
        plane[k] = 0.0
    for j in range(3):
        plane[9] += normal[j] * (origin[j] - camera[j])
        plane[10] += u_axis[j] * (camera[j] - origin[j])
        plane[11] += v_axis[j] * (camera[j] - origin[j])
        plane[12] += u_axis[j] * (lamp[j] - origin[j])
        plane[13] += v_axis[j] * (lamp[j] - origin[j])
        plane[14] += normal[j] * (lamp[j] - origin[j])


@kernel
def meet_plane(S, n, plane, pixel, power, lamp_radius, gloss, texels_per_m, along, across, half_u, half_v):
    """U, V, footprint, LIT and GLOSS at the points where the rays meet a plane.

    pixel: width of a pixel at unit distance; power: luminance x radius^2 of the lamp; gloss: strength of the highlight.
    LIT is the luminance of a white matt surface, GLOSS is added to it unfiltered by the texture (Blinn-Phong, exponent
    32). The footprint of along x across probes stays within |u| <= half_u, |v| <= half_v: a thin face takes its mean.
    """
    n0, n1, n2 = plane[0], plane[1], plane[2]
    u0, u1, u2 = plane[3], plane[4], plane[5]
    v0, v1, v2 = plane[6], plane[7], plane[8]
    height, camera_u, camera_v = plane[9], plane[10], plane[11]
    lamp_u, lamp_v, lamp_n = plane[12], plane[13], plane[14]
    per_along, per_across, reach = ONE / f32(along), ONE / f32(across), HALF * f32(along)
    for i in range(n):
        x, y = S[RAY_X + i], S[RAY_Y + i]
        facing = min(n0 * x + n1 * y - n2, GRAZING)
        ray_u = u0 * x + u1 * y - u2
        ray_v = v0 * x + v1 * y - v2
        distance = height / facing
        sideways = ray_u * ray_u + ray_v * ray_v
        inverse = ONE / math.sqrt(sideways + facing * facing)
        width = distance * pixel
        length = -width / (facing * inverse) * per_along
        scale = length / math.sqrt(sideways + f32(1e-12))
        major_u, major_v = scale * ray_u, scale * ray_v
        room_u = max(half_u - reach * abs(major_u) - HALF * width, ZERO)
        room_v = max(half_v - reach * abs(major_v) - HALF * width, ZERO)
        u = min(max(camera_u + distance * ray_u, -room_u), room_u)
        v = min(max(camera_v + distance * ray_v, -room_v), room_v)
        S[U + i], S[V + i], S[W + i] = u, v, ZERO
        minor = width * per_across / length
        S[MAJOR_U + i], S[MAJOR_V + i] = major_u, major_v
        S[MINOR_U + i], S[MINOR_V + i] = -minor * major_v, minor * major_u
        S[TEXELS + i] = max(width * per_across, length) * texels_per_m
        S[SEEN + i] = ONE
        to_u, to_v = lamp_u - u, lamp_v - v
        near = ONE / math.sqrt(to_u * to_u + to_v * to_v + lamp_n * lamp_n)
        size = lamp_radius * near
        cosine = lamp_n * near
        rise = min(max(cosine / size, -ONE), ONE)
        lit = power * near * near * (size * risen(rise) + max(cosine - size, ZERO))
        half_way_u, half_way_v = to_u * near - ray_u * inverse, to_v * near - ray_v * inverse
        half_way_n = cosine - facing * inverse
        shine = half_way_u * half_way_u + half_way_v * half_way_v + half_way_n * half_way_n + f32(1e-9)
        shine = half_way_n * half_way_n / shine
        shine *= shine
        shine *= shine
        shine *= shine
        shine *= shine
        S[LIT + i] = lit
        S[GLOSS + i] = gloss * shine * lit


@kernel
def reflect(S, n, ambient):
    """RESULT = what the surface sends to the camera."""
    for i in range(n):
        S[RESULT + i] = S[TEX + i] * (ambient * S[OPEN + i] + S[LIT + i] * S[SEEN + i]) + S[GLOSS + i] * S[SEEN + i]


@kernel
def reflect_below_horizon(S, n, ambient):
    """As `reflect`, over what RESULT holds already, in the GROUND share of each pixel."""
    for i in range(n):
        own = S[TEX + i] * (ambient * S[OPEN + i] + S[LIT + i] * S[SEEN + i]) + S[GLOSS + i] * S[SEEN + i]
        share = min(ONE, max(ZERO, S[GROUND + i]))
        S[RESULT + i] += share * (own - S[RESULT + i])
