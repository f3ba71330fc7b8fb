"""Parameters of the event pixels, with units and limits."""

import math
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

Map = np.ndarray


def within(unit: str, low: float, high: float) -> dict[str, Any]:
    """Metadata of a parameter's field: its unit, and the limits of each number, both included."""
    return {"unit": unit, "limits": (low, high)}


@dataclass(frozen=True)
class PixelModel:
    """Parameters of the event pixels. Maps have the sensor's shape, (height, width)."""

    theta: float = field(default=0.2, metadata=within("ln", 0.01, 5.0))
    """Mean contrast threshold of both polarities, in ln units."""
    sigma: float = field(default=0.03, metadata=within("ln", 0.0, 1.0))
    """Standard deviation of the thresholds over the pixels, in ln units; ON and OFF independent, each at least 0.01."""
    theta_on: float | Map | None = field(default=None, metadata=within("ln", 0.01, 5.0))
    """ON threshold in ln units: a number replaces theta as the mean, a map is taken as it is, without sigma."""
    theta_off: float | Map | None = field(default=None, metadata=within("ln", 0.01, 5.0))
    """OFF threshold, as theta_on."""
    sigma_on: float | None = field(default=None, metadata=within("ln", 0.0, 1.0))
    """Standard deviation of the ON thresholds in ln units; replaces sigma."""
    sigma_off: float | None = field(default=None, metadata=within("ln", 0.0, 1.0))
    """Standard deviation of the OFF thresholds, as sigma_on."""
    cutoff_hz: float = field(default=0.0, metadata=within("Hz", 0.0, 1e6))
    """Corner of the photoreceptor's low-pass at white, Hz; it grows linearly with light. 0: none."""
    cutoff_dark: float = field(default=20 / 275, metadata=within("1", 0.0, 1.0))
    """Corner without light, as a share of cutoff_hz; by default v2e's, (I + 20) / 275 at intensity I (0 to 255)."""
    leak_rate_hz: float = field(default=0.0, metadata=within("Hz", 0.0, 1e3))
    """Leak events (ON) a second and pixel, in the dark."""
    leak_light_hz: float = field(default=0.0, metadata=within("Hz", 0.0, 1e3))
    """Leak events that come on top of these at white; in proportion to light (parasitic photocurrent)."""
    clipped_light: float = field(default=1.0, metadata=within("white", 1.0, 1e3))
    """Luminance, white = 1, that stands behind white in frames that clip there; for the leak alone."""
    leak_spread: float = field(default=0.1, metadata=within("decades", 0.0, 1.0))
    """Standard deviation over the pixels of log10 of the leak rate."""
    leak_jitter: float = field(default=0.1, metadata=within("1", 0.0, 1.0))
    """Standard deviation of the leak rate from one event of a pixel to its next, relative."""
    leak_map: Map | None = field(default=None, metadata=within("1", 0.0, 1e3))
    """Factor of the leak rate for each pixel; replaces leak_spread."""
    shot_rate_hz: float = field(default=0.0, metadata=within("Hz", 0.0, 1e3))
    """Shot noise events a second and pixel, both polarities together, in the dark."""
    shot_white: float = field(default=0.25, metadata=within("1", 0.0, 1.0))
    """Shot noise at white, as a share of that in the dark; in between it falls linearly with light."""
    shot_on_share: float = field(default=0.5, metadata=within("1", 0.0, 1.0))
    """Share of the shot noise events that are ON, in a pixel of mean thresholds."""
    shot_spread: float = field(default=0.0, metadata=within("decades", 0.0, 1.0))
    """Standard deviation over the pixels of log10 of the shot noise rate, which is then the median; ON and OFF of a
    pixel have it in common."""
    hot_share: float = field(default=0.0, metadata=within("1", 0.0, 1.0))
    """Share of pixels that are hot: they fire ON at random without cause."""
    hot_rate_hz: float = field(default=50.0, metadata=within("Hz", 0.0, 1e5))
    """Events a second of a hot pixel."""
    dead_share: float = field(default=0.0, metadata=within("1", 0.0, 1.0))
    """Share of pixels that never fire."""
    noise_map: Map | None = field(default=None, metadata=within("Hz", 0.0, 1e5))
    """Measured noise, events a second of each pixel, ON and OFF, of shape (2, height, width), as `measure_noise` gives
    it. Replaces shot_rate_hz, leak_rate_hz and hot pixels; labelled shot, and independent of intensity."""
    photoreceptor_noise: float = field(default=0.0, metadata=within("ln", 0.0, 1.0))
    """Standard deviation of the photoreceptor's noise in ln units; the pixel's low-pass limits its band, so cutoff_hz
    must not be 0. Its events are labelled shot; unlike shot_rate_hz it scatters the signal's times too."""
    refractory_us: float = field(default=0.0, metadata=within("us", 0.0, 1e6))
    """Time in microseconds after an event during which a pixel is held in reset."""
    dark: float = field(default=1e-3, metadata=within("white", 1e-6, 20 / 255))
    """Dark current of the photoreceptor as a luminance, white = 1: linear input L becomes ln(L + dark)."""
    surround_pixels: float = field(default=0.0, metadata=within("pixels", 0.0, 100.0))
    """Space constant, in pixels, of the surround that is subtracted from each pixel; 0: none. Mode v2e."""
    surround_us: float = field(default=0.0, metadata=within("us", 0.0, 1e6))
    """Time constant of the surround in microseconds; 0: it settles within every frame. Mode v2e."""
    adaptive_us: float | Map = field(default=0.0, metadata=within("us", 0.0, 1e9))
    """Time constant of an adaptive high-pass in microseconds (v2e's SCIDVS: 10000); 0: none. A number is the median,
    a map is taken as it is. Mode v2e."""
    adaptive_spread: float = field(default=0.5, metadata=within("ln", 0.0, 2.0))
    """Standard deviation over the pixels of ln of that time constant. Mode v2e."""

    def noise_hz(self, pixels: int) -> float:
        """Noise events a second of so many pixels, about: leak at white and shot noise in the dark, where they are
        most, and what the photoreceptor's noise makes."""
        if self.noise_map is not None:
            return float(self.noise_map.sum())
        leak = (self.leak_rate_hz + self.leak_light_hz) * (
            1.0 if self.leak_map is None else float(self.leak_map.mean())
        )
        thresholds = [one for one in (self.theta_on, self.theta_off) if one is not None] or [self.theta]
        spread = max(2.0 * self.photoreceptor_noise, 1e-6) / min(float(np.min(one)) for one in thresholds)
        receptor = math.pi * self.cutoff_hz * math.exp(-1.0 / spread**2)  # of Gaussian noise that wanders that far
        return pixels * (leak + self.shot_rate_hz + self.hot_share * self.hot_rate_hz + receptor)


PARAMETERS = tuple(field.name for field in fields(PixelModel))
LIMITS: dict[str, tuple[float, float]] = {field.name: field.metadata["limits"] for field in fields(PixelModel)}
"""Physical limits of each number, and of each entry of a map."""
UNITS: dict[str, str] = {field.name: field.metadata["unit"] for field in fields(PixelModel)}
"""Unit of each parameter: ln is a change of log intensity, 1 a plain ratio, white the luminance of white."""
MAPS = ("theta_on", "theta_off", "leak_map", "noise_map", "adaptive_us")
"""Parameters that may differ from pixel to pixel as given."""
OPTIONAL = ("theta_on", "theta_off", "sigma_on", "sigma_off", "leak_map", "noise_map")
"""Parameters that may be None."""
FOREIGN = {
    "v2e": (
        "hot_share",
        "hot_rate_hz",
        "dead_share",
        "noise_map",
        "photoreceptor_noise",
        "cutoff_dark",
        "leak_light_hz",
        "clipped_light",
        "shot_white",
        "shot_on_share",
        "shot_spread",
    ),
    "accurate": ("surround_pixels", "surround_us", "adaptive_us", "adaptive_spread"),
}
"""Parameters that each mode does not have."""


def own_parameters(values: dict[str, Any], mode: str) -> dict[str, Any]:
    """Those parameters that a mode has."""
    return {name: value for name, value in values.items() if name not in FOREIGN[mode]}
