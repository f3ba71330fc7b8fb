"""Panoramas of rooms: four walls, a ceiling with lamps."""

import numpy as np

from evslip.scene.textures.canvas import Color, fraction, mix, over, ramp, rgb, step, times, whole
from evslip.scene.textures.noise import fractal
from evslip.scene.textures.panoramas.panorama import ALONG, REACH, RISE, UPPER, WALL, field, lookup, plane

Paint = Color | np.ndarray
HEIGHT = REACH * RISE
"""Height above the horizon where each direction meets a wall, in half sides of the room."""
PLACE = WALL * 2 + 1 + ALONG + np.zeros_like(HEIGHT)
"""Place around the room, 0 to 8."""


def _paint(
    image: np.ndarray, paint: Paint, middle: float, half: float, low: float, high: float, soft: float = 0.006
) -> None:
    """Put a colour, or an image of the whole panorama, on a rectangle of the walls (place in the room, heights)."""
    away = np.abs(np.mod(PLACE[0] - np.float32(middle) + 4, 8) - 4)
    columns = np.flatnonzero(away < half + soft)
    height = HEIGHT[:, columns]
    first = int(np.argmax(height[:, len(columns) // 2] < 1.5 * high + 0.2))  # rows count down from the zenith
    area = slice(first, None), columns
    within = np.minimum(height - np.float32(low), np.float32(high) - height)
    inside = np.minimum(np.float32(half) - away[columns], within)
    color = rgb(paint)
    new = color[area] if color.ndim == 3 else np.broadcast_to(color, (*height[first:].shape, 3))
    image[area] = over(image[area], new, step(-soft, soft, inside[first:]))


def _shade(rng: np.random.Generator) -> np.ndarray:
    """Corners are darker; stains; light falls off."""
    corner = np.minimum(1, 0.55 + 1.2 * (1 - np.abs(ALONG)))
    return corner * (0.75 + 0.5 * (field(rng, 16, 8, 8, 0.75) - 0.3))


def _ceiling(
    rng: np.random.Generator, image: np.ndarray, top: float, color: Color, lamp: Color, rows: float
) -> np.ndarray:
    x, y = plane(top)
    panel = lookup(fractal(rng, 32, 32, 5, 0.9), 0.5 * x, 0.5 * y)
    joint = np.minimum(np.abs(fraction(4 * x) - 0.5), np.abs(fraction(4 * y) - 0.5))
    board = times(rgb(color), (0.7 + 0.4 * panel) * (0.6 + 0.4 * step(0.01, 0.05, joint)))
    strip = step(0.06, 0.05, np.abs(fraction(rows * x) - 0.5) / rows) * step(0.32, 0.31, np.abs(fraction(y) - 0.5))
    return over(image, over(board, lamp, strip), step(-0.004, 0.004, HEIGHT - np.float32(top)))


def _view(rng: np.random.Generator, low: float, high: float) -> np.ndarray:
    """View through windows of these heights."""
    leaf = field(rng, 64, 32, 7, 0.9)
    hills = np.float32(low) + np.float32(0.45 * (high - low)) * (0.5 + fractal(rng, 16, 1, 7, 0.6, size=(UPPER[0], 1)))
    trees = mix((0.05, 0.09, 0.03), (0.30, 0.38, 0.14), leaf)
    sky = ramp([(0.92, 0.93, 0.95), (0.62, 0.75, 0.92)], HEIGHT)
    return np.where((hills > HEIGHT)[..., None], trees, sky)


def _window(image: np.ndarray, view: np.ndarray, middle: float, half: float, low: float, high: float) -> None:
    _paint(image, (0.66, 0.65, 0.62), middle, half + 0.05, low - 0.05, high + 0.05)
    _paint(image, view, middle, half, low, high)
    _paint(image, (0.6, 0.59, 0.56), middle, 0.015, low, high)
    _paint(image, (0.6, 0.59, 0.56), middle, half, (low + high) / 2 - 0.012, (low + high) / 2 + 0.012)


def _books(rng: np.random.Generator, low: float, high: float, shelves: int) -> np.ndarray:
    """Bookcases all around: spines of all colours, thicknesses and heights."""
    shelf = (HEIGHT - np.float32(low)) * np.float32(shelves / (high - low))
    edges = np.sort(rng.random(900, np.float32)) * 8
    row = np.clip(whole(shelf), 0, 31)
    shifted = np.mod(PLACE + rng.random(32, np.float32)[row] * 8, 8)
    book = np.searchsorted(edges, shifted) % 900
    tone, tall, hue = rng.random((3, 900), np.float32)[:, (book + 131 * row) % 900]
    spine = np.clip((shifted - edges[book - 1]) / (edges[book] - edges[book - 1] + np.float32(1e-4)), 0, 1)
    colors = [(0.03, 0.03, 0.035), (0.30, 0.04, 0.03), (0.55, 0.46, 0.30), (0.03, 0.08, 0.22)]
    colors += [(0.04, 0.14, 0.07), (0.7, 0.68, 0.62), (0.30, 0.16, 0.07)]
    up = fraction(shelf)
    round_ = 0.45 + 0.7 * (1 - (2 * spine - 0.8) ** 2)
    title = step(0.12, 0.08, np.abs(up - 0.55 - 0.15 * tone)) * step(0.35, 0.25, np.abs(spine - 0.5)) * (hue > 0.4)
    cover = over(times(ramp(colors, hue), (0.6 + 0.6 * tone) * round_), (0.72, 0.6, 0.3), 0.7 * title)
    is_book = (up > 0.1) & (up < 0.62 + 0.3 * tall)
    back: Color = (0.025, 0.016, 0.01)
    case = np.where((up < 0.1)[..., None], rgb((0.20, 0.115, 0.055)), rgb(back))
    return np.where(is_book[..., None], cover, case)


def _boxes(
    rng: np.random.Generator, image: np.ndarray, low: float, shelves: int, pitch: float, wide: float
) -> np.ndarray:
    """Pallet racks: cartons with labels between uprights."""
    level = (HEIGHT - np.float32(low)) / np.float32(pitch)
    row = np.clip(whole(level), 0, shelves - 1)
    count = int(8 / wide)
    column = whole(PLACE / np.float32(wide)) % count
    tone, size, hue = rng.random((3, shelves, count), np.float32)[:, row, column]
    x, up = fraction(PLACE / np.float32(wide)), fraction(level)
    colors = [(0.36, 0.24, 0.13), (0.44, 0.30, 0.17), (0.30, 0.19, 0.10), (0.60, 0.58, 0.54), (0.06, 0.16, 0.30)]
    carton = times(ramp(colors, hue), 0.6 + 0.5 * tone + 0.3 * (field(rng, 128, 32, 6, 0.9) - 0.5))
    carton = over(carton, (0.5, 0.4, 0.26), 0.6 * step(0.05, 0.03, np.abs(x - 0.5)))
    label = step(0.0, 0.02, np.minimum(0.16 - np.abs(x - 0.32), 0.12 - np.abs(up - 0.4)))
    lines = step(0.3, 0.5, fraction(x * 60 * (0.5 + tone)))
    carton = over(carton, mix((0.1, 0.1, 0.1), (0.84, 0.84, 0.82), lines), label)
    is_carton = (np.abs(x - 0.5) < 0.42 + 0.06 * size) & (up > 0.12) & (up < 0.55 + 0.4 * size)
    shelf = np.where((up < 0.12)[..., None], rgb((0.56, 0.20, 0.03)), rgb((0.02, 0.02, 0.022)))
    content = np.where(is_carton[..., None], carton, shelf)
    upright = step(0.035, 0.025, np.abs(fraction(PLACE / 0.5) - 0.5) * 0.5) * 1.0
    content = over(content, (0.04, 0.09, 0.26), upright)
    inside = np.minimum(HEIGHT - low, np.float32(low + shelves * pitch) - HEIGHT)
    return over(image, content, step(-0.003, 0.003, inside))


def _walls(rng: np.random.Generator, low: Color, high: Color) -> np.ndarray:
    return times(mix(low, high, field(rng, 32, 16, 8, 0.8)), _shade(rng))


def _office(rng: np.random.Generator) -> np.ndarray:
    image = _walls(rng, (0.42, 0.41, 0.38), (0.60, 0.59, 0.56))
    view = _view(rng, 0.05, 0.55)
    for middle in (0.45, 1.0, 1.55):
        _window(image, view, middle, 0.22, 0.05, 0.55)
    _paint(image, (0.30, 0.17, 0.08), 3.4, 0.16, -0.1, 0.42)
    _paint(image, (0.7, 0.68, 0.62), 3.52, 0.015, 0.1, 0.12)
    _paint(image, _books(rng, -0.1, 0.4, 3), 4.6, 0.5, -0.1, 0.4)
    for middle, color in ((2.6, (0.08, 0.2, 0.36)), (6.2, (0.4, 0.1, 0.06)), (6.8, (0.62, 0.55, 0.2))):
        _paint(image, (0.05, 0.045, 0.04), middle, 0.17, 0.13, 0.40)
        picture = mix((0.8, 0.78, 0.72), color, 1.6 * (field(rng, 32, 16, 6, 0.7) - 0.25))
        _paint(image, picture, middle, 0.15, 0.15, 0.38)
    notes = mix((0.75, 0.75, 0.74), (0.1, 0.15, 0.3), step(0.7, 0.75, field(rng, 256, 64, 3, 0.8)))
    _paint(image, notes, 7.4, 0.32, 0.1, 0.45)
    return _ceiling(rng, image, 0.75, (0.62, 0.61, 0.58), (0.95, 0.95, 0.93), 1.5)


def _library(rng: np.random.Generator) -> np.ndarray:
    image = _walls(rng, (0.30, 0.25, 0.19), (0.42, 0.36, 0.28))
    books = _books(rng, -0.1, 0.8, 6)
    for middle in (0.5, 1.5, 2.5, 3.5, 5.5, 6.5, 7.5):
        _paint(image, books, middle, 0.44, -0.1, 0.8)
    _window(image, _view(rng, 0.1, 0.7), 4.5, 0.25, 0.1, 0.7)
    return _ceiling(rng, image, 1.0, (0.36, 0.25, 0.15), (0.95, 0.85, 0.62), 1.0)


def _warehouse(rng: np.random.Generator) -> np.ndarray:
    image = _walls(rng, (0.20, 0.21, 0.22), (0.34, 0.35, 0.36))
    image = _boxes(rng, image, -0.06, 4, 0.22, 0.2)
    return _ceiling(rng, image, 1.15, (0.20, 0.20, 0.21), (0.95, 0.95, 0.92), 2.0)


def _living_room(rng: np.random.Generator) -> np.ndarray:
    stripes = step(0.4, 0.6, np.abs(fraction(PLACE * 8) - 0.5) * 2)
    image = times(mix((0.34, 0.16, 0.12), (0.46, 0.27, 0.19), stripes), _shade(rng))
    wainscot = mix((0.10, 0.05, 0.025), (0.24, 0.13, 0.07), field(rng, 256, 8, 5, 0.8))
    image = over(image, wainscot, step(0.09, 0.08, HEIGHT))
    _window(image, _view(rng, 0.12, 0.62), 5.0, 0.5, 0.12, 0.62)
    cloth = times(mix((0.30, 0.24, 0.14), (0.52, 0.44, 0.28), field(rng, 256, 2, 5, 0.7)), 0.9)
    for middle in (4.4, 5.6):
        _paint(image, cloth, middle, 0.12, -0.1, 0.7)
    _paint(image, _books(rng, -0.1, 0.5, 4), 1.0, 0.36, -0.1, 0.5)
    landscape = [(0.06, 0.09, 0.05), (0.24, 0.26, 0.12), (0.55, 0.50, 0.36), (0.40, 0.52, 0.64)]
    for middle, half, low, high in ((2.6, 0.26, 0.18, 0.48), (3.4, 0.12, 0.22, 0.5), (7.0, 0.34, 0.16, 0.52)):
        _paint(image, (0.42, 0.30, 0.10), middle, half + 0.025, low - 0.025, high + 0.025)
        share = (HEIGHT - low) / (high - low) + 0.7 * (field(rng, 32, 16, 7, 0.75) - 0.5)
        _paint(image, ramp(landscape, share), middle, half, low, high)
    return _ceiling(rng, image, 0.78, (0.72, 0.70, 0.65), (0.95, 0.88, 0.70), 0.5)


def _workshop(rng: np.random.Generator) -> np.ndarray:
    """Pegboards with tools, bins, a bench's back."""
    image = _walls(rng, (0.34, 0.36, 0.36), (0.48, 0.50, 0.50))
    board = (HEIGHT > 0.16) & (HEIGHT < 0.62) & (WALL % 2 == 0)
    holes = step(0.2, 0.12, np.sqrt((fraction(PLACE * 40) - 0.5) ** 2 + (fraction(HEIGHT * 40) - 0.5) ** 2))
    pegboard = times(mix((0.30, 0.20, 0.11), (0.42, 0.29, 0.17), field(rng, 64, 16, 6, 0.9)), 1 - 0.7 * holes)
    image = np.where(board[..., None], pegboard, image)
    colors = rgb([(0.50, 0.04, 0.03), (0.62, 0.42, 0.03), (0.03, 0.10, 0.32), (0.05, 0.05, 0.05), (0.50, 0.50, 0.50)])
    for k, (place, tone, size, kind) in enumerate(rng.random((64, 4), np.float32)):
        middle = float((k % 2) * 4 + 0.12 + 1.76 * place)
        low = 0.2 + 0.2 * float(tone)
        long = 0.08 + 0.12 * float(size)
        _paint(image, (0.45, 0.45, 0.46), middle, 0.008 + 0.01 * float(kind), low, low + long, 0.003)
        _paint(image, colors[k % 5], middle, 0.014 + 0.01 * float(size), low, low + 0.4 * long, 0.003)
    bins = (HEIGHT > -0.1) & (HEIGHT < 0.40) & (WALL % 2 == 1)
    across, up = fraction(PLACE * 9), fraction(HEIGHT * 12)
    tint = colors[rng.integers(5, size=(8, 72))[np.clip(whole(HEIGHT * 12), 0, 7), whole(PLACE * 9) % 72]]
    front = times(tint, (0.35 + 0.8 * up) * (0.75 + 0.5 * field(rng, 64, 32, 6, 0.9)))
    label = (np.abs(across - 0.5) < 0.22) & (np.abs(up - 0.3) < 0.13)
    front = np.where(label[..., None], rgb((0.8, 0.79, 0.75)), front)
    gap = (np.abs(across - 0.5) > 0.44) | (up > 0.86)
    image = np.where(bins[..., None], np.where(gap[..., None], rgb((0.03, 0.03, 0.03)), front), image)
    _window(image, _view(rng, 0.48, 0.75), 2.9, 0.4, 0.48, 0.75)
    return _ceiling(rng, image, 0.9, (0.46, 0.46, 0.45), (0.95, 0.95, 0.93), 1.5)


def _kitchen(rng: np.random.Generator) -> np.ndarray:
    image = _walls(rng, (0.62, 0.60, 0.54), (0.76, 0.74, 0.68))
    tiles = (HEIGHT < 0.24) & (WALL != 2)
    x, y = PLACE * 14, HEIGHT * 14
    tone = rng.random((16, 112), np.float32)[np.clip(whole(y), 0, 15), whole(x) % 112]
    joint = step(0.04, 0.09, np.minimum(0.5 - np.abs(fraction(x) - 0.5), 0.5 - np.abs(fraction(y) - 0.5)))
    glazed = times(mix((0.20, 0.36, 0.38), (0.50, 0.64, 0.64), tone), 0.45 + 0.55 * joint)
    image = np.where(tiles[..., None], times(glazed, 0.75 + 0.5 * field(rng, 32, 16, 7, 0.8)), image)
    grain = field(rng, 128, 8, 6, 0.8)
    cupboards = (HEIGHT > 0.26) & (HEIGHT < 0.62) & (WALL % 2 == 0)
    door = np.minimum(0.5 - np.abs(fraction(PLACE * 3) - 0.5), np.minimum(HEIGHT - 0.26, 0.62 - HEIGHT) * 3)
    light = 0.35 + 0.65 * step(0.0, 0.03, door) - 0.15 * step(0.02, 0.0, np.abs(door - 0.13))
    front = times(mix((0.34, 0.20, 0.10), (0.56, 0.38, 0.21), grain), light)
    knob = step(0.02, 0.015, np.sqrt((fraction(PLACE * 3) - 0.85) ** 2 + (3 * (HEIGHT - 0.32)) ** 2))
    image = np.where(cupboards[..., None], over(front, (0.7, 0.7, 0.7), knob), image)
    _window(image, _view(rng, 0.26, 0.62), 3.0, 0.4, 0.26, 0.62)
    _paint(image, mix((0.50, 0.50, 0.50), (0.72, 0.72, 0.71), grain), 5.0, 0.3, -0.1, 0.66)
    _paint(image, (0.12, 0.12, 0.12), 4.76, 0.015, 0.1, 0.3)
    colors = [(0.5, 0.05, 0.04), (0.6, 0.5, 0.2), (0.1, 0.2, 0.08), (0.5, 0.25, 0.06), (0.05, 0.05, 0.06)]
    for middle, color in zip((6.7, 7.0, 7.2, 1.2, 0.4), colors, strict=True):
        _paint(image, mix(color, (0.9, 0.9, 0.88), 0.8 * (grain - 0.3)), middle, 0.06, -0.1, 0.14)
    return _ceiling(rng, image, 0.72, (0.72, 0.71, 0.68), (0.95, 0.93, 0.86), 1.0)


RECIPES = (_office, _library, _warehouse, _living_room, _workshop, _kitchen)
