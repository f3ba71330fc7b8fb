"""Events that a simulated camera makes of the frames of a recording."""

from collections.abc import Iterator
from itertools import islice

import numpy as np

from evslip.codecs.clips.grey import to_grey
from evslip.codecs.clips.sources import TimedImage
from evslip.data.footage import Footage
from evslip.events.calibration.exposures import steadied, white_of
from evslip.events.camera import MOST_NOISE, EventCamera
from evslip.events.stream import Events, concatenate
from evslip.learn.realism.settings import RealismSettings
from evslip.utils.errors import ConfigError

_AT_ONCE = 256
"""Frames that are made before the cameras see them."""


def simulated_events(
    footage: Footage, preset: str, seeds: tuple[int, ...], settings: RealismSettings, end_us: int
) -> list[Events]:
    """Events up to `end_us` that a camera of each seed makes, from the first frame on. Raises ConfigError,
    MissingExtraError."""
    height, width = footage.images.shape[1:3]
    intensity = settings.intensity or "uint8"
    cameras = [
        EventCamera(preset, size=(width, height), seed=seed, mode=settings.mode, intensity=intensity) for seed in seeds
    ]
    noise = cameras[0].model.noise_hz(width * height) * (end_us - int(footage.t_us[0])) / 1e6
    if noise > MOST_NOISE:  # so many of each camera
        raise ConfigError(
            f"end-s: {noise / 1e6:,.0f} million noise events up to {end_us / 1e6:g} s, expected an end with "
            f"{MOST_NOISE / 1e6:.0f} at most"
        )
    parts: list[list[Events]] = [[] for _ in cameras]
    frames = frames_between(footage, settings, end_us)
    # Frames are made once for all cameras, and not kept.
    while batch := list(islice(frames, _AT_ONCE)):
        for camera, made in zip(cameras, parts, strict=True):
            made.append(camera.run(batch))
    return [concatenate(made) for made in parts]


def frames_between(
    footage: Footage, settings: RealismSettings, end_us: int
) -> Iterator[tuple[float, np.ndarray, np.ndarray | None]]:
    """The frames of a recording and those that the settings put between them, up to the first at or after `end_us`."""
    if settings.interpolate not in ("linear", "flow"):
        raise ConfigError(f"interpolate: {settings.interpolate!r} is unknown; expected one of linear, flow")
    distinct = np.concatenate([[True], np.diff(footage.t_us) > 0])
    number = int(np.searchsorted(footage.t_us, end_us)) + 1
    timed = zip(footage.t_us[:number].tolist(), footage.images[:number], distinct[:number], strict=True)
    intensity = settings.intensity or "uint8"
    frames = ((float(t_us), to_grey(image, intensity), None) for t_us, image, new in timed if new)
    if settings.steady:
        is_grey = footage.images.ndim == 3  # colours are not clipped together
        white = white_of(footage.images) if is_grey else np.ones(footage.images.shape[2], np.float32)
        frames = _steady(frames, white)
    if settings.interpolate == "linear":
        return frames
    from evslip.codecs.clips import flow

    return flow.smoothed(frames, settings.upsample, intensity)


def _steady(frames: Iterator[TimedImage], white: np.ndarray) -> Iterator[TimedImage]:
    """The frames without the noise of what does not change, a stretch of them at a time; white: see `white_of`."""
    while batch := list(islice(frames, _AT_ONCE)):
        images = np.stack([image for _, image, _ in batch])
        full = np.float32(255.0 if images.dtype == np.uint8 else 1.0)
        calm = steadied(images.astype(np.float32) / full, white) * full
        yield from ((t_us, image, None) for (t_us, _, _), image in zip(batch, calm, strict=True))
