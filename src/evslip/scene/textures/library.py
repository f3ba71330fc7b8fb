"""Textures by name: a seeded procedural pool, and the user's own images."""

import warnings
from fnmatch import fnmatchcase
from functools import lru_cache

import numpy as np
from PIL import Image, ImageOps

from evslip.scene.textures import patterns
from evslip.scene.textures.canvas import SIZE
from evslip.scene.textures.matching import files_in, matching_files
from evslip.scene.textures.panoramas.panorama import COLUMNS, ROWS
from evslip.utils.errors import ConfigError
from evslip.utils.files import named, stamp_of

IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg", ".webp", ".bmp", ".tif", ".tiff")
MAX_PIXELS = Image.MAX_IMAGE_PIXELS or 2**26
"""Larger images are refused: decoding one would need gigabytes."""
LONGEST_NAME = 4096
SIXTEEN_BITS = ("I;16", "I;16B", "I;16L", "I;16N", "I")


def pool(is_background: bool = False) -> tuple[str, ...]:
    """Names of the built-in textures, such as "wood-0"; with the panoramas, which only a background can show."""
    families = _families(is_background).items()
    return tuple(f"{family}-{number}" for family, recipes in families for number in range(len(recipes)))


def expand(value: object, is_background: bool = False) -> object:
    """Names that a texture's value stands for: one name as it is, or those to draw from.

    A pattern with "*" stands for the names of the pool that match it, or else for the image files that match it as a
    path; a folder for the images in it; a list for what its entries stand for. Sorted, the pool in its own order.
    Raises ConfigError for what matches nothing, exists nowhere, or is a panorama where none can be.
    """
    if isinstance(value, tuple):
        parts = [expand(entry, is_background) for entry in value]
        return tuple(name for part in parts for name in (part if isinstance(part, tuple) else (part,)))
    if not isinstance(value, str):
        return value
    if len(value) > LONGEST_NAME:
        raise ConfigError(f"texture: {value[:40]!r}... has {len(value):,} letters; expected a name or a path")
    if value in pool(True):
        if value not in pool(is_background):
            raise ConfigError(f"texture: {value!r} is a panorama, which only background.texture can show")
        return value
    path, kind = named(value)
    families = _families(is_background).items()
    known = ", ".join(f"{family}-0 to -{len(recipes) - 1}" for family, recipes in families)
    if "*" in value:
        names = tuple(name for name in pool(is_background) if fnmatchcase(name, value))
        found = matching_files(str(path)) if not names else []
    elif kind == "folder":
        names, found = (), files_in(path)
    elif kind == "file":
        return value
    else:
        raise ConfigError(f"texture: {value[:200]!r} is neither a file, a folder nor one of the pool: {known}")
    files = tuple(sorted(name for name in found if name.lower().endswith(IMAGE_SUFFIXES)))
    if not names and not files:
        kinds = ", ".join(IMAGE_SUFFIXES)
        raise ConfigError(f"texture: {value!r} matches no image file ({kinds}) and none of the pool: {known}")
    return names or files


def _families(is_background: bool) -> dict[str, tuple[patterns.Recipe, ...]]:
    return patterns.FAMILIES if is_background else patterns.MATERIALS


def load(name: str, is_background: bool = False) -> np.ndarray:
    """Linear RGB of a texture, read-only float32 of shape (512, 512, 3) in [0, 1], or of a panorama, (1024, 2048, 3).

    `name` is one of pool(), or the path of an image: scaled to 512 x 512, or, as a background exactly twice as wide as
    high, to a panorama. Raises ConfigError.
    """
    expand(name, is_background)
    stamp = None if name in pool(True) else stamp_of(name)
    return _panorama(name, stamp) if is_background and _is_panorama(name) else _square(name, stamp)


def is_panorama(image: np.ndarray) -> bool:
    """Whether an image covers the whole sphere instead of being repeated around it."""
    return image.shape[1] == 2 * image.shape[0]


@lru_cache(maxsize=16)
def _square(name: str, stamp: tuple[int, int] | None) -> np.ndarray:
    del stamp  # of an image file, which may be another one the next time
    return _loaded(name, (SIZE, SIZE))


@lru_cache(maxsize=2)  # 25 MB each
def _panorama(name: str, stamp: tuple[int, int] | None) -> np.ndarray:
    del stamp
    return _loaded(name, (COLUMNS, ROWS))


def _loaded(name: str, size: tuple[int, int]) -> np.ndarray:
    family, _, number = name.rpartition("-")
    image = patterns.make(family, int(number)) if name in pool(True) else _photograph(name, size)
    image.flags.writeable = False
    return image


def _is_panorama(name: str) -> bool:
    if name in pool(True):
        return name not in pool()
    with _opened(name) as picture:
        return picture.width == 2 * picture.height


def _opened(name: str) -> Image.Image:
    with warnings.catch_warnings():
        warnings.simplefilter("error", Image.DecompressionBombWarning)
        try:
            return Image.open(named(name)[0])
        except (Image.DecompressionBombWarning, Image.DecompressionBombError):
            raise ConfigError(
                f"texture: {name}: is larger than {MAX_PIXELS / 1e6:.0f} million pixels; "
                "make it smaller, 2048 along its longer side will do"
            ) from None
        except (OSError, ValueError, SyntaxError) as error:
            raise ConfigError(f"texture: {name}: cannot be read as an image: {error}") from None


def _photograph(name: str, size: tuple[int, int]) -> np.ndarray:
    """An image file, decoded from sRGB and scaled in linear light."""
    with _opened(name) as picture:
        try:
            channels = _channels(picture, size)
        except (OSError, ValueError, SyntaxError, MemoryError) as error:
            raise ConfigError(f"texture: {name}: cannot be read as an image: {error}") from None
    scaled = [Image.fromarray(channel).resize(size, Image.Resampling.BILINEAR) for channel in channels]
    return np.clip(np.stack([np.asarray(channel) for channel in scaled], -1), 0, 1)


def _channels(picture: Image.Image, size: tuple[int, int]) -> list[np.ndarray]:
    """Linear red, green and blue, float32 of shape (rows, columns), not much larger than needed."""
    picture.draft("RGB", (4 * size[0], 4 * size[1]))
    if picture.mode in SIXTEEN_BITS:
        grey = srgb_to_linear(np.clip(np.asarray(ImageOps.exif_transpose(picture)) / 65535.0, 0, 1)).astype(np.float32)
        return [grey] * 3
    if picture.mode == "F":
        raise ValueError("its pixels are floating-point numbers, expected 8 or 16 bits")
    if picture.has_transparency_data:
        paper = Image.new("RGBA", picture.size, "white")
        paper.alpha_composite(picture.convert("RGBA"))
        picture = paper
    picture = ImageOps.exif_transpose(picture.convert("RGB"))
    factor = min(picture.width // (4 * size[0]), picture.height // (4 * size[1]))
    encoded = np.asarray(picture.reduce(factor) if factor > 1 else picture)
    decoded = srgb_to_linear(np.arange(256) / 255.0).astype(np.float32)
    return [decoded[encoded[..., channel]] for channel in range(3)]


def srgb_to_linear(encoded: np.ndarray) -> np.ndarray:
    """Inverse of the sRGB transfer function (IEC 61966-2-1); values in [0, 1]."""
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def linear_to_srgb(linear: np.ndarray) -> np.ndarray:
    """The sRGB transfer function (IEC 61966-2-1); values in [0, 1]."""
    linear = np.clip(linear, 0.0, 1.0)
    return np.where(linear <= 0.0031308, linear * 12.92, 1.055 * linear ** (1 / 2.4) - 0.055)
