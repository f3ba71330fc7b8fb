"""Packages: shipping boxes and printed cartons, with words, bars, signs and scuffs."""

from functools import partial
from typing import NamedTuple

import numpy as np

from evslip.scene.textures import printing
from evslip.scene.textures.canvas import (
    SIZE,
    Color,
    U,
    V,
    fraction,
    mix,
    over,
    percent,
    ramp,
    relief,
    rgb,
    soften,
    step,
    times,
    wave,
    zigzag,
)
from evslip.scene.textures.lettering import fit, length, write
from evslip.scene.textures.noise import fractal, leaves

KRAFT: Color = (0.40, 0.265, 0.15)


class Carton(NamedTuple):
    """A consumer's package; colours are in percent of white."""

    top: Color
    bottom: Color
    ink: Color
    accent: Color
    name: str
    claim: str
    fruit: Color | None = None


CARTONS = (
    Carton((80, 78, 72), (74, 70, 60), (45, 3, 3), (62, 7, 5), "Rice", "long grain"),
    Carton((5, 17, 7), (14, 32, 12), (80, 75, 52), (62, 50, 12), "Tea", "green leaf", (20, 40, 6)),
    Carton((62, 7, 4), (40, 2, 2), (88, 76, 14), (85, 45, 5), "Crisp", "salted", (80, 55, 15)),
    Carton((74, 80, 86), (40, 56, 74), (3, 7, 30), (10, 35, 65), "Soap", "pure & mild"),
    Carton((86, 62, 12), (85, 36, 5), (30, 6, 2), (90, 85, 70), "Juice", "100% orange", (82, 32, 2)),
    Carton((10, 3, 2), (26, 10, 5), (78, 62, 32), (55, 40, 16), "Cocoa", "dark & bitter", (16, 6, 3)),
    Carton((86, 85, 82), (70, 72, 74), (4, 20, 42), (60, 10, 8), "Vitan", "tablets 400 mg"),
    Carton((50, 64, 22), (75, 78, 50), (5, 16, 3), (60, 5, 8), "Muesli", "apple & nut", (50, 5, 3)),
)


def _board(rng: np.random.Generator, color: Color) -> np.ndarray:
    """Corrugated board: fibres, flutes that show through, stains."""
    fibre = fractal(rng, 64, 32, 5, 0.9)
    flute = wave(V * 32)
    stain = fractal(rng, 2, 2, 7, 0.75)
    return times(rgb(color), 0.62 + 0.35 * fibre + 0.07 * flute + 0.4 * stain)


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
    ink = printing.blank()
    line = printing.centred(ink, "FRAGILE", 28, 80, 0.2)
    line = printing.centred(ink, "THIS SIDE UP", line, 38, 0.16)
    x, y = U * SIZE, V * SIZE
    for middle in (110, 402):  # arrows
        head = step(0, 2, 34 - np.abs(x - middle) - np.clip(232 - y, -200, 40)) * (y > 196) * (y < 236)
        shaft = (np.abs(x - middle) < 12) & (y >= 232) & (y < 300)
        ink = np.maximum(ink, np.maximum(head, shaft))
    printing.frame(ink, (60, 310, 160, 312), 2)
    printing.frame(ink, (352, 310, 452, 312), 2)
    goblet = np.abs(x - 256) < 14 + 22 * step(270, 200, y)
    ink = np.maximum(ink, goblet & (y > 200) & (y < 262))
    for half, top, bottom in ((4, 262, 300), (26, 300, 306)):  # its stem and its foot
        ink = np.maximum(ink, (np.abs(x - 256) < half) & (y >= top) & (y < bottom))
    printing.bars(ink, rng, 40, 360, 200, 90)
    write(ink, "NET " + printing.number(rng, 2) + ".5 KG", 268, 365, 27)
    write(ink, "LOT " + printing.number(rng, 5), 268, 415, 27)
    return _handled(rng, _stamp(rng, _board(rng, KRAFT), ink, printing.BLACK))


def _parts(rng: np.random.Generator) -> np.ndarray:
    """A long box with adhesive tape across and a shipping label."""
    image = _board(rng, (0.31, 0.2, 0.11))
    ink = printing.blank()
    printing.centred(ink, "PARTS", 20, 100, 0.22, width=0.6)
    write(ink, "HANDLE FLAT", 40, 420, 40, 0.16)
    image = _stamp(rng, image, ink, (0.30, 0.03, 0.02))
    tape = step(0.0, 0.006, 0.09 - np.abs(V - 0.35)) * (1 - 0.25 * fractal(rng, 2, 64, 5, 0.8))
    image = over(image, mix((0.42, 0.30, 0.14), (0.62, 0.50, 0.30), fractal(rng, 4, 32, 5, 0.8)), 0.85 * tape)
    ink = printing.blank()
    word_width = length("evslip", 40, 0.2)
    for k in range(5):
        write(ink, "evslip", 12 + k * (word_width + 24), 160, 40, 0.2)
    return _handled(rng, over(image, (0.55, 0.05, 0.04), ink * tape))


def _labelled(rng: np.random.Generator) -> np.ndarray:
    """A parcel with a white label, codes, and tape along the edge."""
    image = _board(rng, (0.44, 0.3, 0.18))
    label = step(0.0, 0.004, np.minimum(0.34 - np.abs(U - 0.46), 0.38 - np.abs(V - 0.5)))
    paper = mix((0.72, 0.71, 0.69), (0.84, 0.84, 0.82), fractal(rng, 4, 4, 7, 0.8))
    image = over(times(image, 1 - 0.35 * np.roll(label, (5, 5), (0, 1))), paper, label)
    ink = printing.blank()
    printing.frame(ink, (72, 72, 400, 440), 3)
    write(ink, "TO:", 84, 84, 16)
    for row in range(4):
        address = f"{printing.word(rng).capitalize()} {printing.word(rng, 3).capitalize()} {printing.number(rng, 2)}"
        write(ink, address, 120, 84 + 27 * row, 17, 0.15)
    printing.frame(ink, (72, 200, 400, 202), 2)
    printing.bars(ink, rng, 100, 215, 270, 70)
    printing.matrix_code(ink, rng, 84, 322, 105)
    printing.paragraph(ink, rng, (204, 326, 392, 432), 9)
    printing.frame(ink, (72, 312, 400, 314), 2)
    image = over(image, printing.BLACK, ink)
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
    top, bottom, text_color, accent = map(percent, carton[:4])
    title_top, middle, band = ((26, 305, 0.42), (210, 120, 0.36), (24, 290, 0.74))[layout]
    image = ramp((top, bottom), V + 0.1 * wave(U))
    if layout == 2:
        image = over(image, accent, 0.35 * step(0.4, 0.6, wave(U * 8)))
    bend = (0.0 if layout == 2 else 0.1) * wave(U * 0.5 + 0.4 * layout)
    for at, wide in ((band, 0.04), (band + 0.065, 0.012)):
        image = over(image, accent, step(0.0, 0.004, wide - np.abs(V - at - bend)))
    if carton.fruit is None:
        rays = step(0.4, 0.55, fraction(7 * (U - 0.5) / (1.2 - V)))
        window = step(0.0, 0.01, 0.17 - np.abs(V - middle / SIZE - 0.02))
        image = over(image, mix(top, accent, 0.5 * rays), window)
    else:
        if layout == 2:
            image = over(image, (0.84, 0.82, 0.76), printing.disc(256, middle - 10, 150))
        image = _still_life(rng, image, percent(carton.fruit), middle, 6 - layout)
    ink = printing.blank()
    title = fit(carton.name, 0.8 * SIZE, 105 - 15 * layout, 0.24)
    left = (SIZE - length(carton.name, title, 0.24)) * (0.5, 0.2, 0.5)[layout]
    shadow = printing.blank()
    write(shadow, carton.name, left + 5, title_top + 5, title, 0.26)
    image = over(image, printing.BLACK, 0.5 * soften(shadow, 3))
    write(ink, carton.name, left, title_top, title, 0.24)
    write(ink, carton.claim, left + 8, title_top + 1.3 * title, 26, 0.16)
    image = over(image, text_color, ink)
    seal = printing.disc(446, title_top + 150, 42)
    ink = printing.blank()
    write(ink, printing.number(rng, 3), 446 - 30, title_top + 130, 22, 0.18)
    write(ink, "g net", 446 - 26, title_top + 160, 15, 0.16)
    image = over(over(image, (0.80, 0.78, 0.70), seal), text_color if sum(text_color) < 0.9 else printing.BLACK, ink)
    panel = step(0.0, 0.004, np.minimum(0.46 - np.abs(U - 0.5), 0.1 - np.abs(V - 0.87)))
    image = over(image, (0.82, 0.82, 0.80), panel)
    ink = printing.blank()
    places = ((40, 188, 312), (342, 220, 40), (188, 40, 330))[layout]
    printing.bars(ink, rng, places[0], 404, 130, 66)
    printing.table(ink, rng, (places[1], 402, places[1] + 112, 490), 5)
    printing.paragraph(ink, rng, (places[2], 404, places[2] + 160, 490), 7.5)
    return _handled(rng, times(over(image, printing.BLACK, ink), 0.85 + 0.3 * fractal(rng, 64, 64, 4, 0.9)))


def _still_life(rng: np.random.Generator, image: np.ndarray, color: Color, middle: int, count: int) -> np.ndarray:
    cover, tone, place = leaves(rng, 16, 0.07, 0.03)
    near = np.abs(V - middle / SIZE) < 0.16
    image = over(image, times(mix((0.03, 0.10, 0.02), (0.18, 0.36, 0.07), tone), 1 - 0.3 * place), cover * near)
    for k in range(count):
        x, y, radius, shade = (float(c) for c in rng.random(4))
        tint = tuple(channel * (0.75 + 0.5 * shade) for channel in color)
        at = 256 + (k - (count - 1) / 2) * 62 + 20 * (x - 0.5)
        image = printing.ball(image, at, middle - 20 + 40 * y, 34 + 20 * radius, (tint[0], tint[1], tint[2]))
    return image


PRINTED = tuple(partial(_printed, carton=carton, layout=k % 3) for k, carton in enumerate(CARTONS))
RECIPES = (_fragile, *PRINTED[:3], _parts, *PRINTED[3:], _labelled, _plain)
