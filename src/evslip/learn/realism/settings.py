"""Settings of a score of realism. Light to import, for the command line."""

from dataclasses import dataclass, replace
from typing import Literal

from evslip.utils.errors import ConfigError


@dataclass(frozen=True, kw_only=True)
class RealismSettings:
    """Which part of a recording is scored, and how its frames become events."""

    start_s: float | None = None
    """Beginning of what is scored, seconds after the recording's first event; default: the first time both have."""
    end_s: float | None = None
    """End of it; default: the last time both have."""
    seed: int = 0
    """Seed of the camera; the floor takes the next one. Also of the classifier."""
    interpolate: Literal["linear", "flow"] = "flow"
    """Between the recording's frames: log intensity changes evenly (linear), or frames are brought along optical flow
    (flow), for which the extra flow is needed."""
    upsample: int = 20
    """Intervals that flow makes of one, 2 to 64."""
    intensity: Literal["uint8", "srgb", "linear"] | None = None
    """Meaning of the frames' codes. uint8: mapped to log intensity as v2e does; srgb: decoded; linear: light. Default:
    linear for a fitted preset, as `evslip calibrate` has it, else uint8."""
    steady: bool | None = None
    """Take the frames' noise away where nothing changes. Default: for a fitted preset, as `evslip calibrate` has it."""
    mode: Literal["accurate", "v2e"] = "accurate"
    """Rules of the pixels."""
    classifier: bool = True
    """Train the classifier of the two-sample test; half a minute."""

    def __post_init__(self) -> None:
        if not 0 <= self.seed < 2**63:  # the next ones are seeds, too, and none has more than 64 bits
            raise ConfigError(f"seed: {self.seed} is out of range, expected 0 to {2**63 - 1}")

    def for_preset(self, preset: str) -> "RealismSettings":
        """With the defaults that depend on the camera."""
        # They import numpy, which help texts do without.
        from evslip.events.preset_file import SUFFIX
        from evslip.events.presets import FITTED

        fitted = preset.endswith(SUFFIX) or preset in FITTED
        return replace(
            self,
            intensity=self.intensity or ("linear" if fitted else "uint8"),
            steady=fitted if self.steady is None else self.steady,
        )
