"""Parameters of the event pixels, and named sets of values."""

from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from evslip.utils.errors import ConfigError

Map = np.ndarray


def _in(unit: str, low: float, high: float) -> dict[str, Any]:
    return {"unit": unit, "limits": (low, high)}


@dataclass(frozen=True)
class PixelModel:
    """Parameters of the event pixels. Maps have the sensor's shape, (height, width)."""

    theta: float = field(default=0.2, metadata=_in("ln", 0.01, 5.0))
    """Mean contrast threshold of both polarities, in ln units."""
    sigma: float = field(default=0.03, metadata=_in("ln", 0.0, 1.0))
    """Standard deviation of the thresholds over the pixels, in ln units; ON and OFF independent, each at least 0.01."""
    theta_on: float | Map | None = field(default=None, metadata=_in("ln", 0.01, 5.0))
    """ON threshold in ln units: a number replaces theta as the mean, a map is taken as it is, without sigma."""
    theta_off: float | Map | None = field(default=None, metadata=_in("ln", 0.01, 5.0))
    """OFF threshold, as theta_on."""
    cutoff_hz: float = field(default=0.0, metadata=_in("Hz", 0.0, 1e6))
    """Corner of the photoreceptor's low-pass at white, Hz; (I + 20) / 275 of it at intensity I (0 to 255). 0: none."""
    leak_rate_hz: float = field(default=0.0, metadata=_in("Hz", 0.0, 1e3))
    """Leak events (ON) a second and pixel."""
    leak_spread: float = field(default=0.1, metadata=_in("decades", 0.0, 1.0))
    """Standard deviation over the pixels of log10 of the leak rate."""
    leak_jitter: float = field(default=0.1, metadata=_in("1", 0.0, 1.0))
    """Standard deviation of the leak rate from one event of a pixel to its next, relative."""
    leak_map: Map | None = field(default=None, metadata=_in("1", 0.0, 1e3))
    """Factor of the leak rate for each pixel; replaces leak_spread."""
    shot_rate_hz: float = field(default=0.0, metadata=_in("Hz", 0.0, 1e3))
    """Shot noise events a second and pixel, both polarities together, in the dark; at white a quarter."""
    hot_share: float = field(default=0.0, metadata=_in("1", 0.0, 1.0))
    """Share of pixels that are hot: they fire ON at random without cause."""
    hot_rate_hz: float = field(default=50.0, metadata=_in("Hz", 0.0, 1e5))
    """Events a second of a hot pixel."""
    dead_share: float = field(default=0.0, metadata=_in("1", 0.0, 1.0))
    """Share of pixels that never fire."""
    noise_map: Map | None = field(default=None, metadata=_in("Hz", 0.0, 1e5))
    """Measured noise, events a second of each pixel, ON and OFF, of shape (2, height, width), as `measure_noise` gives
    it. Replaces shot_rate_hz, leak_rate_hz and hot pixels; labelled shot, and independent of intensity."""
    photoreceptor_noise: float = field(default=0.0, metadata=_in("ln", 0.0, 1.0))
    """Standard deviation of the photoreceptor's noise in ln units; the pixel's low-pass limits its band, so cutoff_hz
    must not be 0. Its events are labelled shot; unlike shot_rate_hz it scatters the signal's times too."""
    refractory_us: float = field(default=0.0, metadata=_in("us", 0.0, 1e6))
    """Time in microseconds after an event during which a pixel is held in reset."""
    dark: float = field(default=1e-3, metadata=_in("white", 1e-6, 20 / 255))
    """Dark current of the photoreceptor as a luminance, white = 1: linear input L becomes ln(L + dark)."""
    surround_pixels: float = field(default=0.0, metadata=_in("pixels", 0.0, 100.0))
    """Space constant, in pixels, of the surround that is subtracted from each pixel; 0: none. Mode v2e."""
    surround_us: float = field(default=0.0, metadata=_in("us", 0.0, 1e6))
    """Time constant of the surround in microseconds; 0: it settles within every frame. Mode v2e."""
    adaptive_us: float | Map = field(default=0.0, metadata=_in("us", 0.0, 1e9))
    """Time constant of an adaptive high-pass in microseconds (v2e's SCIDVS: 10000); 0: none. A number is the median,
    a map is taken as it is. Mode v2e."""
    adaptive_spread: float = field(default=0.5, metadata=_in("ln", 0.0, 2.0))
    """Standard deviation over the pixels of ln of that time constant. Mode v2e."""


PARAMETERS = tuple(field.name for field in fields(PixelModel))
LIMITS: dict[str, tuple[float, float]] = {field.name: field.metadata["limits"] for field in fields(PixelModel)}
"""Physical limits of each number, and of each entry of a map."""
UNITS: dict[str, str] = {field.name: field.metadata["unit"] for field in fields(PixelModel)}
"""Unit of each parameter: ln is a change of log intensity, 1 a plain ratio, white the luminance of white."""
MAPS = ("theta_on", "theta_off", "leak_map", "noise_map", "adaptive_us")
"""Parameters that may differ from pixel to pixel as given."""
FOREIGN = {
    "v2e": ("hot_share", "hot_rate_hz", "dead_share", "noise_map", "photoreceptor_noise"),
    "accurate": ("surround_pixels", "surround_us", "adaptive_us", "adaptive_spread"),
}
"""Parameters that each mode does not have."""

PRESETS: dict[str, PixelModel] = {
    "davis346": PixelModel(
        theta=0.15, sigma=0.03, cutoff_hz=15.0, leak_rate_hz=0.01, shot_rate_hz=0.001, refractory_us=500.0
    ),
    "dvxplorer": PixelModel(
        theta=0.2, sigma=0.02, cutoff_hz=390.0, leak_rate_hz=0.01, shot_rate_hz=0.03, refractory_us=200.0
    ),
    "prophesee-like": PixelModel(
        theta=0.22, sigma=0.02, cutoff_hz=1060.0, leak_rate_hz=0.01, shot_rate_hz=0.1, refractory_us=10.0
    ),
    "clean": PixelModel(theta=0.2, sigma=0.02),
    "noisy": PixelModel(theta=0.2, sigma=0.05, cutoff_hz=30.0, leak_rate_hz=0.1, shot_rate_hz=5.0),
}
"""Named settings: davis346 is what the slip detection paper gave to v2e; clean and noisy are v2e's own (Hu, Liu,
Delbruck, v2e: from video frames to realistic DVS events, CVPR workshops 2021). dvxplorer (Samsung VGA) and
prophesee-like (Gen4, IMX636) follow what is public about these sensors; docs/explanation/event-camera.md gives the
source of each value. Biases change all of them: `evslip calibrate-noise` measures the noise of a camera at hand."""


def resolve(preset: str, parameters: dict[str, Any], shape: tuple[int, int]) -> PixelModel:
    """A preset with some parameters replaced, checked. Raises ConfigError naming the parameter."""
    if preset not in PRESETS:
        raise ConfigError(f"camera preset {preset!r} is unknown; expected one of {', '.join(PRESETS)}")
    for name, value in parameters.items():
        if name not in PARAMETERS:
            raise ConfigError(f"camera parameter {name!r} is unknown; expected one of {', '.join(PARAMETERS)}")
        parameters = {**parameters, name: _checked(name, value, shape)}
    model = replace(PRESETS[preset], **parameters)
    if model.photoreceptor_noise > 0 and model.cutoff_hz == 0:
        raise ConfigError("camera parameter photoreceptor_noise: needs a low-pass to limit its band; set cutoff_hz")
    return model


def _checked(name: str, value: Any, shape: tuple[int, int]) -> Any:
    if value is None and name in MAPS and name != "adaptive_us":
        return None
    try:
        numbers = np.asarray(value, np.float64)
    except (TypeError, ValueError):
        raise ConfigError(f"camera parameter {name}: {value!r} is not a number") from None
    wanted = (2, *shape) if name == "noise_map" else shape
    is_map = name in MAPS and numbers.shape == wanted
    if isinstance(value, bool) or not (is_map or (numbers.ndim == 0 and name != "noise_map")):
        expected = f"an array of shape {wanted}" if name in MAPS else "a number"
        given = f"an array of shape {numbers.shape}" if numbers.ndim else repr(value)
        raise ConfigError(f"camera parameter {name}: {given} given, expected {expected}")
    if name == "leak_map" and not numbers.ndim:
        numbers = np.full(shape, numbers)
    low, high = LIMITS[name]
    bad = numbers[~((numbers >= low) & (numbers <= high))]
    if bad.size:
        raise ConfigError(f"camera parameter {name}: {bad.flat[0]:g} is out of range, expected {low:g} to {high:g}")
    return numbers if numbers.ndim else float(numbers)
