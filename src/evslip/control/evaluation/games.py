"""Many episodes played by several controllers, in processes, each kept in a file of its own."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from evslip.config.config import Config
from evslip.config.loading import config_from_text, dump_config
from evslip.config.params import Params
from evslip.control.candidates import Candidates
from evslip.control.controllers import make_controller
from evslip.control.evaluation.episode_record import record_of, write_episode
from evslip.control.evaluation.outcome import Outcome
from evslip.control.evaluation.play import Played, play
from evslip.control.evaluation.summary import ORACLE
from evslip.control.settings import step_us
from evslip.data.record import Record
from evslip.generation.runners import runner
from evslip.utils import atomic
from evslip.utils.errors import ConfigError, DataError, GraspFailed, PlanRejected

ORACLE_US = 2000
"""Time between two commands of the oracle: it reacts at the onset itself, however often others may."""


@dataclass(frozen=True)
class Game:
    """One episode for one controller; small and plain, so that a process can take it."""

    folder: str
    config_toml: str
    split: str
    index: int
    controller: str
    parameters: str
    """Parameters of the controller, as JSON."""
    step_us: int
    records: str | None = None
    """Folder for a record of the episode."""

    def __str__(self) -> str:
        return f"{self.controller} on {self.split}/{self.index}"

    @property
    def path(self) -> Path:
        """File of its outcome."""
        return Path(self.folder) / "episodes" / _file_name(self.controller) / f"{self.split}-{self.index:07d}.json"


def games_of(
    folder: Path,
    config: Config,
    players: Mapping[str, Mapping[str, Any]],
    split: str,
    indices: Sequence[int],
    rate_hz: int = 100,
    records: Path | None = None,
) -> list[Game]:
    """Games of some controllers, each with its parameters, on the same episodes. Raises ConfigError, also for a folder
    that has games of another configuration."""
    step, text = step_us(rate_hz), dump_config(config)
    where, kept = Path(folder).absolute(), None if records is None else str(Path(records).absolute())
    for controller, parameters in players.items():
        _require(where / "episodes" / _file_name(controller) / "asked.json", text, step, parameters)
    return [
        Game(str(where), text, split, index, controller, json.dumps(parameters), _step(controller, step), kept)
        for index in indices
        for controller, parameters in players.items()
    ]


def _require(path: Path, config_toml: str, step: int, parameters: Mapping[str, Any]) -> None:
    """Note what the games of a folder are of; ConfigError where they are of something else."""
    asked = json.dumps({"config": config_toml, "step_us": step, "parameters": parameters}, sort_keys=True) + "\n"
    if not path.exists():
        atomic.write_text(path, asked)
    if path.read_text() != asked:
        raise ConfigError(
            f"{path.parent}: holds episodes of another configuration, rate or parameters; expected another folder, or "
            "this one removed"
        )


def play_game(game: Game) -> None:
    """Play a game and write what became of it. Raises EvslipError."""
    try:
        played = _played(game, keep=game.records is not None)
    except (PlanRejected, GraspFailed) as error:
        atomic.write_text(game.path, json.dumps({"rejected": str(error)}) + "\n")
        return
    outcome = Outcome.of(game.controller, played, disturbance_of(played.episode.params))
    if game.records is not None:
        write_episode(Path(game.records), played, game.controller)
    atomic.write_text(game.path, json.dumps(outcome.row()) + "\n")


def replay(game: Game) -> Record:
    """Record of a game, played again. Raises EvslipError."""
    return record_of(_played(game, keep=True))


def _played(game: Game, keep: bool) -> Played:
    candidates = Candidates(config_from_text(game.config_toml), split=game.split)
    controller = make_controller(game.controller, **json.loads(game.parameters))
    episode = candidates.make(game.index, game.step_us, sees=keep or getattr(controller, "sees", True))
    return play(episode, controller, game.step_us, candidates.forces_n, keep)


def _step(controller: str, step: int) -> int:
    """Time between two commands."""
    return min(ORACLE_US, step) if controller == ORACLE else step


def _file_name(controller: str) -> str:
    return controller.replace(":", "_")


def disturbance_of(params: Params) -> str:
    """Kind of disturbance of a sample."""
    return params.disturbance.kind


def play_games(
    games: Sequence[Game], workers: int | None, notice: Callable[[str], None], progress: Callable[[], None]
) -> list[Outcome]:
    """Outcomes of all games that can be played, in their order; those that an earlier run has finished are read. Raises
    EvslipError."""
    left = [game for game in games if not game.path.exists()]
    for _ in range(len(games) - len(left)):
        progress()
    for _ in runner("local")(play_game, left, workers, notice) if left else ():
        progress()
    found = [_read(game.path) for game in games]
    outcomes = [outcome for outcome in found if isinstance(outcome, Outcome)]
    if games and not outcomes:
        raise ConfigError(f"none of {len(games)} games can be played; the first, {games[0]}: {found[0]}")
    return outcomes


def _read(path: Path) -> Outcome | str:
    """An outcome, or why there is none."""
    try:
        row = json.loads(path.read_text())
    except (OSError, ValueError) as error:
        raise DataError(f"{path}: cannot be read: {error}; remove it to play the episode again") from None
    return str(row["rejected"]) if isinstance(row, dict) and "rejected" in row else Outcome.from_row(row, path)
