"""Printed paper: newspaper, book cover, label, map, notes, tickets, music, wallpaper."""

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
    ramp,
    relief,
    rgb,
    soften,
    step,
    times,
    wave,
)
from evslip.scene.textures.lettering import write
from evslip.scene.textures.noise import cells, fractal, leaves


def _sheet(rng: np.random.Generator, low: Color, high: Color) -> np.ndarray:
    return mix(low, high, fractal(rng, 2, 2, 8, 0.7) + 0.25 * (fractal(rng, 128, 128, 3, 0.9) - 0.5))


def _creases(rng: np.random.Generator, depth: float) -> np.ndarray:
    """Light on a sheet that was folded and has been handled."""
    fold = np.abs(fraction(U + 0.5) - 0.5) + np.abs(fraction(V + 0.17) - 0.5)
    return relief(soften(step(0.0, 0.03, fold) + 3 * fractal(rng, 2, 2, 4, 0.5), 2), depth, 3)


def _photograph(rng: np.random.Generator, horizon: float = 0.5) -> np.ndarray:
    """Something like a landscape, (SIZE, SIZE)."""
    hills = V + 0.5 - horizon + 0.5 * (fractal(rng, 4, 1, 8, 0.6) - 0.5)
    sky = 0.75 + 0.5 * (fractal(rng, 2, 4, 7, 0.6) - 0.5)
    land = 0.25 + 0.8 * (fractal(rng, 16, 16, 6, 0.95) - 0.4)
    return np.where(hills < 0.5, sky, land)


def _newspaper(rng: np.random.Generator) -> np.ndarray:
    image, ink = _sheet(rng, (0.50, 0.48, 0.43), (0.64, 0.62, 0.56)), printing.blank()
    line = printing.centred(ink, "The " + printing.word(rng).capitalize() + " Times", 16, 48, 0.16)
    printing.frame(ink, (16, int(line), SIZE - 16, int(line) + 3), 1)
    top = int(line) + 14
    write(ink, " ".join(printing.word(rng) for _ in range(3)).capitalize(), 18, top, 28, 0.2)
    for column in range(4):
        left = 18 + 122 * column
        start = top + 48 if column < 2 else top + 210
        printing.paragraph(ink, rng, (left, start, left + 110, SIZE - 12), 7.5, 1.75)
    picture = _photograph(rng, 0.27)
    box = (slice(top, top + 195), slice(262, 494))
    ink[box] = step(0.42, 0.58, 1 - picture + 0.45 * (wave(U * 96 + V * 96) * wave(U * 96 - V * 96) - 0.4))[box]
    return times(over(image, printing.BLACK, 0.88 * ink), _creases(rng, 0.25))


def _cover(rng: np.random.Generator) -> np.ndarray:
    """A book's cover."""
    picture = _photograph(rng)
    dusk = [(0.015, 0.02, 0.045), (0.08, 0.05, 0.12), (0.42, 0.14, 0.10), (0.72, 0.46, 0.20)]
    image = ramp(dusk, picture)
    sun = printing.disc(350, 190, 60)[..., None]
    image = image * (1 - sun) + rgb((0.8, 0.62, 0.35)) * sun
    ink = printing.blank()
    line = printing.centred(ink, printing.word(rng, 3).upper(), 40, 64, 0.18)
    printing.centred(ink, "of the " + printing.word(rng), line, 36, 0.13)
    author = f"{printing.word(rng).capitalize()} {printing.word(rng).capitalize()}"
    printing.centred(ink, author, 450, 28, 0.15, width=0.6)
    printing.frame(ink, (14, 14, SIZE - 14, SIZE - 14), 3)
    worn = fractal(rng, 32, 32, 5, 0.95)
    image = over(image, (0.78, 0.74, 0.66), ink)
    spine = 1 - 0.45 * step(0.01, 0.0, np.abs(U - 0.06))
    image = over(image, (0.5, 0.46, 0.4), 0.8 * step(0.72, 0.8, worn))
    return times(image, spine * (0.8 + 0.4 * fractal(rng, 2, 2, 4, 0.5)))


def _label(rng: np.random.Generator) -> np.ndarray:
    """A tin's label: a fruit, a banner, figures."""
    image = ramp([(0.70, 0.60, 0.36), (0.76, 0.70, 0.52)], _sheet(rng, (0, 0, 0), (1, 1, 1))[..., 0])
    stripes = step(0.45, 0.55, wave(U * 20))
    image = over(image, mix((0.30, 0.02, 0.03), (0.62, 0.52, 0.34), stripes), step(0.79, 0.81, V))
    for x, y, r in ((200, 300, 66), (310, 290, 72), (255, 345, 70)):
        image = printing.ball(image, x, y, r, (0.52, 0.04, 0.02))
    cover, tone, place = leaves(rng, 12, 0.06, 0.025)
    leaf = times(mix((0.03, 0.11, 0.02), (0.16, 0.32, 0.06), tone), 1 - 0.4 * place)
    image = over(image, leaf, cover * step(0.62, 0.58, np.abs(V - 0.2) + 0.3))
    banner = step(0.0, 0.006, 0.1 - np.abs(V - 0.2 - 0.05 * wave(U)))
    image = over(image, (0.05, 0.10, 0.30), banner)
    ink = printing.blank()
    printing.centred(ink, "TOMATOES", 88, 62, 0.2, width=0.84)
    image = over(image, (0.82, 0.72, 0.36), ink)
    ink = printing.blank()
    write(ink, printing.number(rng, 3) + " g", 30, 430, 40, 0.18)
    printing.bars(ink, rng, 330, 424, 150, 50)
    paper = step(0.0, 0.004, np.minimum(0.17 - np.abs(U - 0.79), 0.085 - np.abs(V - 0.89)))
    image = over(over(image, (0.84, 0.83, 0.8), paper), printing.BLACK, ink)
    shine = 0.55 + 0.75 * wave(U + 0.2) + 0.1 * fractal(rng, 32, 32, 5, 0.9)
    return times(image, shine)


def _map(rng: np.random.Generator) -> np.ndarray:
    """Contours, woods, water, roads, names."""
    height = fractal(rng, 2, 2, 7, 0.5, 1.2)
    colors = [(0.42, 0.58, 0.70), (0.60, 0.68, 0.46), (0.74, 0.74, 0.56), (0.70, 0.58, 0.40), (0.82, 0.78, 0.72)]
    image = times(ramp(colors, step(0.2, 0.85, height)), 0.85 + 0.3 * relief(height, 2.0, 2) - 0.3)
    contour = step(0.10, 0.04, np.abs(fraction(height * 22 + 0.5) - 0.5)) * (height > 0.36)
    image = over(image, (0.34, 0.20, 0.10), 0.55 * contour)
    wood = step(0.56, 0.58, fractal(rng, 4, 4, 7, 0.7)) * (height > 0.38)
    image = over(image, (0.22, 0.36, 0.14), 0.55 * wood)
    near, second, _ = cells(rng, 5, du=0.05 * (fractal(rng, 4, 4, 5, 0.6) - 0.5))
    road = step(0.045, 0.035, second - near) * (height > 0.37)
    image = over(image, (0.12, 0.1, 0.1), road)
    image = over(image, (0.75, 0.55, 0.16), step(0.032, 0.024, second - near) * (height > 0.37))
    ink = printing.blank()
    for x, y, size in rng.random((16, 3)):
        name = printing.word(rng, 2).capitalize()
        write(ink, name, 400 * float(x) + 10, 480 * float(y) + 8, 9 + 8 * float(size), 0.15)
    for k in range(1, 4):
        ink[128 * k, :] = ink[:, 128 * k] = 0.5
    return times(over(image, (0.03, 0.03, 0.05), ink), _creases(rng, 0.3))


def _notes(rng: np.random.Generator) -> np.ndarray:
    """A squared notebook page with a drawing, figures, a coffee ring."""
    image = _sheet(rng, (0.70, 0.69, 0.65), (0.84, 0.83, 0.79))
    across, down = (step(0.06, 0.02, np.abs(fraction(at * 32) - 0.5)) for at in (U, V))
    image = over(image, (0.36, 0.46, 0.62), 0.7 * np.maximum(across, down))
    ink = printing.blank()
    for row in range(9):
        text = " ".join(printing.word(rng, int(rng.integers(1, 4))) for _ in range(3))
        if row % 3 == 0:
            text = f"{printing.number(rng, 2)} x {printing.number(rng, 3)} - {printing.number(rng, 2)}"
        write(ink, text, 40 + 6 * (row % 2), 36 + 32 * row, 15, 0.1, 1.1)
    curve = 0.86 - 0.16 * wave(U * 2 + 0.4 * wave(U)) * U
    ink = np.maximum(ink, step(0.006, 0.003, np.abs(V - curve)) * (U > 0.1) * (U < 0.9))
    ink[300:490, 50:53] = ink[487:490, 50:470] = 1
    image = over(image, (0.02, 0.03, 0.22), 0.85 * ink)
    radius = np.sqrt((U - 0.68) ** 2 + (V - 0.3) ** 2) + 0.01 * (fractal(rng, 8, 8, 6, 0.8) - 0.5)
    ring = step(0.02, 0.002, np.abs(radius - 0.15)) * (0.3 + fractal(rng, 8, 8, 6, 0.8))
    return times(over(image, (0.28, 0.15, 0.05), 0.6 * ring), _creases(rng, 0.2))


def _comic(rng: np.random.Generator) -> np.ndarray:
    """Panels in flat colours with screens of dots and balloons."""
    palette = rgb([(0.75, 0.10, 0.06), (0.85, 0.70, 0.08), (0.08, 0.30, 0.62), (0.75, 0.45, 0.30), (0.15, 0.45, 0.20)])
    panels = ((0, 0, 290, 240), (300, 0, 512, 240), (0, 250, 180, 512), (190, 250, 512, 512))
    image = np.full((SIZE, SIZE, 3), 0.8, np.float32)
    ink = printing.blank()
    blobs, rough = fractal(rng, 4, 4, 5, 0.55), fractal(rng, 2, 2, 4, 0.5)
    dots = step(0.55, 0.75, wave(U * 64 + V * 64) * wave(U * 64 - V * 64) + 0.3)
    for k, (left, top, right, bottom) in enumerate(panels):
        box = slice(top + 8, bottom - 8), slice(left + 8, right - 8)
        colors = palette[np.clip(np.floor(blobs * 5 + k).astype(int), 0, 99) % 5]
        colors = over(colors, palette[(k + 2) % 5], 0.5 * dots * step(0.5, 0.52, rough))
        edge = step(0.05, 0.03, np.abs(fraction(blobs * 5) - 0.02))
        image[box] = over(colors, printing.BLACK, edge)[box]
        printing.frame(ink, (left + 6, top + 6, right - 6, bottom - 6), 3)
        x, y, wide = (left + right) / 2, top + 50, (right - left) * 0.36
        radius = np.sqrt(((U * SIZE - x) / wide) ** 2 + ((V * SIZE - y) / 32) ** 2)
        image = over(over(image, printing.BLACK, step(1.1, 1.06, radius)), (0.86, 0.86, 0.83), step(1.0, 0.97, radius))
        printing.paragraph(ink, rng, (x - 0.7 * wide, y - 18, x + 0.7 * wide, y + 24), 9, 1.6)
    return times(over(image, printing.BLACK, ink), (0.82 + 0.3 * fractal(rng, 4, 4, 7, 0.8)) * _creases(rng, 0.15))


def _music(rng: np.random.Generator) -> np.ndarray:
    image, ink = _sheet(rng, (0.66, 0.62, 0.52), (0.78, 0.74, 0.64)), printing.blank()
    printing.centred(ink, printing.word(rng, 3).capitalize() + " in D", 14, 26, 0.15)
    for staff in range(6):
        top = 66 + 74 * staff
        for line in range(5):
            ink[top + 9 * line, 20 : SIZE - 20] = 1
        for x in (20, 180, 340, SIZE - 21):
            ink[top : top + 37, x : x + 2] = 1
        x = 50.0
        while x < SIZE - 34:
            step_, gap, hollow = int(rng.integers(0, 9)), float(rng.random()), rng.random() < 0.2
            y = top + 4.5 * step_
            head = np.sqrt(((U * SIZE - x) / 6.2) ** 2 + ((V * SIZE - y + 0.35 * (U * SIZE - x)) / 4.3) ** 2)
            ink = np.maximum(ink, step(1.1, 0.9, head) * (1 - hollow * step(0.75, 0.5, head)))
            up = step_ > 4
            column = int(x + (5 if up else -6))
            ends = (int(y) - 28, int(y)) if up else (int(y), int(y) + 28)
            ink[max(ends[0], 0) : ends[1], column : column + 2] = 1
            x += 17 + 22 * gap
    return times(over(image, printing.BLACK, 0.9 * ink), _creases(rng, 0.25))


def _wallpaper(rng: np.random.Generator) -> np.ndarray:
    """A damask: one ornament, mirrored and repeated, on stripes."""
    x, y = np.abs(fraction(U * 4 + 0.5 * (np.floor(V * 4) % 2)) - 0.5) * 2, fraction(V * 4) * 2 - 1
    petal = np.sqrt(x * x + 0.5 * y * y)
    field = 3.2 * petal + 0.8 * wave(1.5 * x + y) + 0.6 * wave(2 * y - x)
    motif = step(0.5, 0.56, wave(field)) * step(1.02, 0.95, x + 0.8 * np.abs(y))
    paper = mix((0.30, 0.34, 0.30), (0.40, 0.44, 0.38), step(0.45, 0.55, wave(U * 8)))
    image = over(paper, (0.62, 0.60, 0.46), motif)
    stain = step(0.55, 0.9, fractal(rng, 2, 1, 8, 0.72))
    image = over(image, (0.3, 0.24, 0.15), 0.5 * stain)
    return times(image, (0.75 + 0.35 * fractal(rng, 64, 64, 4, 0.9)) * relief(motif, 0.2))


def _crumpled(rng: np.random.Generator) -> np.ndarray:
    """A sheet that was a ball, smoothed out, with a printed form."""
    image, ink = _sheet(rng, (0.72, 0.72, 0.70), (0.86, 0.86, 0.84)), printing.blank()
    printing.centred(ink, printing.word(rng, 2).upper() + " GmbH", 26, 34, 0.18, width=0.6)
    printing.table(ink, rng, (40, 90, 472, 330), 8)
    printing.paragraph(ink, rng, (40, 350, 300, 490), 9)
    printing.bars(ink, rng, 330, 370, 140, 80)
    fold = np.zeros((SIZE, SIZE), np.float32)
    for count, depth in ((3, 1.0), (6, 0.6), (12, 0.35)):
        near, second, _ = cells(rng, count, du=0.02 * (fractal(rng, 8, 8, 4, 0.6) - 0.5))
        fold += np.float32(depth) * np.abs(second - near)
    return times(over(image, printing.BLACK, 0.9 * ink), relief(fold, 4.0, 2))


RECIPES = (_newspaper, _cover, _label, _map, _notes, _comic, _music, _wallpaper, _crumpled)
