"""Moulded, ribbed, woven-carbon, bubble and studded plastic, leather, foam, film."""

import numpy as np

from evslip.scene.textures.canvas import U, V, fraction, mix, over, ramp, relief, rgb, soften, step, times, wave, whole
from evslip.scene.textures.lettering import write
from evslip.scene.textures.noise import cells, fractal
from evslip.scene.textures.printing import number as digits


def _handled(rng: np.random.Generator) -> np.ndarray:
    """Gloss that varies, dust, fine scratches: about 1."""
    smear = fractal(rng, 2, 4, 7, 0.75)
    dust = step(0.74, 0.85, fractal(rng, 128, 128, 3, 0.9))
    return 0.55 + 0.9 * smear + 0.25 * dust


def _grained(rng: np.random.Generator) -> np.ndarray:
    """The leathery grain of dashboards."""
    near, second, tone = cells(rng, 48, jitter=0.95, du=0.01 * (fractal(rng, 16, 16, 4, 0.7) - 0.5))
    bump = step(0.0, 0.4, second - near)
    share = 0.25 * bump + 0.2 * tone + 0.9 * fractal(rng, 2, 2, 6, 0.6) - 0.2
    return times(mix((0.05, 0.05, 0.055), (0.19, 0.19, 0.20), share), relief(bump, 0.5) * _handled(rng))


def _ribbed(rng: np.random.Generator) -> np.ndarray:
    """A crate's side: ribs, grip slots, a moulded recess."""
    ribs = step(0.5, 0.72, wave(U * 16))
    slot = step(0.0, 0.01, 0.09 - np.abs(U - 0.5)) * step(0.0, 0.01, 0.03 - np.abs(V - 0.14))
    recess = step(0.0, 0.012, 0.36 - np.abs(U - 0.5)) * step(0.0, 0.012, 0.12 - np.abs(V - 0.62))
    height = ribs * (1 - recess) + 0.9 * recess
    image = mix((0.015, 0.055, 0.22), (0.05, 0.16, 0.46), 0.3 + 0.4 * height)
    image = times(image, relief(soften(height, 2), 1.1, 2) * _handled(rng))
    text = np.zeros(U.shape, np.float32)
    write(text, "PP " + digits(rng, 3), 160, 290, 50, 0.16)
    image = over(image, (0.5, 0.55, 0.62), 0.8 * text * (0.4 + fractal(rng, 16, 16, 6, 0.9)))
    return over(image, (0.012, 0.014, 0.02), slot)


def _carbon(rng: np.random.Generator) -> np.ndarray:
    """Twill of carbon fibre under resin."""
    count = 32
    i, j = whole(U * count), whole(V * count)
    on_top = (i + j) % 4 < 2
    thread = np.where(on_top, fraction(U * count), fraction(V * count)) - 0.5
    fibres = np.where(on_top, fractal(rng, 256, 16, 3, 0.9), fractal(rng, 16, 256, 3, 0.9))
    shine = np.where(on_top, 0.35, 0.1) + 0.5 * (fibres - 0.5) * np.where(on_top, 0.8, 0.4)
    image = mix((0.012, 0.012, 0.013), (0.22, 0.22, 0.225), shine * (1.1 - 2.5 * thread * thread))
    return times(image, 0.5 + 1.2 * fractal(rng, 2, 2, 6, 0.7))


def _bubbles(rng: np.random.Generator) -> np.ndarray:
    """Bubble wrap."""
    rows = 12
    y = V * rows
    x = U * rows + 0.5 * (np.floor(y) % 2)
    dx, dy = fraction(x) - 0.5, fraction(y) - 0.5
    radius = np.sqrt(dx * dx + dy * dy)
    dome = np.sqrt(np.clip(1 - (radius / 0.45) ** 2, 0, 1))
    ring = step(0.07, 0.0, np.abs(radius - 0.43))
    glint = step(0.12, 0.04, np.sqrt((dx + 0.16) ** 2 + (dy + 0.18) ** 2))
    film = fractal(rng, 16, 16, 6, 0.8)
    below = mix((0.30, 0.24, 0.17), (0.60, 0.52, 0.42), fractal(rng, 4, 4, 8, 0.8))
    share = 0.18 + 0.3 * (film - 0.5) + 0.4 * ring * (0.5 + dy) + 0.2 * dome * (dy + 0.3)
    return over(over(below, (0.78, 0.80, 0.81), share), (0.95, 0.95, 0.95), glint)


def _studs(rng: np.random.Generator) -> np.ndarray:
    """Building bricks seen from above, in several colours."""
    count = 8
    palette = rgb([(0.48, 0.02, 0.02), (0.68, 0.50, 0.03), (0.02, 0.10, 0.38), (0.02, 0.2, 0.06), (0.7, 0.7, 0.68)])
    i, j = whole(U * count), whole(V * count)
    brick = palette[rng.integers(5, size=(count, count // 2))[j, i // 2]]
    dx, dy = fraction(U * count) - 0.5, fraction(V * count) - 0.5
    stud = step(0.32, 0.27, np.sqrt(dx * dx + dy * dy))
    inside = np.where(i % 2 == 0, U * count - i, 1 - (U * count - i)).astype(np.float32)
    edge = step(0.0, 0.06, np.minimum(inside, 0.5 - np.abs(dy)))
    shadow = step(0.32, 0.2, np.sqrt((dx - 0.1) ** 2 + (dy - 0.1) ** 2)) * (1 - stud)
    height = 0.5 * edge + stud
    return times(brick, relief(soften(height), 0.55, 2) * (1 - 0.5 * shadow) * _handled(rng))


def _moulded(rng: np.random.Generator) -> np.ndarray:
    """A housing: rounded panels, a vent, a label's recess; one colour, light does the rest."""
    x, y = np.abs(U - 0.5), np.abs(V - 0.5)
    panel = step(0.0, 0.02, 0.40 - np.maximum(x, y) - 0.3 * np.clip(x + y - 0.7, 0, 1))
    vent = step(0.0, 0.01, 0.22 - x) * step(0.0, 0.01, 0.09 - np.abs(V - 0.72)) * step(0.4, 0.6, wave(U * 24))
    radius = np.sqrt((U - 0.3) ** 2 + (V - 0.33) ** 2)
    knob = step(0.16, 0.13, radius) + step(0.1, 0.085, radius)
    screen = step(0.0, 0.01, 0.13 - np.abs(U - 0.66)) * step(0.0, 0.01, 0.1 - np.abs(V - 0.32))
    height = soften(panel - 0.8 * vent + 0.7 * knob - 0.4 * screen, 2)
    fine = fractal(rng, 128, 128, 3, 0.9)
    image = times(mix((0.46, 0.45, 0.41), (0.62, 0.61, 0.57), fine), relief(height, 0.9, 2) * _handled(rng))
    glow = mix((0.02, 0.035, 0.03), (0.10, 0.16, 0.12), U + V - 0.6)
    text = np.zeros(U.shape, np.float32)
    write(text, digits(rng, 2) + "." + digits(rng, 1), 287, 148, 34, 0.16)
    return over(over(image, glow, screen), (0.3, 0.75, 0.4), text)


def _leather(rng: np.random.Generator) -> np.ndarray:
    bend = 0.03 * (fractal(rng, 8, 8, 5, 0.7) - 0.5)
    near, second, tone = cells(rng, 56, jitter=1.0, du=bend, dv=bend.T)
    crease = step(0.06, 0.0, np.abs(fractal(rng, 4, 4, 7, 0.6) - 0.5))
    bump = step(0.0, 0.5, second - near) - 0.8 * crease
    image = mix((0.09, 0.03, 0.012), (0.34, 0.14, 0.06), 0.35 + 0.25 * tone + 0.5 * (fractal(rng, 4, 4, 7, 0.8) - 0.5))
    return times(image, relief(bump, 0.5) * _handled(rng))


def _foam(rng: np.random.Generator) -> np.ndarray:
    """Expanded polystyrene: beads of several sizes pressed flat."""
    near, second, tone = cells(rng, 40, jitter=0.9)
    gap = step(0.0, 0.22, second - near)
    share = 0.25 + 0.45 * gap + 0.4 * (tone - 0.5) + 0.5 * (fractal(rng, 4, 4, 7, 0.8) - 0.5)
    image = mix((0.42, 0.42, 0.43), (0.86, 0.86, 0.85), share)
    pits = step(0.93, 0.97, tone)
    return times(image, relief(gap, 0.35) * (1 - 0.5 * pits) * _handled(rng))


def _crumpled(rng: np.random.Generator) -> np.ndarray:
    """A crisp packet: foil in folds over coloured bands."""
    fold = np.zeros(U.shape, np.float32)
    for count, depth in ((4, 1.0), (8, 0.6), (16, 0.3)):
        near, second, _ = cells(rng, count, jitter=1.0)
        fold += np.float32(depth) * (second - near)
    light = relief(soften(fold, 2), 3.0, 2)
    colors = [(0.48, 0.03, 0.02), (0.62, 0.10, 0.03), (0.72, 0.42, 0.04), (0.70, 0.60, 0.10)]
    image = ramp(colors, wave(V + 0.1 * wave(U)) + 0.15 * (fold - 0.5))
    glint = step(1.35, 1.7, light)
    return over(times(image, light * (0.6 + 0.6 * fractal(rng, 2, 2, 6, 0.7))), (0.9, 0.9, 0.88), 0.8 * glint)


RECIPES = (_grained, _ribbed, _carbon, _bubbles, _studs, _moulded, _leather, _foam, _crumpled)
