"""Printed words: a font of strokes, drawn at any size and weight."""

from functools import lru_cache

import numpy as np

from evslip.scene.textures.canvas import step

CAP, DESCENT = 6, 2
"""Heights of a capital and of what hangs below the line, in units of the font's grid; letters are 4 wide."""


def write(
    ink: np.ndarray, text: str, left: float, top: float, height: float, weight: float = 0.14, stretch: float = 1.0
) -> float:
    """Print a word's capitals `height` pixels high into `ink` (1 is covered), and return where it ends.

    `weight` is the strokes' thickness in heights; `stretch` widens. What lies beyond the image is cut off.
    """
    for letter in text:
        if letter in STROKES:
            glyph = _glyph(letter, round(height, 1), weight, stretch)
            margin = _margin(height, weight)
            x, y = round(left) - margin, round(top) - margin
            x0, y0 = max(x, 0), max(y, 0)
            x1, y1 = min(x + glyph.shape[1], ink.shape[1]), min(y + glyph.shape[0], ink.shape[0])
            if x0 < x1 and y0 < y1:
                area = ink[y0:y1, x0:x1]
                np.maximum(area, glyph[y0 - y : y1 - y, x0 - x : x1 - x], out=area)
        left += _advance(letter, height, weight, stretch)
    return left


def length(text: str, height: float, weight: float = 0.14) -> float:
    """Width of a word in pixels."""
    return sum(_advance(letter, height, weight, 1.0) for letter in text)


def fit(text: str, width: float, most: float, weight: float = 0.14) -> float:
    """The height, `most` at most, at which a word is `width` pixels wide at most."""
    return min(most, width / length(text, 1.0, weight))


def _advance(letter: str, height: float, weight: float, stretch: float) -> float:
    columns = [x for line in STROKES.get(letter, ()) for x, _ in line]
    wide = max(columns) - min(columns) if columns else 2
    return height * stretch * (wide / CAP + 0.12) + height * weight


def _margin(height: float, weight: float) -> int:
    return int(height * weight / 2) + 2


@lru_cache(maxsize=1024)
def _glyph(letter: str, height: float, weight: float, stretch: float) -> np.ndarray:
    unit, margin = height / CAP, _margin(height, weight)
    across = unit * stretch
    left = min(x for line in STROKES[letter] for x, _ in line)
    columns, rows = int(4 * across) + 2 * margin + 1, int((CAP + DESCENT) * unit) + 2 * margin + 1
    x = np.arange(columns, dtype=np.float32) - np.float32(margin)
    y = np.arange(rows, dtype=np.float32)[:, None] - np.float32(margin)
    nearest = np.full((rows, columns), np.float32(1e9))
    for line in STROKES[letter]:
        for (ax, ay), (bx, by) in zip(line, line[1:] or line, strict=False):
            ax, bx, ay, by = (ax - left) * across, (bx - left) * across, ay * unit, by * unit
            dx, dy = bx - ax, by - ay
            norm = dx * dx + dy * dy
            along = np.clip(((x - ax) * dx + (y - ay) * dy) * np.float32(1 / norm if norm else 0), 0, 1)
            nearest = np.minimum(nearest, (x - ax - along * dx) ** 2 + (y - ay - along * dy) ** 2)
    half = max(height * weight / 2, 0.45)
    return step(half + 0.7, half - 0.7, np.sqrt(nearest))


def _parse(font: str) -> dict[str, tuple[tuple[tuple[int, int], ...], ...]]:
    glyphs = {}
    for glyph in font.split(";"):
        letter, _, strokes = glyph.strip().partition(" ")
        glyphs[letter] = tuple(tuple((int(p[0]), int(p[1])) for p in line.split()) for line in strokes.split(","))
    return glyphs


# A letter, then its strokes: places as column (0-4) and row (0 top, 2 small letters' top, 6 line, 8 below it).
STROKES = _parse("""
A 06 20 46,14 34; B 00 06 36 45 44 33 03,33 42 41 30 00; C 41 30 10 01 05 16 36 45; D 00 06 26 45 41 20 00;
E 40 00 06 46,03 33; F 40 00 06,03 33; G 41 30 10 01 05 16 36 45 43 23; H 00 06,40 46,03 43; I 20 26;
J 40 45 36 16 05; K 00 06,40 03 46; L 00 06 46; M 06 00 23 40 46; N 06 00 46 40; O 10 01 05 16 36 45 41 30 10;
P 06 00 30 41 42 33 03; Q 10 01 05 16 36 45 41 30 10,24 46; R 06 00 30 41 42 33 03,23 46;
S 41 30 10 01 02 13 33 44 45 36 16 05; T 00 40,20 26; U 00 05 16 36 45 40; V 00 26 40; W 00 16 22 36 40;
X 00 46,40 06; Y 00 23 40,23 26; Z 00 40 06 46; 0 10 01 05 16 36 45 41 30 10,14 32; 1 11 20 26;
2 01 10 30 41 42 06 46; 3 01 10 30 41 42 33 13,33 44 45 36 16 05; 4 36 30 04 44; 5 40 00 03 33 44 45 36 16 05;
6 30 10 01 05 16 36 45 44 33 03; 7 00 40 16; 8 10 01 02 13 33 42 41 30 10,13 04 05 16 36 45 44 33;
9 43 13 02 01 10 30 41 45 36 16; a 12 32 43 46,44 14 05 16 36 45; b 00 06,03 12 32 43 45 36 16 05;
c 43 32 12 03 05 16 36 45; d 40 46,43 32 12 03 05 16 36 45; e 04 44 43 32 12 03 05 16 36 45; f 30 20 11 16,02 32;
g 42 47 38 18,43 32 12 03 05 16 36 45; h 00 06,03 12 32 43 46; i 12 16,10 10; j 22 27 18,20 20; k 00 06,32 04 36;
l 10 15 26; m 02 06,03 12 23 26,23 32 43 46; n 02 06,03 12 32 43 46; o 12 03 05 16 36 45 43 32 12;
p 02 08,03 12 32 43 45 36 16 05; q 42 48,43 32 12 03 05 16 36 45; r 02 06,03 12 32;
s 43 32 12 03 14 34 45 36 16 05; t 10 15 26 36,02 32; u 02 05 16 36 45,42 46; v 02 26 42; w 02 16 23 36 42;
x 02 46,42 06; y 02 05 16 36,42 47 38 18; z 02 42 06 46; . 16 16; , 16 07; : 13 13,16 16; - 13 33;
% 40 06,01 01,45 45; / 40 06; & 46 11 10 20 21 03 05 16 26 44; + 13 33,22 24; * 21 25,03 43,01 45; ' 10 11
""")
