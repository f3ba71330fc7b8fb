"""Bias currents of a DAVIS346, as its users set them, and the parameters of the pixels that follow from them.

Equations of the circuit, with U_T the thermal voltage:

    threshold         theta = kappa_n C2 / (kappa_p^2 C1) |ln(I / I_diff)|, I of OnBn or OffBn
    refractory period t = C_refr V_refr / I_refr: a capacitor that RefrBp charges
    source follower   f = I_sf / (2 pi U_T C1), loaded by the differencing capacitor
    amplifier         f = I_pr / (2 pi U_T C1) at least: its load is smaller
    photoreceptor     f = 3 Hz a lux of scene illumination, as long as the amplifier is faster

All hold in weak inversion, up to some 100 nA. docs/explanation/pixel-model.md gives the sources.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from evslip.events.pixel_model import LIMITS, PixelModel
from evslip.utils.errors import ConfigError

Bias = float | tuple[int, int]
"""A current in amperes, or a code: coarse (0 to 7) and fine (0 to 255), as libcaer and DV count them."""

DAVIS346_BIASES: dict[str, tuple[int, int]] = {
    "DiffBn": (4, 39),
    "OnBn": (5, 255),
    "OffBn": (4, 1),
    "PrBp": (2, 58),
    "PrSFBp": (1, 16),
    "RefrBp": (4, 25),
}
"""Default: the codes that libcaer, and so DV, sends to a DAVIS346."""
BIAS_SETS: dict[str, dict[str, tuple[int, int]]] = {
    "default": DAVIS346_BIASES,
    "high sensitivity": DAVIS346_BIASES | {"OnBn": (5, 26), "OffBn": (4, 10)},
    "low sensitivity": DAVIS346_BIASES | {"OnBn": (6, 255), "OffBn": (3, 1)},
    "jAER's DAVIS346blue": {
        "DiffBn": (4, 138),
        "OnBn": (5, 208),
        "OffBn": (3, 49),
        "PrBp": (2, 6),
        "PrSFBp": (0, 2),
        "RefrBp": (4, 25),
    },
}
"""The default; its threshold currents nearer to DiffBn's by a factor of ten, as far as jAER's slider goes, and farther
by one of eight; and the file that comes with jAER for the blue edition of the DAVIS346."""

COARSE_A = tuple(1e-12 * pico for pico in (11, 94, 756, 6054, 48_437, 387_500, 3_100_000, 24_800_000))
"""Current of each coarse code at fine code 255, in amperes; nominally a factor of 8 apart. libcaer's table."""
THERMAL_V = 25e-3
"""Thermal voltage U_T at room temperature, in volts."""
KAPPA_N, KAPPA_P, CAPACITOR_RATIO = 0.7, 0.7, 20.0
"""Back-gate coefficients of n and p transistors, and C1 / C2: Lichtsteiner et al. 2008, and jAER for all DAVIS."""
THRESHOLD_GAIN = KAPPA_N / (KAPPA_P**2 * CAPACITOR_RATIO)
FOLLOWER_F = 131.167e-15
"""Differencing capacitor C1, which loads the source follower, in farads; jAER's estimate for DAVIS240 and DAVIS346."""
REFRACTORY_F, REFRACTORY_V = 20e-15, 0.8
"""Capacitor of the refractory period in farads and the swing that ends it in volts; jAER's estimate from the layout."""
PHOTORECEPTOR_HZ_PER_LUX = 3.0
"""Corner of the photoreceptor for each lux of scene illumination: 3 kHz at 1 klux, Lichtsteiner et al. 2008."""
WHITE_LUX = 1000.0


@dataclass(frozen=True)
class Biasing:
    """Bias currents, as texts, and light."""

    biases: tuple[str, ...] | None = None
    """After "camera": what biases of a DAVIS346 make of it or of a preset, such as OnBn=5/255 (coarse/fine) or
    PrBp=170e-12 (amperes); the others are the defaults. Nothing after it: a table of known sets."""
    white_lux: float = WHITE_LUX
    """Illumination of the scene that the biases work in, in lux."""


class Circuit(NamedTuple):
    """Quantities that follow from the biases."""

    theta_on: float
    """ln units"""
    theta_off: float
    """ln units, positive"""
    follower_hz: float
    """Corner of the source follower."""
    amplifier_hz: float
    """Lower bound of the corner of the photoreceptor's amplifier."""
    photoreceptor_hz: float
    """Corner that the photocurrent alone sets, at white."""
    refractory_us: float


def currents(biases: Mapping[str, Any]) -> dict[str, float]:
    """Currents in amperes of all biases; those not given are the defaults. Raises ConfigError naming the bias."""
    known = {name.lower(): name for name in DAVIS346_BIASES}
    for name in biases:
        if str(name).lower() not in known:
            raise ConfigError(f"bias {str(name)!r} is unknown; expected one of {', '.join(DAVIS346_BIASES)}")
    given = DAVIS346_BIASES | {known[name.lower()]: value for name, value in biases.items()}
    return {name: _current(name, value) for name, value in given.items()}


def circuit(biases: Mapping[str, Any], white_lux: float = WHITE_LUX) -> Circuit:
    """Quantities of the pixel's circuit. white_lux: illumination of the scene. Raises ConfigError."""
    if isinstance(white_lux, bool) or not isinstance(white_lux, int | float) or not 0.0 < white_lux <= 1e6:
        raise ConfigError(f"white_lux: {white_lux!r} is out of range, expected more than 0 and at most 1e6")
    amperes = currents(biases)
    return Circuit(
        theta_on=_threshold("OnBn", amperes["OnBn"], amperes["DiffBn"]),
        theta_off=_threshold("OffBn", amperes["OffBn"], amperes["DiffBn"]),
        follower_hz=amperes["PrSFBp"] / (2.0 * math.pi * THERMAL_V * FOLLOWER_F),
        amplifier_hz=amperes["PrBp"] / (2.0 * math.pi * THERMAL_V * FOLLOWER_F),
        photoreceptor_hz=PHOTORECEPTOR_HZ_PER_LUX * white_lux,
        refractory_us=1e6 * REFRACTORY_F * REFRACTORY_V / amperes["RefrBp"],
    )


def pixel_parameters(found: Circuit, base: PixelModel) -> dict[str, float]:
    """Parameters of the pixels, the others being those of `base`.

    The model has one pole, whose corner grows linearly with light. The circuit's is the lowest of three, of which one
    grows with light and two do not. The line has the circuit's corner at white, and is nearest to it by least squares
    below: with y the light, as a share of white, from which on the two limit, cutoff_dark = 1 - 1.5 y + 0.5 y^2. So a
    second pole near the first is left out, and where the source follower limits, the darkest parts are too fast.

    The leak is a slope in volts a second, so its rate goes with 1 / theta_on (Nozaki and Delbruck 2017). Shot noise
    depends on thresholds and bandwidth too, but by no published equation in these terms: it stays.
    """
    limit_hz = min(found.follower_hz, found.amplifier_hz, LIMITS["cutoff_hz"][1])
    light = min(1.0, limit_hz / found.photoreceptor_hz)
    slower = float(np.mean(base.theta if base.theta_on is None else base.theta_on)) / found.theta_on
    return {
        "theta_on": found.theta_on,
        "theta_off": found.theta_off,
        "cutoff_hz": min(limit_hz, found.photoreceptor_hz),
        "cutoff_dark": max(1.0 - 1.5 * light + 0.5 * light**2, base.dark),
        "refractory_us": found.refractory_us,
        "leak_rate_hz": base.leak_rate_hz * slower,
        "leak_light_hz": base.leak_light_hz * slower,
    }


def parse_biases(texts: tuple[str, ...]) -> dict[str, Bias]:
    """NAME=COARSE/FINE or NAME=AMPERES as a dictionary. Raises ConfigError."""
    found: dict[str, Bias] = {}
    for text in texts:
        name, _, value = text.partition("=")
        coarse, is_code, fine = value.partition("/")
        try:
            found[name] = (int(coarse), int(fine)) if is_code else float(value)
        except ValueError:
            raise ConfigError(f"biases: {text!r} is wrong, expected NAME=COARSE/FINE or NAME=AMPERES") from None
    return found


def _current(name: str, value: Any) -> float:
    if isinstance(value, tuple | list):
        whole = all(isinstance(code, int | np.integer) and not isinstance(code, bool) for code in value)
        if len(value) != 2 or not whole or not (0 <= value[0] <= 7 and 0 <= value[1] <= 255):
            raise ConfigError(
                f"bias {name}: {value!r} is wrong, expected (coarse, fine), whole numbers of 0 to 7 and 0 to 255"
            )
        if value[1] == 0:
            raise ConfigError(f"bias {name}: fine code 0 is no known current, expected 1 to 255")
        return COARSE_A[value[0]] * value[1] / 255
    most = COARSE_A[-1]
    if isinstance(value, bool) or not isinstance(value, int | float | np.number) or not 0.0 < value <= most:
        raise ConfigError(
            f"bias {name}: {value!r} is wrong, expected (coarse, fine) or amperes, more than 0 and at most {most:g}"
        )
    return float(value)


def _threshold(name: str, ampere: float, reference: float) -> float:
    """Contrast threshold in ln units. name: of the bias that sets it; reference: DiffBn, in amperes."""
    theta = THRESHOLD_GAIN * math.log(ampere / reference) * (1.0 if name == "OnBn" else -1.0)
    if theta < LIMITS["theta_on"][0]:
        side = "above" if name == "OnBn" else "below"
        raise ConfigError(
            f"bias {name}: {ampere:.3g} A leaves no threshold, expected at least 15 % {side} DiffBn's {reference:.3g} A"
        )
    return theta
