"""Textures by name: a seeded procedural pool, and the user's own photographs."""

import glob
from fnmatch import fnmatchcase
from functools import lru_cache
from pathlib import Path

import numpy as np
from PIL import Image

from evslip import patterns
from evslip.errors import ConfigError

PER_FAMILY = 6
IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg", ".webp", ".bmp", ".tif", ".tiff")
MAX_SIDE_PX = 16384
"""Larger photographs are refused: decoding one would need gigabytes."""


def pool() -> tuple[str, ...]:
    """Names of the built-in textures, such as "wood-0"."""
    return tuple(f"{family}-{number}" for family in patterns.FAMILIES for number in range(PER_FAMILY))


def expand(value: object, is_background: bool = False) -> object:
    """A pattern with "*" becomes the names of the pool that match it, or else the image files that match it as a
    path, sorted; anything else stays as it is. Raises ConfigError where a pattern matches nothing.
    """
    if not isinstance(value, str) or "*" not in value:
        return value
    names = tuple(name for name in pool() if fnmatchcase(name, value))
    if names:
        return names
    found = glob.glob(str(Path(value).expanduser()), recursive=True)  # noqa: PTH207 (Path.glob takes no absolute pattern)
    files = tuple(sorted(path for path in found if path.lower().endswith(IMAGE_SUFFIXES)))
    if not files:
        families = ", ".join(patterns.FAMILIES)
        raise ConfigError(
            f"texture: {value!r} matches no image file and none of the pool: {families}, each -0 to -{PER_FAMILY - 1}"
        )
    return files


def check(name: str) -> None:
    """Raise ConfigError unless a texture of the pool or a file has this name."""
    if name not in pool() and not Path(name).expanduser().is_file():
        raise ConfigError(f"texture: {name!r} is neither a file nor one of the pool ({', '.join(pool()[:3])}, ...)")


@lru_cache(maxsize=12)
def load(name: str) -> np.ndarray:
    """Linear RGB of a texture, read-only float32 of shape (512, 512, 3) in [0, 1].

    `name` is one of pool() or the path of an image, which is scaled to 512 x 512. Raises ConfigError.
    """
    if name in pool():
        family, _, number = name.rpartition("-")
        image = patterns.make(family, int(number))
    else:
        image = _photograph(name)
    image.flags.writeable = False
    return image


def _photograph(name: str) -> np.ndarray:
    check(name)
    try:
        with Image.open(Path(name).expanduser()) as picture:
            if max(picture.size) > MAX_SIDE_PX:
                raise ConfigError(
                    f"texture: {name}: {picture.size} pixels is too large, expected at most {MAX_SIDE_PX}"
                )
            picture.draft("RGB", (2 * patterns.SIZE, 2 * patterns.SIZE))
            pixels = picture.convert("RGB").resize((patterns.SIZE, patterns.SIZE), Image.Resampling.BOX, reducing_gap=2)
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        raise ConfigError(f"texture: {name}: cannot be read as an image: {error}") from None
    return srgb_to_linear(np.arange(256) / 255.0).astype(np.float32)[np.asarray(pixels)]


def srgb_to_linear(encoded: np.ndarray) -> np.ndarray:
    """Inverse of the sRGB transfer function (IEC 61966-2-1); values in [0, 1]."""
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def linear_to_srgb(linear: np.ndarray) -> np.ndarray:
    """The sRGB transfer function (IEC 61966-2-1); values in [0, 1]."""
    linear = np.clip(linear, 0.0, 1.0)
    return np.where(linear <= 0.0031308, linear * 12.92, 1.055 * linear ** (1 / 2.4) - 0.055)
