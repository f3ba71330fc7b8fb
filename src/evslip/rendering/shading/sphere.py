"""The background: a luminous textured sphere around the scene, and the lamp where it is in view."""

import math

from evslip.rendering.materials.texels import floor32
from evslip.rendering.scratch import HALF, ONE, ZERO, f32, formula, kernel
from evslip.rendering.slots import GROUND, HELD, MAJOR_U, MAJOR_V, MINOR_U, MINOR_V, RAY_X, RAY_Y, RESULT, U, V, W

INVERSE_TURN = f32(0.15915494)


@formula
def arctangent(y, x):
    """atan2 within 2e-6; the compiler has no vector version of the library's."""
    ax, ay = abs(x), abs(y)
    z = min(ax, ay) / (max(ax, ay) + f32(1e-20))
    s = z * z
    r = f32(0.05265332) - s * f32(0.01172120)
    r = f32(0.19354346) + s * (f32(-0.11643287) + s * r)
    r = z * (f32(0.99997726) + s * (f32(-0.33262347) + s * r))
    r = f32(1.5707964) - r if ay > ax else r
    r = f32(3.1415927) - r if x < ZERO else r
    return -r if y < ZERO else r


@kernel
def meet_sphere(S, n, turn, camera, radius, pixel):
    """U, V, W = the point on the sphere about the world's origin; GROUND = the pixel's share below its horizon, not yet
    limited to [0, 1]: the surface z = 0 ends where it meets the sphere."""
    c0, c1, c2 = camera[0], camera[1], camera[2]
    inside = c0 * c0 + c1 * c1 + c2 * c2 - radius * radius
    per_pixel = ONE / (pixel * math.sqrt(turn[2, 0] * turn[2, 0] + turn[2, 1] * turn[2, 1]) + f32(1e-9))
    for i in range(n):
        x, y = S[RAY_X + i], S[RAY_Y + i]
        d0 = turn[0, 0] * x + turn[0, 1] * y - turn[0, 2]
        d1 = turn[1, 0] * x + turn[1, 1] * y - turn[1, 2]
        d2 = turn[2, 0] * x + turn[2, 1] * y - turn[2, 2]
        a = d0 * d0 + d1 * d1 + d2 * d2
        b = c0 * d0 + c1 * d1 + c2 * d2
        distance = (math.sqrt(b * b - a * inside) - b) / a
        z = c2 + distance * d2
        S[U + i], S[V + i], S[W + i] = c0 + distance * d0, c1 + distance * d1, z
        S[HELD + i] = distance
        S[GROUND + i] = HALF - z * per_pixel / distance


@kernel
def unroll(S, n, repetitions, radius, pixel, aspect, horizon):
    """U, V = azimuth and elevation in repetitions of the texture, MAJOR and MINOR = a pixel's footprint along them.

    aspect: the texture's width over its height; horizon: where the horizon is in it.
    """
    scale = repetitions * INVERSE_TURN
    for i in range(n):
        x, y, z = S[U + i], S[V + i], S[W + i]
        across = math.sqrt(x * x + y * y) + f32(1e-6)
        u, v = arctangent(y, x) * scale, horizon - arctangent(z, across) * scale * aspect
        S[U + i], S[V + i] = u - floor32(u), v - floor32(v)
        width = S[HELD + i] * pixel * scale
        S[MAJOR_U + i], S[MAJOR_V + i] = min(width / across, HALF), ZERO
        S[MINOR_U + i], S[MINOR_V + i] = ZERO, width * aspect / radius


@kernel
def draw_lamp(S, n, towards, angular_radius, pixel, luminance):
    """The lamp's disc over RESULT; towards (3,): unit vector to it in camera axes. Its edge is one pixel wide. A disc
    that is smaller than a pixel is drawn as wide as one, and dimmer by as much as that is larger."""
    for i in range(n):
        x, y = S[RAY_X + i], S[RAY_Y + i]
        inverse = ONE / math.sqrt(x * x + y * y + ONE)
        p = towards[1] * -inverse - towards[2] * y * inverse
        q = towards[2] * x * inverse + towards[0] * inverse
        r = towards[0] * y * inverse - towards[1] * x * inverse
        ahead = towards[0] * x + towards[1] * y - towards[2]
        gap = math.sqrt(p * p + q * q + r * r) if ahead > ZERO else ONE
        half = HALF * pixel * inverse
        small = min(ONE, angular_radius / half)
        share = min(ONE, max(ZERO, (max(angular_radius, half) - gap) / (pixel * inverse) + HALF))
        S[RESULT + i] += share * small * small * (luminance - S[RESULT + i])
