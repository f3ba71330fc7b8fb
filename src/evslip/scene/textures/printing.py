"""Print on packages, labels and pages, apart from single words."""

import numpy as np

from evslip.scene.textures.canvas import SIZE, Color, rgb, step
from evslip.scene.textures.lettering import fit, length, write

SYLLABLES = (
    "ka", "lo", "mi", "ter", "sa", "ne", "bur", "vi", "tan", "do", "re", "mas", "ol", "pin", "cor",
    "fe", "lu", "gra", "ven", "ti", "mor", "es", "ham", "bil", "so", "quin", "dra", "wex", "jo", "py",
)  # fmt: skip
DIGITS = "0123456789"
BLACK: Color = (0.025, 0.022, 0.02)
"""Printer's ink."""
Area = tuple[float, float, float, float]
"""Left, top, right and bottom in texels."""
AXIS = np.arange(SIZE, dtype=np.float32)


def blank() -> np.ndarray:
    """A sheet without ink: share of ink per texel."""
    return np.zeros((SIZE, SIZE), np.float32)


def word(rng: np.random.Generator, syllables: int = 2) -> str:
    """An invented word in small letters."""
    return "".join(SYLLABLES[int(k)] for k in rng.integers(len(SYLLABLES), size=syllables))


def number(rng: np.random.Generator, digits: int) -> str:
    return "".join(DIGITS[int(k)] for k in rng.integers(10, size=digits))


def paragraph(ink: np.ndarray, rng: np.random.Generator, area: Area, height: float, leading: float = 1.9) -> None:
    """Lines of small invented text that fill (left, top, right, bottom), the last line of a paragraph shorter."""
    left, top, right, bottom = area
    while top + height < bottom:
        x = left
        end = right if rng.random() < 0.8 else left + (right - left) * (0.3 + 0.5 * rng.random())
        while True:
            text = word(rng, int(rng.integers(1, 4)))
            if rng.random() < 0.15:
                text = text.capitalize()
            if x + length(text, height, 0.13) > end:
                break
            x = write(ink, text, x, top, height, 0.13) + 0.45 * height
        top += leading * height


def bars(ink: np.ndarray, rng: np.random.Generator, left: int, top: int, width: int, height: int) -> None:
    """A barcode with its number below."""
    unit = max(1, width // 95)
    x, end = left, left + width
    while x < end:
        bar, gap = (int(k) * unit for k in rng.integers(1, 4, size=2))
        ink[top : top + height, x : min(x + bar, end)] = 1
        x += bar + gap
    text = number(rng, 12)
    high = fit(text, 0.9 * width, 0.16 * height)
    write(ink, text, left + 0.05 * width, top + height + 0.4 * high, high)


def matrix_code(ink: np.ndarray, rng: np.random.Generator, left: int, top: int, side: int, modules: int = 21) -> None:
    """A two-dimensional code with three finder squares."""
    code = rng.random((modules, modules)) < 0.5
    for row, column in ((0, 0), (0, modules - 7), (modules - 7, 0)):
        code[max(row - 1, 0) : row + 8, max(column - 1, 0) : column + 8] = False
        code[row : row + 7, column : column + 7] = True
        code[row + 1 : row + 6, column + 1 : column + 6] = False
        code[row + 2 : row + 5, column + 2 : column + 5] = True
    unit = side // modules
    ink[top : top + unit * modules, left : left + unit * modules] = np.repeat(np.repeat(code, unit, 0), unit, 1)


def table(ink: np.ndarray, rng: np.random.Generator, area: tuple[int, int, int, int], rows: int) -> None:
    """A framed table of names and figures, as of nutrition facts."""
    left, top, right, bottom = area
    frame(ink, area, 2)
    high = (bottom - top) / rows
    for row in range(rows):
        y = round(top + row * high)
        ink[y : y + (3 if row == 1 else 1), left:right] = 1
        write(ink, word(rng).capitalize(), left + 6, y + 0.25 * high, 0.5 * high)
        text = number(rng, int(rng.integers(1, 4))) + " g"
        write(ink, text, right - 6 - length(text, 0.5 * high), y + 0.25 * high, 0.5 * high)


def frame(ink: np.ndarray, area: tuple[int, int, int, int], width: int) -> None:
    """The outline of (left, top, right, bottom)."""
    left, top, right, bottom = area
    ink[top : top + width, left:right] = ink[bottom - width : bottom, left:right] = 1
    ink[top:bottom, left : left + width] = ink[top:bottom, right - width : right] = 1


def disc(x: float, y: float, radius: float, soft: float = 1.0) -> np.ndarray:
    """A filled circle, 1 inside, of shape (SIZE, SIZE)."""
    distance = np.sqrt((AXIS - np.float32(x)) ** 2 + (AXIS[:, None] - np.float32(y)) ** 2)
    return step(radius + soft, radius - soft, distance)


def ball(image: np.ndarray, x: float, y: float, radius: float, color: Color) -> np.ndarray:
    """The image with a round fruit on it, lit from the upper left, over a soft shadow."""
    dx, dy = (AXIS - np.float32(x)) / np.float32(radius), (AXIS[:, None] - np.float32(y)) / np.float32(radius)
    shadow = disc(x + 0.12 * radius, y + 0.15 * radius, radius, 0.15 * radius)
    image = image * (1 - np.float32(0.45) * shadow)[..., None]
    bulge = np.sqrt(np.clip(1 - dx * dx - dy * dy, 0, 1))
    facing = bulge * np.float32(0.7) - dx * np.float32(0.45) - dy * np.float32(0.5)
    shade = np.float32(0.25) + np.float32(0.75) * np.clip(facing, 0, 1)
    glint = step(0.3, 0.0, np.sqrt((dx + np.float32(0.4)) ** 2 + (dy + np.float32(0.45)) ** 2)) * np.float32(0.6)
    lit = rgb(color) * shade[..., None] + glint[..., None]
    return image + (lit - image) * disc(x, y, radius)[..., None]


def centred(ink: np.ndarray, text: str, top: float, most: float, weight: float, width: float = 0.88) -> float:
    """A word in the middle, as high as fits into `width` of the image, `most` at most; returns the line below."""
    height = fit(text, width * SIZE, most, weight)
    write(ink, text, (SIZE - length(text, height, weight)) / 2 + height * weight / 2, top, height, weight)
    return top + height * (1.35 + weight)
