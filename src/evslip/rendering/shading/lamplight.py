"""What a point of a surface makes of the lamp's light, where nothing stands between."""

from evslip.rendering.scratch import HALF, ONE, ZERO, f32, formula


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
