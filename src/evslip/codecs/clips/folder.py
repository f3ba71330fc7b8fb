"""A folder of images as a clip."""

import re
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from evslip.codecs.clips.grey import to_grey
from evslip.codecs.clips.pixels import EXPECTED, check_pixels
from evslip.events.sensor.optics import Intensity
from evslip.utils.errors import DataError
from evslip.utils.files import require_file

IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp", ".pgm", ".ppm")


def image_files(folder: Path) -> list[Path]:
    """The images of a folder in natural order (frame 2 before frame 10). Raises DataError where there are none."""
    try:
        files = [file for file in folder.iterdir() if file.suffix.lower() in IMAGE_SUFFIXES and file.name[0] != "."]
    except OSError as error:
        raise DataError(f"{folder}: cannot be read: {error.strerror}") from None
    if not files:
        raise DataError(f"{folder}: holds no images; expected files named {', '.join(IMAGE_SUFFIXES)}")
    return sorted(files, key=_natural)


def read_images(files: list[Path], intensity: Intensity) -> Iterator[np.ndarray]:
    """The images in grey, one by one. Raises DataError naming the file when one is unreadable or of another size."""
    shape = None
    for file in files:
        image = to_grey(read_image(file), intensity)
        if shape is not None and image.shape != shape:
            raise DataError(
                f"{file}: is {image.shape[1]}x{image.shape[0]} pixels, the images before it are {shape[1]}x{shape[0]}"
            )
        shape = image.shape
        yield image


def read_image(file: Path) -> np.ndarray:
    """A picture as it is stored: grey or RGB, uint8, uint16 or float32. Raises DataError."""
    from PIL import UnidentifiedImageError

    require_file(file)
    try:
        with _opened(file) as picture:
            check_pixels(picture.width, picture.height, file)
            if picture.mode == "F":
                return np.asarray(picture)
            if picture.mode.startswith("I"):
                deep = np.asarray(picture)
                if deep.min() < 0 or deep.max() > 65535:
                    raise DataError(f"{file}: grey values from {deep.min()} to {deep.max()}, expected 0 to 65535")
                return deep.astype(np.uint16)
            if any(";16" in str(tile[3]) for tile in picture.tile):
                return _read_deep_colours(file)
            return np.asarray(picture.convert("L" if picture.mode in ("1", "L", "LA") else "RGB"))
    except (OSError, SyntaxError, ValueError, UnidentifiedImageError):
        raise DataError(f"{file}: is not a readable image, or is truncated") from None


def _opened(file: Path) -> Any:
    """A picture whose size is known and whose pixels are not decoded, however many they are."""
    from PIL import Image

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Image.DecompressionBombWarning)
        try:
            return Image.open(file)
        except Image.DecompressionBombError:
            raise DataError(f"{file}: a frame of hundreds of millions of pixels, {EXPECTED}") from None


def _read_deep_colours(file: Path) -> np.ndarray:
    # Pillow reduces colours of 16 bits to 8.
    import av

    with av.open(str(file)) as container:
        return next(container.decode(video=0)).to_ndarray(format="rgb48le")


def _natural(file: Path) -> tuple[list[tuple[int, int, str]], str]:
    parts = re.split(r"(\d+)", file.name.lower())
    return [(0, int(part), "") if part.isdecimal() else (1, 0, part) for part in parts], file.name
