"""One episode, played by a controller."""

from typing import NamedTuple

import numpy as np

from evslip.control.controllers.controller import Controller, Setup
from evslip.control.episode import Episode
from evslip.control.slip_monitor import Slide
from evslip.events.stream import FIELDS, Events, concatenate
from evslip.utils.errors import ConfigError


class Played(NamedTuple):
    """Course of an episode. Arrays have a row for each step of control, at the step's end."""

    episode: Episode
    """As it ended."""
    t_us: np.ndarray
    """Times in microseconds, int64 of shape (n,)."""
    decided_us: np.ndarray
    """Times of the commands, at the steps' begins; of shape (n,)."""
    force_n: np.ndarray
    """Force of the actuator; of shape (n,)."""
    target_n: np.ndarray
    """Force that was commanded; of shape (n,)."""
    least_n: np.ndarray
    """Least force that holds; of shape (n,)."""
    hangs: np.ndarray
    """Whether the object hangs free, in the grip; bool of shape (n,)."""
    alarm: np.ndarray
    """Whether the controller takes the object to slip; bool of shape (n,)."""
    course: tuple[np.ndarray, np.ndarray]
    """Times of all samples of the physics in microseconds, and the actuator's force at each; both of shape (m,)."""
    events: Events
    """All events since the grip closed, where they were kept; else none."""

    @property
    def slides(self) -> list[Slide]:
        """Movements of the object in the grip."""
        return self.episode.monitor.slides


def play(episode: Episode, controller: Controller, step_us: int, limits_n: tuple[float, float], keep: bool) -> Played:
    """Play an episode from its start to its end.

    step_us: time between two commands; limits_n: least and most force that are commanded, as far as the episode allows
    them; keep: whether its events are kept. Raises GraspFailed, ConfigError for a force that is none, and what the
    controller raises.
    """
    camera, (low, high) = episode.params.camera, np.clip(limits_n, *episode.allowed_n).tolist()
    size = camera.width, camera.height
    controller.reset(Setup(size, step_us, episode.start_us, episode.target_n, low, high, lambda: episode.truth))
    rows, kept = [], [episode.events]
    while not episode.is_over:
        decided_us, force_n = episode.t_us, _newtons(controller, episode)
        episode.advance(episode.t_us + step_us, min(max(force_n, low), high))
        truth = episode.truth
        hangs = truth.hangs and not episode.is_lost
        forces = episode.simulation.force_n, episode.target_n, truth.least_n
        rows.append((episode.t_us, decided_us, *forces, hangs, bool(getattr(controller, "alarm", False))))
        if keep:
            kept.append(episode.events)
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    return Played(episode, *columns, course=episode.simulation.forces_n(episode.start_us), events=concatenate(kept))


def _newtons(controller: Controller, episode: Episode) -> float:
    """The force that a controller gives for a step. Raises ConfigError for what is none."""
    # Read-only: a policy that changed them in place would change the record of the episode.
    columns = {name: column.view() for name in FIELDS if (column := getattr(episode.events, name)) is not None}
    for column in columns.values():
        column.flags.writeable = False
    given = controller.step(episode.events.replace(**columns), episode.senses)
    try:
        value = np.asarray(given)
        force_n = value.item() if value.dtype.kind in "biuf" and value.size == 1 else np.nan
    except (TypeError, ValueError):  # what NumPy makes no array of
        force_n = np.nan
    if not np.isfinite(force_n):
        raise ConfigError(
            f"step gave {' '.join(repr(given).split())[:60]} at {episode.t_us / 1e6:g} s; expected newtons"
        )
    return float(force_n)
