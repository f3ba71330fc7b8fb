"""Many episodes played by several controllers, in processes, each kept in a file of its own."""

import gc
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from evslip.config.config import Config
from evslip.config.distributions import choices
from evslip.config.loading import config_from_text, dump_config
from evslip.config.params import Params
from evslip.control.candidates import Candidates
from evslip.control.controllers import CONTROLLERS, make_controller
from evslip.control.controllers.controller import Setup
from evslip.control.episode_truth import GripTruth
from evslip.control.evaluation.episode_record import (
    file_name,
    has_records,
    note_path,
    record_of,
    record_path,
    write_episode,
)
from evslip.control.evaluation.outcome import Outcome
from evslip.control.evaluation.play import Played, play
from evslip.control.evaluation.sources import sources_of
from evslip.control.evaluation.summary import ORACLE
from evslip.control.settings import step_us
from evslip.data.record import Record
from evslip.draws.draw_plan import pinned
from evslip.generation.runners import runner
from evslip.utils import atomic
from evslip.utils.errors import ConfigError, DataError, GraspFailed, PlanRejected

ORACLE_US = 2000
"""Time between two commands of the oracle: it reacts at the onset itself, however often others may."""
ASKED = "asked.json"
"""File beside a controller's outcomes that notes what they are of ..."""
KEYS = ("config", "step_us", "parameters")
"""... by these, and by what `sources_of` finds."""


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
        return Path(self.folder) / "episodes" / file_name(self.controller) / f"{self.split}-{self.index:07d}.json"

    @property
    def is_done(self) -> bool:
        """Whether an earlier run has left all that is asked for. Raises DataError."""
        if not self.path.exists() or self.records is None:
            return self.path.exists()
        record = record_path(Path(self.records), self.controller, self.split, self.index)
        return record.exists() or isinstance(_read(self.path), str)


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
    that has games or records of another configuration, or of a controller whose source was another one."""
    step = step_us(rate_hz)
    _check(config, players, split, step, sees=records is not None)
    text = dump_config(pinned(config))
    where, kept = Path(folder).absolute(), None if records is None else Path(records).absolute()
    asked = {
        controller: {"config": text, "step_us": step, "parameters": parameters} | sources_of(controller, parameters)
        for controller, parameters in players.items()
    }
    if len({file_name(controller) for controller in players}) < len(players):
        raise ConfigError(f"{', '.join(players)}: two of them have one folder; expected them in separate runs")
    notes = [(where / "episodes" / file_name(controller) / ASKED, controller) for controller in players]
    if kept is not None:
        notes += [(_note_of_records(kept, controller), controller) for controller in players]
    for path, controller in notes:  # none is written before all are known to be right
        _require(path, controller, asked[controller])
    for path, controller in notes:
        if not path.exists():
            atomic.write_text(path, _json(asked[controller]))
    place = None if kept is None else str(kept)
    return [
        Game(str(where), text, split, index, controller, json.dumps(parameters), _step(controller, step), place)
        for index in indices
        for controller, parameters in players.items()
    ]


def _check(config: Config, players: Mapping[str, Mapping[str, Any]], split: str, step: int, sees: bool) -> None:
    """Raise ConfigError or DataError for what can be known to fail before an episode is played."""
    candidates = Candidates(config, split=split)
    low_n, high_n = candidates.forces_n
    setup = Setup(candidates.size, step, 0, low_n, low_n, high_n, lambda: GripTruth(False, low_n, False))
    for name, parameters in players.items():
        try:
            _json(parameters)
        except TypeError:
            raise ConfigError(f"controller {name}: {parameters} is wrong, expected numbers and texts") from None
        controller = make_controller(name, **parameters)
        sees |= getattr(controller, "sees", True)
        if name in CONTROLLERS:  # of the package: such as a detector of another sensor
            controller.reset(setup)
    renderers = choices(config.render.renderer)
    if sees and set(renderers) != {"raycast"}:
        raise ConfigError(f"render.renderer: {', '.join(renderers)}: draws nothing live; expected raycast")


def _require(path: Path, controller: str, asked: Mapping[str, Any]) -> None:
    """Raise ConfigError where the games of a folder are of something else."""
    noted = _noted(path) if path.exists() else asked
    if noted is not None and _json(noted) == _json(asked):
        return
    of = "another configuration, rate or parameters"
    if noted is not None and all(_json(noted.get(key)) == _json(asked[key]) for key in KEYS):
        what = "model" if noted.get("model") != asked.get("model") else "source"
        of = f"{controller} before its {what} {'was changed' if what in noted else 'was noted'}"
    raise ConfigError(f"{path.parent}: holds episodes of {of}; expected another folder, or this one removed")


def _note_of_records(folder: Path, controller: str) -> Path:
    """File that notes what a controller's records are of. Raises ConfigError for records without it."""
    path = note_path(folder, controller)
    if not path.exists() and has_records(folder, controller):
        what = f"holds records of {controller}, and no {path.name} that says of which configuration"
        raise ConfigError(f"{folder}: {what}; expected another folder, or this one removed")
    return path


def _json(value: Any) -> str:
    return json.dumps(value, sort_keys=True) + "\n"


def _noted(path: Path) -> Any:
    """What the games of a folder are of; None where no one can say."""
    try:
        found = json.loads(path.read_text())
    except (OSError, ValueError):
        return None
    return found if isinstance(found, dict) else None


def play_game(game: Game) -> None:
    """Play a game and write what became of it. Raises EvslipError."""
    gc.collect()  # a policy of the last game that refers to itself holds, until then, some 100 MB
    try:
        played = _played(game, keep=game.records is not None)
    except (PlanRejected, GraspFailed) as error:
        atomic.write_text(game.path, json.dumps({"rejected": str(error)}) + "\n")
        return
    except ConfigError as error:
        raise ConfigError(f"{game}: {error}") from None
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


def disturbance_of(params: Params) -> str:
    """Kind of disturbance of a sample."""
    return params.disturbance.kind


def play_games(
    games: Sequence[Game], workers: int | None, notice: Callable[[str], None], progress: Callable[[], None]
) -> list[Outcome]:
    """Outcomes of all games that can be played, in their order; those that an earlier run has finished are read, and
    played again where they lack a record that is asked for. Raises EvslipError."""
    left = [game for game in games if not game.is_done]
    for _ in range(len(games) - len(left)):
        progress()
    for _ in runner("local")(play_game, left, workers, notice) if left else ():
        progress()
    found = [_read(game.path) for game in games]
    outcomes = [outcome for outcome in found if isinstance(outcome, Outcome)]
    if games and not outcomes:
        raise ConfigError(f"none of {len(games)} games can be played; the first, {games[0]}: {found[0]}")
    return outcomes


def earlier_outcomes(games: Sequence[Game], notice: Callable[[str], None]) -> list[Outcome]:
    """Outcomes of the controllers that are not among those of some games, but have played all of the same episodes in
    the same folder, in an earlier run; `notice` gets a line for each that has played some. Raises DataError."""
    asked, outcomes = _noted(games[0].path.with_name(ASKED)), []
    now, names = {game.path.parent for game in games}, sorted({game.path.name for game in games})
    for folder in sorted({path.parent for path in games[0].path.parent.parent.glob(f"*/{ASKED}")} - now):
        noted = _noted(folder / ASKED) or {}
        if any(noted.get(key) != asked[key] for key in KEYS[:2]):
            continue
        found = [_read(folder / name) for name in names if (folder / name).exists()]
        if len(found) == len(names):
            outcomes += [one for one in found if isinstance(one, Outcome)]
        elif found:
            what = f"has played {len(found)} of these {len(names)} episodes in an earlier run, and is not compared"
            notice(f"note: {folder.name} {what}; name it, too, to play the others")
    return outcomes


def _read(path: Path) -> Outcome | str:
    """An outcome, or why there is none."""
    try:
        row = json.loads(path.read_text())
    except (OSError, ValueError) as error:
        raise DataError(f"{path}: cannot be read: {error}; remove it to play the episode again") from None
    return str(row["rejected"]) if isinstance(row, dict) and "rejected" in row else Outcome.from_row(row, path)
