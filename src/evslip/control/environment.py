"""Gymnasium environments: hold an object, and lift it, with as little force as that takes."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from evslip.config.config import Config
from evslip.control.candidates import INDICES, Candidates
from evslip.control.episode import Episode
from evslip.control.observations import Window, observed
from evslip.control.picture import picture_of
from evslip.control.picture_window import PictureWindow
from evslip.control.rewards import RewardWeights
from evslip.control.settings import StepSettings, checked_index, step_us
from evslip.events.stream import empty_events
from evslip.utils.errors import ConfigError

ACTIONS = ("change", "force")


class HoldEnv(gymnasium.Env[Any, np.ndarray]):
    """Hold an object of unknown mass, friction and grip point while the arm carries it and disturbances come.

    An episode is one (config, split, index). It begins with the lift, its grip closed with the parameters'
    grip.force_n, terminates when the object is lost, and is truncated at the command to open.

    config, overrides: preset, TOML file or Config, and dotted keys such as {"object.mass_kg": 0.05}.
    split: "train" or "test", which share no parameter value.
    index: the one episode to play. None: `reset` draws one, or takes options={"index": 7}. Of a sample that the robot
        cannot do, the next one is played; info["index"] has it.
    obs: "events" (arrays of one length, of which the first `count` are events), "counts" (of ON and OFF, uint8),
        "voxels" (float32), "state" (the hand's senses alone: no frame is drawn) or "combined" (counts and state).
    action: "change" of the target force in [-1, 1], of at most `change_n_s` a second, or "force", in newtons.
    rate_hz: steps a second, a divisor of 1000 from 20 on.
    size: width and height of the sensor, in place of those of a preset or a file; not for a Config.
    settings: of `StepSettings`: change_n_s, window_s, most_events, bins, weights.

    Raises ConfigError, also for an action that is none.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array", "human"], "render_fps": 100}  # noqa: RUF012 - Gymnasium's
    preset, ends = "hold", "release"

    def __init__(
        self,
        config: Config | str | Path | None = None,
        overrides: Mapping[str, Any] | None = None,
        split: str = "train",
        index: int | None = None,
        obs: str = "counts",
        action: str = "change",
        rate_hz: int = 100,
        size: tuple[int, int] | None = None,
        render_mode: str | None = None,
        **settings: Any,
    ):
        own, self._step_us = StepSettings.of(settings), step_us(rate_hz)
        self._candidates = Candidates(self.preset if config is None else config, overrides, split, size, self.ends)
        self._index = None if index is None else checked_index(index)
        if action not in ACTIONS:
            raise ConfigError(f"action: {action!r} is unknown; expected one of {', '.join(ACTIONS)}")
        known = self.metadata["render_modes"]
        if render_mode is not None and render_mode not in known:
            raise ConfigError(f"render_mode: {render_mode!r} is unknown; expected one of {', '.join(known)}")
        self.render_mode = render_mode
        self.metadata = self.metadata | {"render_fps": rate_hz}
        self._action, self._change_n = action, own.change_n_s * self._step_us / 1e6
        self._weights = RewardWeights.of(own.weights)
        self._least_n, self._most_n = self._candidates.forces_n
        length_us = self._step_us if own.window_s is None else round(own.window_s * 1e6)
        self._window = Window(self._candidates.size, length_us, own.most_events, own.bins)
        self.observation_space, self._observe = observed(obs, self._window)
        self._sees = render_mode is not None or obs != "state"
        low, high = (-1.0, 1.0) if action == "change" else (self._least_n, self._most_n)
        self.action_space = spaces.Box(low, high, (1,), np.float32)
        self._episode: Episode | None = None
        self._display = PictureWindow(rate_hz) if render_mode == "human" else None
        self.events = empty_events()
        """Events of the last window, whatever `obs` is; none where no frame is drawn."""

    @property
    def episode(self) -> Episode:
        """The motion under control. Raises ConfigError before `reset`."""
        if self._episode is None:
            raise ConfigError("the environment has no episode yet: call reset()")
        return self._episode

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Begin an episode: that of options={"index": ...}, or the environment's own, or one that is drawn. Raises
        ConfigError."""
        super().reset(seed=seed)
        self._episode = None  # where this fails, no step goes on with the one before
        if not (options is None or isinstance(options, Mapping)):
            raise ConfigError(f"options: {options!r} is wrong, expected such as {{'index': 7}}")
        unknown = set(options or {}) - {"index"}
        if unknown:
            raise ConfigError(f"options: {', '.join(map(repr, unknown))}: unknown; expected index alone")
        index = self._index
        if options and options.get("index") is not None:
            index = checked_index(options["index"])
        if index is None:
            index = int(self.np_random.integers(INDICES))
        self._episode = episode = self._candidates.playable(index, self._step_us, sees=self._sees)
        self.events = self._window.until(episode.events, episode.t_us)
        self._show()
        return self._observation(), self._info(self._terms(0.0, 0.0, 0.0))

    def step(self, action: np.ndarray) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Command a force for the next step. Raises ConfigError for an action that is none, and after the end."""
        episode, target_n = self.episode, self._target(action)
        if episode.is_over:
            raise ConfigError("the episode is over: call reset()")
        before, since_us = len(episode.monitor), episode.t_us
        episode.advance(since_us + self._step_us, target_n)
        turned_deg, moved_mm = episode.monitor.since(before - 1)
        self.events = self._window.after(self.events, episode.events, since_us, episode.t_us)
        terms = self._terms(turned_deg, moved_mm, (episode.t_us - since_us) / 1e6)  # the last step may be short
        self._show()
        ended = episode.is_over and not episode.is_lost
        return self._observation(), sum(terms.values()), episode.is_lost, ended, self._info(terms)

    def render(self) -> Any:
        """Frame of the camera with the events of the last window over it, uint8 (height, width, 3), of "rgb_array"."""
        if self.render_mode != "rgb_array":
            return None
        return picture_of(self.episode.frame, self.events, self._window.size)

    def close(self) -> None:
        """Forget the episode, and close the window."""
        self._episode, self.events = None, empty_events()
        if self._display is not None:
            self._display.close()
        super().close()

    def _target(self, action: Any) -> float:
        """Force in newtons that an action asks for. Raises ConfigError."""
        try:
            values = np.asarray(action)
            values = values.astype(np.float64) if values.dtype.kind in "biuf" else np.array(np.nan)
        except (TypeError, ValueError):
            values = np.array(np.nan)
        if values.shape != (1,) or not np.isfinite(values).all():
            raise ConfigError(f"action: {action!r} is wrong, expected an array of one finite number")
        if self._action == "force":
            wanted = float(values[0])
        else:
            wanted = self.episode.target_n + self._change_n * float(np.clip(values[0], -1.0, 1.0))
        return min(max(wanted, self._least_n), self._most_n)

    def _observation(self) -> Any:
        return self._observe(self.events, self.episode.senses, self.episode.t_us)

    def _terms(self, turned_deg: float, moved_mm: float, seconds: float) -> dict[str, float]:
        episode = self.episode
        truth = episode.truth
        excess_n = episode.simulation.force_n - truth.least_n if truth.hangs else 0.0
        return self._weights.terms(turned_deg, moved_mm, episode.is_lost, excess_n, seconds)

    def _info(self, terms: dict[str, float]) -> dict[str, Any]:
        episode = self.episode
        simulation, monitor = episode.simulation, episode.monitor
        return {
            "index": episode.params.index,
            "t_us": episode.t_us,
            "theta_deg": monitor.theta_deg,
            "slide_mm": monitor.slide_mm,
            "utilisation": float(simulation.utilisation.max()),
            "least_force_n": episode.truth.least_n,
            "force_n": simulation.force_n,
            "target_n": episode.target_n,
            "slips": monitor.slips,
            "is_sliding": monitor.is_sliding,
            "is_lost": episode.is_lost,
            "events": self.events.count,
            "reward_terms": terms,
        }

    def _show(self) -> None:
        if self._display is not None:
            self._display.show(picture_of(self.episode.frame, self.events, self._window.size))


class LiftEnv(HoldEnv):
    """Lift an unknown object, and find the least force that holds it. As HoldEnv, but for the preset `lift`, whose grip
    is weak at first, and for the end: before the object is set down."""

    preset, ends = "lift", "placement"
