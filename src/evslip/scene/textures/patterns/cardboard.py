"""Packages: shipping boxes and printed cartons, with words, bars, signs and scuffs."""

from typing import NamedTuple

import numpy as np

from evslip.scene.textures.drawing.canvas import (
    SIZE,
    Color,
    U,
    V,
    fraction,
    mix,
    over,
    ramp,
    relief,
    rgb,
    soften,
    step,
    times,
    wave,
    zigzag,
)
from evslip.scene.textures.drawing.lettering import fit, length, write
from evslip.scene.textures.drawing.noise import fractal, leaves
from evslip.scene.textures.drawing.printing import (
    BLACK,
    ball,
    bars,
    blank,
    centred,
    disc,
    frame,
    matrix_code,
    number,
    paragraph,
    table,
    word,
)

COUNT = 12
KRAFT: Color = (0.40, 0.265, 0.15)


class Carton(NamedTuple):
    ground: tuple[Color, Color]
    """At the top and at the bottom."""
    ink: Color
    accent: Color
    name: str
    claim: str
    fruit: Color | None


CARTONS = (
    Carton(
        ((0.80, 0.78, 0.72), (0.74, 0.70, 0.60)), (0.45, 0.03, 0.03), (0.62, 0.07, 0.05), "Rice", "long grain", None
    ),
    Carton(
        ((0.05, 0.17, 0.07), (0.14, 0.32, 0.12)),
        (0.80, 0.75, 0.52),
        (0.62, 0.50, 0.12),
        "Tea",
        "green leaf",
        (0.2, 0.4, 0.06),
    ),
    Carton(
        ((0.62, 0.07, 0.04), (0.40, 0.02, 0.02)),
        (0.88, 0.76, 0.14),
        (0.85, 0.45, 0.05),
        "Crisp",
        "salted",
        (0.8, 0.55, 0.15),
    ),
    Carton(
        ((0.74, 0.80, 0.86), (0.40, 0.56, 0.74)), (0.03, 0.07, 0.30), (0.1, 0.35, 0.65), "Soap", "pure & mild", None
    ),
    Carton(
        ((0.86, 0.62, 0.12), (0.85, 0.36, 0.05)),
        (0.30, 0.06, 0.02),
        (0.9, 0.85, 0.7),
        "Juice",
        "100% orange",
        (0.82, 0.32, 0.02),
    ),
    Carton(
        ((0.10, 0.03, 0.02), (0.26, 0.10, 0.05)),
        (0.78, 0.62, 0.32),
        (0.55, 0.40, 0.16),
        "Cocoa",
        "dark & bitter",
        (0.16, 0.06, 0.03),
    ),
    Carton(
        ((0.86, 0.85, 0.82), (0.70, 0.72, 0.74)),
        (0.04, 0.20, 0.42),
        (0.60, 0.10, 0.08),
        "Vitan",
        "tablets 400 mg",
        None,
    ),
    Carton(
        ((0.50, 0.64, 0.22), (0.75, 0.78, 0.50)),
        (0.05, 0.16, 0.03),
        (0.6, 0.05, 0.08),
        "Muesli",
        "apple & nut",
        (0.5, 0.05, 0.03),
    ),
)
FRAGILE, PARTS, LABELLED, PLAIN = 0, 4, 10, 11


def draw(rng: np.random.Generator, index: int) -> np.ndarray:
    if index in (FRAGILE, PARTS, LABELLED, PLAIN):
        kinds = {FRAGILE: _fragile, PARTS: _parts, LABELLED: _labelled, PLAIN: _plain}
        return kinds[index](rng)
    place = (1, 2, 3, 5, 6, 7, 8, 9).index(index)
    return _printed(rng, CARTONS[place], place % 3)


def _board(rng: np.random.Generator, color: Color) -> np.ndarray:
    """Corrugated board: fibres, flutes that show through, stains."""
    fibre = fractal(rng, 64, 32, 5, 0.9)
    flute = wave(V * 32)
    stain = fractal(rng, 2, 2, 7, 0.75)
    return times(
        np.broadcast_to(rgb(color), (SIZE, SIZE, 3)),
        0.62 + 0.35 * fibre + 0.07 * flute + 0.4 * stain,
    )


def _handled(rng: np.random.Generator, image: np.ndarray) -> np.ndarray:
    """Dents, pale rubbed edges, light that varies over the sheet."""
    edge = np.minimum(zigzag(U), zigzag(V)) / 2
    rub = fractal(rng, 16, 16, 6, 0.95)
    image = over(image, (0.66, 0.62, 0.55), 0.8 * step(0.02, 0.0, edge - 0.012 * rub) * rub)
    dents = relief(soften(fractal(rng, 4, 4, 4, 0.6), 3), 2.2, 3)
    return times(image, dents * (0.72 + 0.55 * fractal(rng, 2, 2, 3, 0.5)))


def _stamp(rng: np.random.Generator, image: np.ndarray, ink: np.ndarray, color: Color) -> np.ndarray:
    """Print on rough board: the ink does not reach every fibre."""
    return over(image, color, ink * (0.55 + 0.45 * step(0.25, 0.5, fractal(rng, 64, 64, 4, 1.0))))


def _fragile(rng: np.random.Generator) -> np.ndarray:
    ink = blank()
    line = centred(ink, "FRAGILE", 28, 80, 0.2)
    line = centred(ink, "THIS SIDE UP", line, 38, 0.16)
    for x in (110, 402):  # arrows
        head = (
            step(0, 2, 34 - np.abs(U * SIZE - x) - np.clip(232 - V * SIZE, -200, 40))
            * (V * SIZE > 196)
            * (V * SIZE < 236)
        )
        shaft = (np.abs(U * SIZE - x) < 12) & (V * SIZE >= 232) & (V * SIZE < 300)
        ink = np.maximum(ink, np.maximum(head, shaft))
    frame(ink, (60, 310, 160, 312), 2)
    frame(ink, (352, 310, 452, 312), 2)
    goblet = np.abs(U * SIZE - 256) < 14 + 22 * step(270, 200, V * SIZE)
    ink = np.maximum(
        ink,
        (goblet & (V * SIZE > 200) & (V * SIZE < 262))
        | ((np.abs(U * SIZE - 256) < 4) & (V * SIZE >= 262) & (V * SIZE < 300)),
    )
    ink = np.maximum(ink, (np.abs(U * SIZE - 256) < 26) & (V * SIZE >= 300) & (V * SIZE < 306))
    bars(ink, rng, 40, 360, 200, 90)
    write(ink, "NET " + number(rng, 2) + ".5 KG", 268, 365, 27)
    write(ink, "LOT " + number(rng, 5), 268, 415, 27)
    return _handled(rng, _stamp(rng, _board(rng, KRAFT), ink, BLACK))


def _parts(rng: np.random.Generator) -> np.ndarray:
    """A long box with adhesive tape across and a shipping label."""
    image = _board(rng, (0.31, 0.2, 0.11))
    ink = blank()
    centred(ink, "PARTS", 20, 100, 0.22, width=0.6)
    write(ink, "HANDLE FLAT", 40, 420, 40, 0.16)
    image = _stamp(rng, image, ink, (0.30, 0.03, 0.02))
    tape = step(0.0, 0.006, 0.09 - np.abs(V - 0.35)) * (1 - 0.25 * fractal(rng, 2, 64, 5, 0.8))
    image = over(
        image, times(mix((0.42, 0.30, 0.14), (0.62, 0.50, 0.30), fractal(rng, 4, 32, 5, 0.8)), 1.0), 0.85 * tape
    )
    ink = blank()
    word_width = length("evslip", 40, 0.2)
    for k in range(5):
        write(ink, "evslip", 12 + k * (word_width + 24), 160, 40, 0.2)
    return _handled(rng, over(image, (0.55, 0.05, 0.04), ink * tape))


def _labelled(rng: np.random.Generator) -> np.ndarray:
    """A parcel with a white label, codes, and tape along the edge."""
    image = _board(rng, (0.44, 0.3, 0.18))
    label = step(0.0, 0.004, np.minimum(0.34 - np.abs(U - 0.46), 0.38 - np.abs(V - 0.5)))
    image = over(
        times(image, 1 - 0.35 * np.roll(label, (5, 5), (0, 1))),
        mix((0.72, 0.71, 0.69), (0.84, 0.84, 0.82), fractal(rng, 4, 4, 7, 0.8)),
        label,
    )
    ink = blank()
    frame(ink, (72, 72, 400, 440), 3)
    write(ink, "TO:", 84, 84, 16)
    for row in range(4):
        write(
            ink, f"{word(rng).capitalize()} {word(rng, 3).capitalize()} {number(rng, 2)}", 120, 84 + 27 * row, 17, 0.15
        )
    frame(ink, (72, 200, 400, 202), 2)
    bars(ink, rng, 100, 215, 270, 70)
    matrix_code(ink, rng, 84, 322, 105)
    paragraph(ink, rng, (204, 326, 392, 432), 9)
    frame(ink, (72, 312, 400, 314), 2)
    image = over(image, BLACK, ink)
    tape = step(0.0, 0.004, 0.055 - np.abs(U - 0.92))
    return _handled(rng, over(image, (0.66, 0.6, 0.48), (0.35 + 0.3 * fractal(rng, 64, 2, 5, 0.8)) * tape))


def _plain(rng: np.random.Generator) -> np.ndarray:
    """Torn board: the flutes are bare where the liner has gone."""
    liner = _board(rng, (0.42, 0.28, 0.16))
    torn = step(0.5, 0.53, fractal(rng, 2, 2, 8, 0.68))
    fibre = fractal(rng, 128, 32, 4, 0.95)
    flutes = times(mix((0.14, 0.09, 0.05), (0.46, 0.31, 0.18), wave(U * 40)), 0.65 + 0.6 * fibre)
    strands = leaves(rng, 250, 0.02, 0.0025)[0]
    image = over(over(liner, flutes, torn), (0.52, 0.38, 0.24), 0.5 * strands * torn)
    return _handled(rng, times(image, relief(soften(1 - torn), 1.2, 2)))


def _printed(rng: np.random.Generator, carton: Carton, layout: int) -> np.ndarray:
    """A consumer's package: a picture or rays, name, claim, weight, facts, codes."""
    title_top, middle, band = ((26, 305, 0.42), (210, 120, 0.36), (24, 290, 0.74))[layout]
    image = ramp(carton.ground, V + 0.1 * wave(U))
    if layout == 2:
        image = over(image, carton.accent, 0.35 * step(0.4, 0.6, wave(U * 8)))
    bend = (0.0 if layout == 2 else 0.1) * wave(U * 0.5 + 0.4 * layout)
    for at, wide in ((band, 0.04), (band + 0.065, 0.012)):
        image = over(image, carton.accent, step(0.0, 0.004, wide - np.abs(V - at - bend)))
    if carton.fruit is None:
        rays = step(0.4, 0.55, fraction(7 * (U - 0.5) / (1.2 - V)))
        window = step(0.0, 0.01, 0.17 - np.abs(V - middle / SIZE - 0.02))
        image = over(image, mix(carton.ground[0], carton.accent, 0.5 * rays), window)
    else:
        if layout == 2:
            image = over(image, (0.84, 0.82, 0.76), disc(SIZE, 256, middle - 10, 150))
        image = _still_life(rng, image, carton.fruit, middle, 6 - layout)
    ink = blank()
    title = fit(carton.name, 0.8 * SIZE, 105 - 15 * layout, 0.24)
    left = (SIZE - length(carton.name, title, 0.24)) * (0.5, 0.2, 0.5)[layout]
    shadow = blank()
    write(shadow, carton.name, left + 5, title_top + 5, title, 0.26)
    image = over(image, BLACK, 0.5 * soften(shadow, 3))
    write(ink, carton.name, left, title_top, title, 0.24)
    write(ink, carton.claim, left + 8, title_top + 1.3 * title, 26, 0.16)
    image = over(image, carton.ink, ink)
    seal = disc(SIZE, 446, title_top + 150, 42)
    ink = blank()
    write(ink, number(rng, 3), 446 - 30, title_top + 130, 22, 0.18)
    write(ink, "g net", 446 - 26, title_top + 160, 15, 0.16)
    image = over(over(image, (0.80, 0.78, 0.70), seal), carton.ink if sum(carton.ink) < 0.9 else BLACK, ink)
    panel = step(0.0, 0.004, np.minimum(0.46 - np.abs(U - 0.5), 0.1 - np.abs(V - 0.87)))
    image = over(image, (0.82, 0.82, 0.80), panel)
    ink = blank()
    places = ((40, 188, 312), (342, 220, 40), (188, 40, 330))[layout]
    bars(ink, rng, places[0], 404, 130, 66)
    table(ink, rng, (places[1], 402, places[1] + 112, 490), 5)
    paragraph(ink, rng, (places[2], 404, places[2] + 160, 490), 7.5)
    return _handled(rng, times(over(image, BLACK, ink), 0.85 + 0.3 * fractal(rng, 64, 64, 4, 0.9)))


def _still_life(rng: np.random.Generator, image: np.ndarray, color: Color, middle: int, count: int) -> np.ndarray:
    cover, tone, place = leaves(rng, 16, 0.07, 0.03)
    near = np.abs(V - middle / SIZE) < 0.16
    image = over(image, times(mix((0.03, 0.10, 0.02), (0.18, 0.36, 0.07), tone), 1 - 0.3 * place), cover * near)
    for k in range(count):
        x, y, radius, shade = (float(c) for c in rng.random(4))
        tint = tuple(channel * (0.75 + 0.5 * shade) for channel in color)
        at = 256 + (k - (count - 1) / 2) * 62 + 20 * (x - 0.5)
        image = ball(image, at, middle - 20 + 40 * y, 34 + 20 * radius, (tint[0], tint[1], tint[2]))
    return image
