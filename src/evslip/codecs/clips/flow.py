"""Frames between two given ones, brought along dense optical flow.

Flow: dense inverse search (Kroeger, Timofte, Dai, Van Gool, Fast optical flow using dense inverse search, ECCV 2016) of
OpenCV, from either frame to the other. A pixel of the frame at the share s of the interval looks for the pixel of
each given frame that has moved there, along straight lines at even speed; both are blended, the nearer in time and
the one whose flow is confirmed by that of the other frame more than the other one. So what only one frame shows comes
from that frame.

Pixels are fetched in light (bytes that are taken as they are: in codes) and blended in the logarithm that event pixels
see. Where nothing moves, that is what they take for granted between two frames anyway: log intensity changes evenly.
"""

import contextlib
from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

import numpy as np

from evslip.codecs.clips.grey import encode_srgb
from evslip.codecs.clips.sources import TimedImage, upsampled
from evslip.events.sensor.optics import KNEE, WHITE, Intensity, decode_srgb, linear_to_log
from evslip.utils.errors import ConfigError, MissingExtraError

LEAST_UPSAMPLE, MOST_UPSAMPLE = 2, 64
"""Intervals that one can become."""
DARK = 1e-3
"""Luminance, white = 1, that is added to light before its logarithm: the dark current of every preset."""
TOLERANCE_PX = 1.0
"""Disagreement of the two flows, in pixels, that halves what a frame counts."""
_ROUNDS = 5
"""Steps of the search for the pixel that has moved to a place."""
_LEAST_SIDE = 12
"""Smaller frames have no flow: the library takes patches of several pixels at several scales."""


def moved(
    frame_0: np.ndarray, frame_1: np.ndarray, shares: Iterable[float], intensity: Intensity = "linear"
) -> Iterator[np.ndarray]:
    """The frame at each share of the interval, 0 to 1: float32 of shape (height, width), on the given ones' scale.

    intensity: what the images are, as for EventCamera. Equal for any number of threads. Raises MissingExtraError.
    """
    cv2 = _opencv()
    light = [_to_light(frame, intensity) for frame in (frame_0, frame_1)]
    sides = _sides(cv2, light, intensity)
    for share in shares:
        yield _from_light(_blended(cv2, sides, share, intensity), intensity)


def smoothed(frames: Iterable[TimedImage], upsample: int, intensity: Intensity) -> Iterator[TimedImage]:
    """Every interval cut into `upsample` equal ones (see `upsampled`). Raises ConfigError, MissingExtraError."""
    check_upsample(upsample)
    _opencv()
    shares = [number / upsample for number in range(1, upsample)]
    return upsampled(frames, upsample, lambda first, second: moved(first, second, shares, intensity))


def check_upsample(upsample: int) -> None:
    """Raise ConfigError unless an interval may be cut into so many."""
    if not LEAST_UPSAMPLE <= upsample <= MOST_UPSAMPLE:
        raise ConfigError(
            f"upsample: {upsample!r} is out of range, expected {LEAST_UPSAMPLE} to {MOST_UPSAMPLE} intervals"
        )


class _Side(NamedTuple):
    """One of the two frames."""

    light: np.ndarray
    flow: np.ndarray
    """Way of each pixel to the other frame, (x, y) in pixels, of shape (height, width, 2)."""
    disagreement: np.ndarray
    """Pixels by which the flow of the other frame does not lead back, of shape (height, width)."""


def _sides(cv2: Any, light: list[np.ndarray], intensity: Intensity) -> tuple[_Side, _Side]:
    if min(light[0].shape) < _LEAST_SIDE:
        still = np.zeros((*light[0].shape, 2), np.float32)
        return _Side(light[0], still, still[..., 0]), _Side(light[1], still, still[..., 0])
    codes = _codes(light, intensity)
    with _one_thread(cv2):
        forth, back = (_estimator(cv2).calc(*pair, None) for pair in (codes, codes[::-1]))
        return (
            _Side(light[0], forth, _disagreement(cv2, forth, back)),
            _Side(light[1], back, _disagreement(cv2, back, forth)),
        )


def _estimator(cv2: Any) -> Any:
    """A new one: it keeps nothing from the pair before. Finer than the library's presets: on texture of two pixels that
    moves by 16 the events' error is .28, with the preset medium .80 (benchmarks/interpolation.py)."""
    estimator = cv2.DISOpticalFlow_create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
    estimator.setFinestScale(0)
    estimator.setPatchSize(6)
    estimator.setPatchStride(2)
    return estimator


def _disagreement(cv2: Any, there: np.ndarray, back: np.ndarray) -> np.ndarray:
    """Pixels by which the way there and back misses its start."""
    returned = _fetched(cv2, back, _grid(there.shape[:2]) + there, cv2.INTER_LINEAR)
    return np.hypot(*np.moveaxis(there + returned, 2, 0))


def _blended(cv2: Any, sides: tuple[_Side, _Side], share: float, intensity: Intensity) -> np.ndarray:
    grid = _grid(sides[0].light.shape)
    logs, weights = [], []
    with _one_thread(cv2):
        for side, way in zip(sides, (share, 1 - share), strict=True):
            step = np.float32(way)
            place = grid
            for _ in range(_ROUNDS):
                place = grid - step * _fetched(cv2, side.flow, place, cv2.INTER_LINEAR)
            miss = place + step * _fetched(cv2, side.flow, place, cv2.INTER_LINEAR) - grid
            wrong = np.hypot(*np.moveaxis(miss, 2, 0)) + _fetched(cv2, side.disagreement, place, cv2.INTER_LINEAR)
            weights.append((1 - step) / (1 + (wrong / TOLERANCE_PX) ** 2))
            logs.append(_to_log(np.maximum(_fetched(cv2, side.light, place, cv2.INTER_CUBIC), 0), intensity))
    total = weights[0] + weights[1]
    return _from_log((weights[0] * logs[0] + weights[1] * logs[1]) / total, intensity)


def _grid(shape: tuple[int, ...]) -> np.ndarray:
    """(x, y) of every pixel, float32 of shape (height, width, 2)."""
    return np.stack(np.meshgrid(np.arange(shape[1]), np.arange(shape[0])), 2).astype(np.float32)


def _fetched(cv2: Any, image: np.ndarray, places: np.ndarray, rule: int) -> np.ndarray:
    return cv2.remap(image, places, None, rule, borderMode=cv2.BORDER_REPLICATE)


def _codes(light: list[np.ndarray], intensity: Intensity) -> list[np.ndarray]:
    """The frames as the flow's estimator takes them, uint8, both on one scale."""
    if intensity == "uint8":
        return [np.clip(np.rint(image), 0, 255).astype(np.uint8) for image in light]
    brightest = max(1.0, *(float(image.max()) for image in light))
    return [np.rint(255 * encode_srgb(image / brightest)).astype(np.uint8) for image in light]


def _to_light(image: np.ndarray, intensity: Intensity) -> np.ndarray:
    light = decode_srgb(image.astype(np.float32)) if intensity == "srgb" else image
    return light.astype(np.float32)


def _from_light(light: np.ndarray, intensity: Intensity) -> np.ndarray:
    if intensity == "linear":
        return light
    return np.minimum(WHITE * encode_srgb(light) if intensity == "srgb" else light, np.float32(WHITE))


def _to_log(light: np.ndarray, intensity: Intensity) -> np.ndarray:
    return (linear_to_log(light) if intensity == "uint8" else np.log(light + DARK)).astype(np.float32)


def _from_log(log: np.ndarray, intensity: Intensity) -> np.ndarray:
    if intensity == "uint8":
        low = float(np.log(KNEE))
        return np.where(log <= low, log * np.float32(KNEE / low), np.exp(log)).astype(np.float32)
    return np.maximum(np.exp(log) - np.float32(DARK), 0)


@contextlib.contextmanager
def _one_thread(cv2: Any) -> Iterator[None]:
    """One thread inside: how the library shares work among several is its own affair."""
    before = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(before)


def _opencv() -> Any:
    try:
        import cv2
    except ImportError:
        raise MissingExtraError(
            "interpolate flow needs the package opencv-python-headless: pip install 'evslip[flow]'"
        ) from None
    return cv2
