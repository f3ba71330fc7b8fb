"""How large the frames of a clip may be: one limit for images, videos and arrays, asked before any is decoded."""

from evslip.utils.errors import DataError

MOST_PIXELS = 1 << 23
"""As many as 3840 x 2160; event pixels of so many take 2 GB."""
EXPECTED = f"expected at most {MOST_PIXELS / 1e6:.1f} million pixels, such as 3840x2160; scale the frames down"


def check_pixels(width: int, height: int, where: object) -> None:
    """Raise DataError for frames that are too large."""
    if not 0 < width * height <= MOST_PIXELS:
        raise DataError(f"{where}: a frame of {width}x{height} pixels, {EXPECTED}")


def check_sensor(size: tuple[int, int], where: object) -> None:
    """Raise DataError for a sensor, (width, height), of whose pixels each one cannot be looked at."""
    if not 0 < size[0] * size[1] <= MOST_PIXELS:
        raise DataError(
            f"{where}: a sensor of {size[0]}x{size[1]} pixels, expected at most {MOST_PIXELS / 1e6:.1f} million"
        )
