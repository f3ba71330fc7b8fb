"""Recipes of the procedural textures: eight families, each a pure function of (seed, number).

Only additions, products, comparisons and square roots are used, whose results IEEE 754 fixes to the last bit, so that
a texture has the same bytes on every machine. All of them tile.
"""

from collections.abc import Callable

import numpy as np

from evslip.seeds import generator

SIZE = 512
"""Texels along each side of a texture."""
Recipe = Callable[[np.random.Generator, int], np.ndarray]
"""(generator, number within the family) -> linear RGB of shape (SIZE, SIZE, 3)."""

_AXIS = (np.arange(SIZE) + 0.5) / SIZE
_V, _U = np.meshgrid(_AXIS, _AXIS, indexing="ij")


def make(family: str, number: int) -> np.ndarray:
    """Linear RGB of one texture, float32 of shape (SIZE, SIZE, 3); multiples of 1/65535 in [0.01, 0.95]."""
    image = FAMILIES[family](generator(0, "train", number, f"texture {family}"), number)
    return (np.floor(np.clip(image, 0.01, 0.95) * 65535.0 + 0.5) / 65535.0).astype(np.float32)


def noise(rng: np.random.Generator, across: int, down: int) -> np.ndarray:
    """Smooth noise in [0, 1] with `across` x `down` random values, quintic interpolation."""
    lattice = rng.random((down, across))
    rows, row_share = _lattice_steps(down)
    columns, column_share = _lattice_steps(across)
    lines = lattice[rows] + (lattice[(rows + 1) % down] - lattice[rows]) * row_share[:, None]
    return lines[:, columns] + (lines[:, (columns + 1) % across] - lines[:, columns]) * column_share


def fractal(
    rng: np.random.Generator, across: int, down: int, octaves: int, gain: float = 0.5, spread: float = 1.0
) -> np.ndarray:
    """Sum of noises, each twice as fine and `gain` as strong as the one before; mean about 0.5, most within [0, 1]."""
    total, weight, norm = np.zeros((SIZE, SIZE)), 1.0, 0.0
    for octave in range(octaves):
        total += weight * (noise(rng, min(across << octave, SIZE), min(down << octave, SIZE)) - 0.5)
        norm, weight = norm + weight, weight * gain
    return 0.5 + spread * total / norm * (1.0 + 0.6 * gain)


def step(low: float, high: float, value: np.ndarray) -> np.ndarray:
    """0 below `low`, 1 above `high`, smooth between; `low` may exceed `high`."""
    share = np.clip((value - low) / (high - low), 0.0, 1.0)
    return share * share * (3.0 - 2.0 * share)


def mix(dark: tuple[float, ...] | np.ndarray, bright: tuple[float, ...] | np.ndarray, share: np.ndarray) -> np.ndarray:
    """Between two colours (or images), pixel by pixel."""
    dark, bright = np.asarray(dark, np.float64), np.asarray(bright, np.float64)
    return dark + (bright - dark) * np.clip(share, 0.0, 1.0)[..., None]


def shift(image: np.ndarray, du: np.ndarray, dv: np.ndarray) -> np.ndarray:
    """The image looked up at displaced places, in shares of its side; wraps."""
    x, y = (_U + du) * SIZE - 0.5, (_V + dv) * SIZE - 0.5
    x0, y0 = np.floor(x), np.floor(y)
    fx, fy = x - x0, y - y0
    i, j = x0.astype(int) % SIZE, y0.astype(int) % SIZE
    i1, j1 = (i + 1) % SIZE, (j + 1) % SIZE
    upper = image[j, i] + (image[j, i1] - image[j, i]) * fx
    return upper + (image[j1, i] + (image[j1, i1] - image[j1, i]) * fx - upper) * fy


def cells(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Voronoi cells of count x count jittered points: nearest, second nearest distance (in cells), random value."""
    points = rng.random((count, count, 2))
    values = rng.random((count, count))
    x, y = _U * count, _V * count
    i, j = np.floor(x).astype(int), np.floor(y).astype(int)
    near, second, label = np.full_like(x, 9.0), np.full_like(x, 9.0), np.zeros_like(x)
    for dj in (-1, 0, 1):
        for di in (-1, 0, 1):
            cell = (j + dj) % count, (i + di) % count
            dx, dy = i + di + points[cell][..., 0] - x, j + dj + points[cell][..., 1] - y
            distance = np.sqrt(dx * dx + dy * dy)
            second = np.minimum(second, np.maximum(distance, near))
            label = np.where(distance < near, values[cell], label)
            near = np.minimum(near, distance)
    return near, second, label


def wood(rng: np.random.Generator, number: int) -> np.ndarray:
    """Planks with rings, fine grain and pores."""
    dark, bright = _WOODS[number]
    planks = (1, 4, 3, 5, 2, 6)[number]
    plank = np.floor(_U * planks).astype(int)
    tone, offset = rng.random(planks)[plank], rng.random(planks)[plank]
    sway = fractal(rng, 3, 1, 4)
    rings = (sway * (4.0 + 3.0 * number % 5) + _U * 2.0 * planks + offset * 7.0) * 2.0
    rings = np.abs(rings - np.floor(rings) - 0.5) * 2.0
    fibres = fractal(rng, 128, 4, 3, 0.7)
    pores = step(0.68, 0.8, fractal(rng, 64, 8, 3, 0.8, 1.4))
    share = 0.45 * rings * rings + 0.55 * fibres + 0.5 * (tone - 0.5)
    image = mix(dark, bright, share) * (1.0 - 0.45 * pores)[..., None]
    if planks > 1:
        edge = np.abs(_U * planks - np.floor(_U * planks + 0.5)) / planks
        image *= (0.25 + 0.75 * step(0.0005, 0.004, edge))[..., None]
    return image


def stone(rng: np.random.Generator, number: int) -> np.ndarray:
    """Granite, marble, slabs and pebbles."""
    base, vein = _STONES[number]
    rough = fractal(rng, 8, 8, 6, 0.7)
    if number % 3 == 0:
        _, _, grain = cells(rng, 64)
        return mix(base, vein, 0.65 * grain * grain + 0.5 * (rough - 0.3))
    if number % 3 == 1:
        sway = fractal(rng, 3, 3, 5, 0.6)
        ridge = 1.0 - np.abs(shift(fractal(rng, 4, 4, 5), (sway - 0.5) * 0.3, (sway - 0.5) * 0.2) - 0.5) * 2.0
        return mix(base, vein, step(0.82, 1.0, ridge) * 0.9 + 0.35 * (rough - 0.4))
    near, second, tone = cells(rng, 7 + number)
    joint = step(0.03, 0.14, second - near + 0.05 * (rough - 0.5))
    image = mix(base, vein, 0.7 * tone + 0.6 * (rough - 0.5)) * (1.0 - 0.35 * near * near)[..., None]
    return image * (0.25 + 0.75 * joint)[..., None]


def brick(rng: np.random.Generator, number: int) -> np.ndarray:
    """Courses of bricks in mortar."""
    colour, mortar = _BRICKS[number]
    across, down = ((4, 8), (6, 12), (3, 6), (5, 10), (8, 16), (4, 12))[number]
    rough = fractal(rng, 32, 32, 4, 0.7)
    wobble = (fractal(rng, 12, 12, 3) - 0.5) * 0.012
    v = (_V + wobble) * down
    course = np.floor(v).astype(int) % down
    u = (_U + wobble) * across + 0.5 * (course % 2)
    column = np.floor(u).astype(int) % across
    tone = rng.random((down, across))[course, column]
    gap = 0.04 + 0.02 * rng.random()
    edge = np.minimum(np.abs(u - np.floor(u + 0.5)) * down / across, np.abs(v - np.floor(v + 0.5)))
    face = step(gap, gap + 0.07, edge)
    bricks = np.asarray(colour) * (0.55 + 0.6 * tone + 0.7 * (rough - 0.5))[..., None]
    lit = 1.0 + 0.35 * (step(0.86, 0.95, v - np.floor(v)) - step(0.14, 0.05, v - np.floor(v)))
    joints = np.asarray(mortar) * (0.75 + 0.5 * (rough - 0.5))[..., None]
    return joints + (bricks * lit[..., None] - joints) * face[..., None]


def weave(rng: np.random.Generator, number: int) -> np.ndarray:
    """Cloth and wicker: threads that go over and under each other."""
    warp, weft = _CLOTHS[number]
    threads = (64, 32, 48, 16, 60, 24)[number]
    over = (1, 1, 2, 1, 3, 2)[number]
    x, y = _U * threads, _V * threads
    i, j = np.floor(x).astype(int), np.floor(y).astype(int)
    top = ((i + j) // over) % 2 == 0
    profile = 1.0 - 4.0 * np.where(top, x - i - 0.5, y - j - 0.5) ** 2
    along = 1.0 - 1.6 * np.where(top, y - j - 0.5, x - i - 0.5) ** 2
    tone = np.where(top, rng.random(threads)[i % threads], rng.random(threads)[j % threads])
    fluff = fractal(rng, 128, 128, 2, 0.8)
    stain = fractal(rng, 4, 4, 4)
    image = np.where(top[..., None], np.asarray(warp), np.asarray(weft))
    return (
        image
        * ((0.3 + 0.7 * profile * along) * (0.7 + 0.3 * tone + 0.5 * (fluff - 0.5) + 0.4 * (stain - 0.5)))[..., None]
    )


def cardboard(rng: np.random.Generator, number: int) -> np.ndarray:
    """Packages: fibrous board with printed words, bars and boxes."""
    board, ink = _BOARDS[number]
    fibre = fractal(rng, 64, 32, 4, 0.8)
    flute = _V * 64.0
    flute = np.abs(flute - np.floor(flute) - 0.5) * 2.0
    image = np.asarray(board) * (0.86 + 0.3 * (fibre - 0.5) + 0.05 * flute)[..., None]
    return mix(image, ink, _print(rng, number) * (0.8 + 0.4 * (fibre - 0.5)))


def speckle(rng: np.random.Generator, number: int) -> np.ndarray:
    """Fractal noise from soft clouds to fine grain."""
    dark, bright = _NOISES[number]
    base, octaves, gain = ((4, 7, 0.75), (2, 8, 0.6), (64, 3, 0.8), (8, 6, 0.9), (16, 5, 0.7), (32, 4, 1.0))[number]
    share = fractal(rng, base, base, octaves, gain, 1.5)
    tint = fractal(rng, 3, 3, 3)
    return mix(dark, bright, share) * (0.8 + 0.4 * tint)[..., None]


def gradient(rng: np.random.Generator, number: int) -> np.ndarray:
    """Soft transitions as of a lit wall or sky, with a little dust."""
    dark, bright = _GRADIENTS[number]
    ramp = np.abs((_V, _U, _U + _V, _V, _U - _V, _V)[number] % 1.0 - 0.5) * 2.0
    blobs = fractal(rng, 2, 2, 3 + number % 3, 0.5, 1.3)
    dust = fractal(rng, 128, 128, 2, 0.8)
    return mix(dark, bright, step(0.0, 1.0, 0.55 * ramp + 0.45 * blobs)) * (0.94 + 0.12 * dust)[..., None]


def tile(rng: np.random.Generator, number: int) -> np.ndarray:
    """Ceramic tiles, checkers and plates with grout."""
    first, second = _TILES[number]
    count = (8, 4, 6, 10, 4, 12)[number]
    x, y = _U * count, _V * count
    if number % 3 == 2:
        x, y = x + y, x - y
    i, j = np.floor(x).astype(int), np.floor(y).astype(int)
    odd = ((i + j) % 2).astype(float)
    tone = rng.random((count, count))[j % count, i % count]
    share = odd if number % 2 == 0 else step(0.3, 0.7, tone)
    glaze = fractal(rng, 8, 8, 5, 0.6)
    edge = np.minimum(np.abs(x - np.floor(x + 0.5)), np.abs(y - np.floor(y + 0.5)))
    image = mix(first, second, share) * (0.8 + 0.25 * tone + 0.4 * (glaze - 0.5))[..., None]
    grout = step(0.02, 0.05, edge)
    return image * grout[..., None] + 0.18 * (1.0 - grout)[..., None]


def _lattice_steps(count: int) -> tuple[np.ndarray, np.ndarray]:
    place = _AXIS * count - 0.5
    low = np.floor(place)
    share = place - low
    return low.astype(int) % count, share * share * share * (share * (share * 6.0 - 15.0) + 10.0)


def _print(rng: np.random.Generator, number: int) -> np.ndarray:
    """What is printed on a package: share of ink per texel."""
    ink = np.zeros((SIZE, SIZE))
    words = _WORDS[number]
    row = 24
    for word in words:
        scale = min(14, (SIZE - 48) // (6 * len(word)))
        if row + 7 * scale > SIZE - 150:
            break
        _write(ink, word, row, int(rng.integers(20, SIZE - 20 - 6 * scale * len(word))), scale)
        row += 7 * scale + int(rng.integers(18, 40))
    left = int(rng.integers(24, 200))
    for _ in range(26):
        width = int(rng.integers(2, 7))
        ink[SIZE - 120 : SIZE - 40, left : left + width] = 1.0
        left += width + int(rng.integers(2, 7))
    ink[SIZE - 130 : SIZE - 122, 20 : SIZE - 20] = 1.0
    if number % 2:
        ink[8:14, 8 : SIZE - 8] = ink[SIZE - 14 : SIZE - 8, 8 : SIZE - 8] = 1.0
        ink[8 : SIZE - 8, 8:14] = ink[8 : SIZE - 8, SIZE - 14 : SIZE - 8] = 1.0
    soft = ink * 0.5 + (np.roll(ink, 1, 0) + np.roll(ink, -1, 0)) * 0.25
    return soft * 0.5 + (np.roll(soft, 1, 1) + np.roll(soft, -1, 1)) * 0.25


def _write(ink: np.ndarray, word: str, top: int, left: int, scale: int) -> None:
    for place, letter in enumerate(word):
        for line, bits in enumerate(_LETTERS.get(letter, ())):
            for column in range(5):
                if bits >> (4 - column) & 1:
                    x = left + (6 * place + column) * scale
                    ink[top + line * scale : top + (line + 1) * scale, x : x + scale] = 1.0


_LETTERS = {
    "A": (14, 17, 17, 31, 17, 17, 17),
    "B": (30, 17, 17, 30, 17, 17, 30),
    "C": (15, 16, 16, 16, 16, 16, 15),
    "D": (30, 17, 17, 17, 17, 17, 30),
    "E": (31, 16, 16, 30, 16, 16, 31),
    "F": (31, 16, 16, 30, 16, 16, 16),
    "G": (15, 16, 16, 19, 17, 17, 15),
    "H": (17, 17, 17, 31, 17, 17, 17),
    "I": (14, 4, 4, 4, 4, 4, 14),
    "K": (17, 18, 20, 24, 20, 18, 17),
    "L": (16, 16, 16, 16, 16, 16, 31),
    "M": (17, 27, 21, 21, 17, 17, 17),
    "N": (17, 25, 21, 21, 19, 17, 17),
    "O": (14, 17, 17, 17, 17, 17, 14),
    "P": (30, 17, 17, 30, 16, 16, 16),
    "R": (30, 17, 17, 30, 20, 18, 17),
    "S": (15, 16, 16, 14, 1, 1, 30),
    "T": (31, 4, 4, 4, 4, 4, 4),
    "U": (17, 17, 17, 17, 17, 17, 14),
    "5": (31, 16, 30, 1, 1, 17, 14),
    "0": (14, 17, 19, 21, 25, 17, 14),
}
_WORDS = (
    ("FRAGILE", "THIS SIDE UP", "NET 500 G"),
    ("RICE", "LONG GRAIN", "500 G"),
    ("TEA", "GREEN LEAF", "50 BAGS"),
    ("CRISP", "SALTED", "MADE OF CORN"),
    ("PARTS", "LOT 5005", "HANDLE FLAT"),
    ("SOAP", "PURE OIL", "MILD"),
)
_WOODS = (
    ((0.16, 0.08, 0.035), (0.55, 0.36, 0.19)),
    ((0.05, 0.025, 0.012), (0.2, 0.1, 0.05)),
    ((0.35, 0.25, 0.15), (0.78, 0.64, 0.46)),
    ((0.1, 0.09, 0.08), (0.4, 0.37, 0.33)),
    ((0.22, 0.08, 0.03), (0.5, 0.22, 0.1)),
    ((0.3, 0.19, 0.09), (0.62, 0.44, 0.24)),
)
_STONES = (
    ((0.1, 0.1, 0.11), (0.75, 0.72, 0.7)),
    ((0.72, 0.71, 0.68), (0.18, 0.17, 0.16)),
    ((0.12, 0.12, 0.13), (0.42, 0.4, 0.36)),
    ((0.02, 0.02, 0.025), (0.3, 0.28, 0.28)),
    ((0.06, 0.08, 0.07), (0.5, 0.55, 0.5)),
    ((0.3, 0.25, 0.18), (0.7, 0.62, 0.5)),
)
_BRICKS = (
    ((0.4, 0.13, 0.07), (0.55, 0.52, 0.47)),
    ((0.7, 0.67, 0.6), (0.3, 0.28, 0.26)),
    ((0.2, 0.17, 0.15), (0.45, 0.44, 0.42)),
    ((0.5, 0.25, 0.12), (0.2, 0.19, 0.18)),
    ((0.3, 0.08, 0.05), (0.7, 0.68, 0.63)),
    ((0.1, 0.1, 0.1), (0.3, 0.29, 0.28)),
)
_CLOTHS = (
    ((0.55, 0.5, 0.42), (0.48, 0.43, 0.34)),
    ((0.05, 0.08, 0.2), (0.3, 0.35, 0.5)),
    ((0.1, 0.1, 0.1), (0.16, 0.15, 0.14)),
    ((0.5, 0.35, 0.18), (0.42, 0.27, 0.12)),
    ((0.75, 0.73, 0.7), (0.6, 0.58, 0.55)),
    ((0.35, 0.05, 0.05), (0.6, 0.5, 0.4)),
)
_BOARDS = (
    ((0.42, 0.28, 0.16), (0.03, 0.025, 0.02)),
    ((0.8, 0.78, 0.72), (0.5, 0.05, 0.04)),
    ((0.1, 0.25, 0.12), (0.75, 0.7, 0.5)),
    ((0.6, 0.08, 0.05), (0.85, 0.75, 0.2)),
    ((0.3, 0.2, 0.11), (0.6, 0.58, 0.55)),
    ((0.75, 0.8, 0.85), (0.05, 0.1, 0.35)),
)
_NOISES = (
    ((0.12, 0.11, 0.1), (0.6, 0.58, 0.55)),
    ((0.2, 0.24, 0.3), (0.75, 0.75, 0.72)),
    ((0.05, 0.05, 0.05), (0.35, 0.34, 0.32)),
    ((0.25, 0.2, 0.12), (0.8, 0.72, 0.55)),
    ((0.03, 0.06, 0.03), (0.3, 0.42, 0.16)),
    ((0.35, 0.34, 0.33), (0.9, 0.89, 0.87)),
)
_GRADIENTS = (
    ((0.2, 0.22, 0.26), (0.75, 0.77, 0.8)),
    ((0.06, 0.05, 0.05), (0.45, 0.4, 0.36)),
    ((0.35, 0.28, 0.2), (0.85, 0.8, 0.7)),
    ((0.05, 0.1, 0.25), (0.5, 0.65, 0.8)),
    ((0.02, 0.02, 0.02), (0.18, 0.17, 0.16)),
    ((0.5, 0.48, 0.46), (0.9, 0.89, 0.86)),
)
_TILES = (
    ((0.05, 0.05, 0.055), (0.8, 0.79, 0.76)),
    ((0.35, 0.42, 0.45), (0.6, 0.66, 0.68)),
    ((0.25, 0.08, 0.06), (0.65, 0.55, 0.4)),
    ((0.02, 0.12, 0.2), (0.3, 0.5, 0.6)),
    ((0.3, 0.3, 0.29), (0.42, 0.41, 0.4)),
    ((0.7, 0.7, 0.68), (0.85, 0.84, 0.8)),
)
FAMILIES: dict[str, Recipe] = {
    "wood": wood,
    "stone": stone,
    "brick": brick,
    "weave": weave,
    "cardboard": cardboard,
    "noise": speckle,
    "gradient": gradient,
    "tile": tile,
}
