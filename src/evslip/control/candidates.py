"""Episodes by configuration, split and index, and what follows one that cannot be played."""

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from evslip.config.config import Config
from evslip.config.distributions import extremes
from evslip.config.loading import load_config
from evslip.control.episode import Episode, require_one_camera
from evslip.draws.draw import draw
from evslip.events.checks import sensor_size
from evslip.utils.errors import ConfigError, GraspFailed, PlanRejected
from evslip.utils.seeds import SPLITS

MOST_REJECTED = 100
"""Candidates in a row that cannot be played: then the configuration is wrong."""
INDICES = 10_000_000
"""Indices from which one is drawn: as many as a split of a data set may have samples."""


class Candidates:
    """The episodes of a split of a configuration."""

    def __init__(
        self,
        config: Config | str | Path = "hold",
        overrides: Mapping[str, Any] | None = None,
        split: str = "train",
        size: tuple[int, int] | None = None,
        ends: str = "release",
    ):
        """size: width and height of the sensor, in place of the configuration's. Raises ConfigError."""
        if not isinstance(config, Config | str | Path):
            raise ConfigError(f"config: {type(config).__name__}, expected a preset's name, a TOML file or a Config")
        if not (
            overrides is None or (isinstance(overrides, Mapping) and all(isinstance(key, str) for key in overrides))
        ):
            raise ConfigError(f"overrides: {overrides!r:.60} is wrong, expected such as {{'object.mass_kg': 0.05}}")
        changes = dict(overrides or {})
        if size is not None:
            changes |= dict(zip(("camera.width", "camera.height"), sensor_size("size", size), strict=True))
        if isinstance(config, Config) and changes:
            raise ConfigError("overrides, size: belong to a preset or a file, not to a Config that is made already")
        self.config = config if isinstance(config, Config) else load_config(config, changes)
        if split not in SPLITS:
            raise ConfigError(f"split: {split!r} is unknown; expected one of {', '.join(SPLITS)}")
        self.split, self._ends = split, ends
        with suppress(PlanRejected):  # what is wrong with it shows now, but for what is of this sample alone
            require_one_camera(draw(self.config, 0, split))

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the sensor."""
        camera = self.config.camera
        return int(camera.width), int(camera.height)

    @property
    def forces_n(self) -> tuple[float, float]:
        """Least and most force that any episode allows."""
        return extremes(self.config.grip.least_n)[0], extremes(self.config.grip.most_n)[1]

    def make(self, index: int, step_us: int, *, sees: bool) -> Episode:
        """The episode of an index. Raises PlanRejected, GraspFailed, ConfigError."""
        return Episode(draw(self.config, index, self.split), step_us=step_us, sees=sees, ends=self._ends)

    def playable(self, index: int, step_us: int, *, sees: bool) -> Episode:
        """The episode of an index, or of the first one after it that can be played. Raises ConfigError."""
        rejected = ""
        for candidate in range(index, index + MOST_REJECTED):
            try:
                return self.make(candidate, step_us, sees=sees)
            except (PlanRejected, GraspFailed) as error:
                rejected = f"{self.split}/{candidate}: {error}"
        raise ConfigError(f"none of {MOST_REJECTED} episodes can be played; the last, {rejected}")
