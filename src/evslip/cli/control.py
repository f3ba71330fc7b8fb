"""The verb that plays controllers of the grip force."""

import sys
from pathlib import Path
from typing import Annotated, Any

from tyro.conf import UseAppendAction, arg

from evslip.cli.options import Overrides, Split, overrides
from evslip.utils.console import console, print_table
from evslip.utils.errors import ConfigError
from evslip.utils.progress import Step

Names = Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="NAME")]
Parameters = Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="NAME=VALUE")]


def control(
    *,
    out: Path,
    controller: Names = (),
    policy: str | None = None,
    parameter: Parameters = (),
    config: str = "hold",
    set: Overrides = (),
    split: Split = "test",
    count: int = 200,
    rate_hz: int = 100,
    workers: int | None = None,
    records: Path | None = None,
    videos: int = 0,
) -> None:
    """Play controllers of the grip force: what they lose, how far it slips, how fast and how hard they grip.

    Every controller plays the same episodes, and so do `constant`, which keeps the force of the start, and `oracle`,
    which knows the truth. Run it again after a stop to go on, or with other controllers to compare.

    Args:
        out: Folder for control.html, control.json and outcomes.jsonl.
        controller: constant, strong, oracle, late-oracle, event-rate, detector or detector-pi; may be given several
            times. Default: detector.
        policy: A controller of your own, module:Class, in the current folder or installed.
        parameter: Parameter of the controller, such as model=my_model or relaxation.share_s=0.2; may be given several
            times.
        config: Preset or TOML file that the episodes are drawn from.
        set: Override of the configuration, such as object.mass_kg=0.05; may be given several times.
        split: Which split; train and test share no parameter value.
        count: Episodes, from index 0 on. Those that the robot cannot do are left out.
        rate_hz: Steps a second.
        workers: Processes; default: one a core. The result does not depend on it.
        records: Folder for a record of each episode, for `evslip view`.
        videos: Most failures to show as videos.
    """
    from evslip.config.loading import load_config
    from evslip.control.controllers import make_controller
    from evslip.control.evaluation.games import games_of, play_games, replay
    from evslip.control.evaluation.summary import OPEN_LOOP, ORACLE, summarise
    from evslip.view.control.page import label, worst, write_control
    from evslip.view.control.tables import figure_table

    if count < 1:
        raise ConfigError(f"count: {count} is out of range, expected 1 or more")
    if policy is not None:
        sys.path.insert(0, str(Path.cwd()))  # a policy is a file of the user's, where it is written
    named = [*controller, *([policy] if policy else [])] or ["detector"]
    given: dict[str, Any] = overrides(parameter)
    if given and len(named) > 1:
        raise ConfigError(f"parameter: {len(named)} controllers are named; expected one that the parameters are of")
    if given and named[0] in (OPEN_LOOP, ORACLE):
        raise ConfigError(f"parameter: {named[0]} is what the others are compared with, and takes none")
    for name in named:
        make_controller(name, **given)  # what is wrong shows now
    players = {OPEN_LOOP: {}, ORACLE: {}} | dict.fromkeys(named, given)
    games = games_of(out, load_config(config, overrides(set)), players, split, range(count), rate_hz, records)
    with Step("control", len(games)) as advance:
        outcomes = play_games(games, workers, console.print, advance)
    films: dict[str, Path] = {}
    chosen = [one for one in worst(outcomes) if one.controller in named][:videos]
    if chosen:
        from evslip.view.pictures.slip_video import Film

        by_name = {(game.controller, game.index): game for game in games}
        with Step("videos", len(chosen)) as advance:
            for one in chosen:
                game = by_name[one.controller, one.index]
                path = out / "videos" / f"{game.path.parent.name}-{game.path.stem}.mp4"
                Film([replay(game)]).write(path)
                films[label(one)] = path
                advance()
    write_control(out, f"{config}, split {split}, {rate_hz} Hz", outcomes, films)
    print_table(figure_table(summarise(outcomes)))
    console.print(f"{out / 'control.html'}, control.json, outcomes.jsonl")
