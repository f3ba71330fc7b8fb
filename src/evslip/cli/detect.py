"""Verbs that measure and use detectors, and controllers of the grip force."""

import sys
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any

from tyro.conf import Positional, UseAppendAction, arg

from evslip.cli.options import SHIPPED, DetectorFolder, Overrides, Split, overrides, require_paths
from evslip.utils.atomic import require_place, storage_errors
from evslip.utils.console import console, print_table
from evslip.utils.errors import ConfigError
from evslip.utils.progress import Step
from evslip.windows.settings import Align

MOST_EPISODES = 100_000
"""Episodes of one run of `control`."""
FILES = (".csv", ".png")
"""Suffixes of what `detect` writes."""

Names = Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="NAME")]
Parameters = Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="NAME=VALUE")]
_EXAMINED = (
    f"Folders of models, or {SHIPPED}; then what to examine them on: a data set, a record, a folder of records, or a "
    "file of `evslip windows` (scores alone: alarms and conditions need records)."
)
_LABELLED_UNLIKE = (
    "the windows of each detector are labelled as those it was trained on, which differ: their scores are not of one "
    "truth; --labelled-as MODEL labels all alike"
)


def evaluate(
    models_and_data: Annotated[Positional[tuple[Path, ...]], arg(metavar="MODEL... DATA", help=_EXAMINED)],
    *,
    out: Path | None = None,
    split: Split | None = None,
    hop_s: float = 0.02,
    resamples: int = 1000,
    camera: str | None = None,
    align: Align | None = None,
    labelled_as: Path | None = None,
    network: str | None = None,
) -> None:
    """Examine detectors on data that they have not been trained on, and compare them.

    Scores with confidence intervals, detected slips, false alarms and latency, accuracy by conditions, cost:
    printed, and written as JSON, as a page and as pictures, those of the worst windows too.

    Args:
        out: Folder for the files; default: the model's folder; of several models, or one of the package, `evaluation`.
        split: Of a data set, only this split; default: test if there is one, else all.
        hop_s: Time between two answers on records, in whole milliseconds; latencies are exact to it.
        resamples: Resamples of the trajectories that the confidence intervals come from.
        camera: Of samples that two cameras saw, the one whose events are examined: left or right.
        align: On a sensor of another size than the detector was trained on, look at as many pixels around its centre,
            or from its corner. Without it such data are refused.
        labelled_as: Detector as whose training windows those of records are labelled; default: of each, its own.
        network: Class of the models' network, module:Class, where it is of another package that does not offer it.
    """
    from evslip.learn.checkpoint import is_shipped, load_model
    from evslip.learn.evaluation.comparison import compare
    from evslip.learn.evaluation.evaluation import evaluate_model
    from evslip.learn.evaluation.evaluation_data import open_evaluation_data
    from evslip.learn.networks import register
    from evslip.view.evaluation.page import write_evaluation
    from evslip.view.evaluation.tables import alarm_table, comparison_table, short_names

    require_paths("evaluate", models_and_data, len(models_and_data) >= 2, "one or more models, then the data")
    *models, data = models_and_data
    if network is not None:
        register(network)
    folder = out or (models[0] if len(models) == 1 and not is_shipped(models[0]) else Path("evaluation"))
    trained = [load_model(model)[1].windows for model in models]  # a wrong name shows now
    alike = None if labelled_as is None else load_model(labelled_as)[1].windows
    require_place(folder / "evaluation.html")
    examined = open_evaluation_data(data, split, camera)
    if alike and examined.windows is not None:
        raise ConfigError(f"labelled-as: the windows of {data} are labelled already; expected it with records")
    if alike:
        examined = replace(examined, name=f"{examined.name}, labelled as for {labelled_as}")
    elif examined.windows is None and any(one.labelling != trained[0].labelling for one in trained):
        examined = replace(examined, notes=(*examined.notes, _LABELLED_UNLIKE))
    examine = partial(evaluate_model, data=examined, hop_s=hop_s, resamples=resamples, align=align, labelled_as=alike)
    found = []
    for model in models:
        with Step(f"evaluate {model.name}", examined.steps) as advance:
            found.append(examine(model, progress=advance))
    write_evaluation(folder, found, examined)
    scores = found[0].scores
    console.print(f"{scores.windows} windows of {scores.trajectories} trajectories: {examined.name}")
    print_table(comparison_table(compare(found)))
    if any(one.own for one in found):
        print_table(list(zip(*alarm_table(found, short_names(found)), strict=True)))
    for note in dict.fromkeys(note for one in found for note in one.notes):
        console.print(f"note: {note}")
    console.print(f"{folder / 'evaluation.html'}, evaluation.json, scores.png, circumstances.png, failures/")


def detect(
    model_and_recording: Annotated[Positional[tuple[Path, ...]], arg(metavar="[MODEL] RECORDING")],
    *,
    model: DetectorFolder | None = None,
    out: Path | None = None,
    hop_s: float = 0.02,
    camera: str | None = None,
    align: Align | None = None,
    network: str | None = None,
) -> None:
    """Run a detector over a recording: slip probability over time as CSV and PNG, beside the labels if it has any.

    Args:
        model_and_recording: Folder of a model, unless --model names it; then a record, a recording or plain events, a
            file of any known format.
        out: Name of the two files without suffix; default: beside the recording.
        hop_s: Time between two answers.
        camera: Of a record of two cameras, the one that the detector looks through: left or right.
        align: On a sensor of another size than the detector was trained on, look at as many pixels around its centre,
            or from its corner (for a file that does not state the sensor's size). Without it such data are refused.
        network: Class of the model's network, module:Class, where it is of another package that does not offer it.
    """
    from evslip.codecs.formats import stem_of
    from evslip.data.record_file import open_recording
    from evslip.learn import detect as run
    from evslip.learn.networks import register
    from evslip.view.pictures.detection import write_detection

    given = [*([] if model is None else [model]), *model_and_recording]
    require_paths("detect", given, len(given) == 2, "a model and a recording, such as: detect --model default REC")
    if network is not None:
        register(network)
    which, recording = given
    stem = out or recording.with_name(f"{stem_of(recording)}-slip")
    if not stem.name:
        raise ConfigError(f"out: {stem} is no name of a file; expected one without suffix, such as {stem / 'slip'}")
    if stem.suffix in FILES:
        stem = stem.with_suffix("")
    # Other dots belong to the name, as in grip_0.5N.
    csv, png = (stem.with_name(stem.name + suffix) for suffix in FILES)
    if csv.exists() and recording.exists() and csv.samefile(recording):
        raise ConfigError(f"out: {csv} is the recording itself; give another name")
    require_place(csv)
    record, parts = open_recording(recording, camera)
    detection = run(which, parts, record.size, align=align, hop_s=hop_s)
    write_detection(detection, csv, png, title=recording.name, truth=record.truth, intervals=record.intervals)
    console.print(f"{csv} and {png}: {detection.summary()}")


def export(model: Positional[Path], out: Positional[Path]) -> None:
    """Write a spiking detector as NIR, which simulators and neuromorphic chips read.

    NIR (Neuromorphic Intermediate Representation) describes weights, leaky integrators and thresholds. The graph begins
    at the spikes of the input neurons. Needs the extra nir.

    Args:
        model: Folder of a model of the network snn.
        out: File to write, OUT.nir.
    """
    from evslip.learn import load_model
    from evslip.learn.nir_graph import write_nir

    network, description = load_model(model)
    write_nir(network, out)
    parameters = sum(parameter.numel() for parameter in network.parameters())
    console.print(f"{out}: NIR graph of {model}, {description.model}, {parameters:,} weights")


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
    which knows the truth. Run it again after a stop to go on, or with other controllers to compare: those that have
    played the same episodes into the folder stay in the table.

    Args:
        out: Folder for control.html, control.json and outcomes.jsonl.
        controller: constant, strong, oracle, cone-oracle, late-oracle, event-rate, detector or detector-pi; may be
            given several times. Default: detector.
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
    from evslip.control.evaluation.games import earlier_outcomes, games_of, play_games, replay
    from evslip.control.evaluation.summary import OPEN_LOOP, ORACLE, summarise
    from evslip.generation.runners import require_workers
    from evslip.view.control.page import figure_table, label, worst, write_control

    for key, number, low, high in (("count", count, 1, MOST_EPISODES), ("videos", videos, 0, MOST_EPISODES)):
        if not low <= number <= high:
            raise ConfigError(f"{key}: {number} is out of range, expected {low} to {high:,}")
    require_workers(workers)
    if policy is not None:
        sys.path.insert(0, str(Path.cwd()))  # a policy is a file of the user's, where it is written
    named = [*controller, *([] if policy is None else [policy])] or ["detector"]
    given: dict[str, Any] = overrides(parameter)
    if given and len(named) > 1:
        raise ConfigError(f"parameter: {len(named)} controllers are named; expected one that the parameters are of")
    if given and named[0] in (OPEN_LOOP, ORACLE):
        raise ConfigError(f"parameter: {named[0]} is what the others are compared with, and takes none")
    for name in named:
        make_controller(name, **given)  # what is wrong shows now
    players = {OPEN_LOOP: {}, ORACLE: {}} | dict.fromkeys(named, given)
    drawn_from = load_config(config, overrides(set))
    if records is not None:
        with storage_errors(records):  # before an episode is played, not after
            records.mkdir(parents=True, exist_ok=True)
    games = games_of(out, drawn_from, players, split, range(count), rate_hz, records)
    with Step("control", len(games)) as advance:
        outcomes = play_games(games, workers, console.print, advance)
    outcomes += earlier_outcomes(games, console.print)
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
    left_out = count - len({one.index for one in outcomes})
    if left_out:
        console.print(f"{left_out} of {count} episodes cannot be played: the motion or the grasp fails")
    write_control(out, f"{config}, split {split}, {rate_hz} Hz", outcomes, films)
    print_table(figure_table(summarise(outcomes)))
    console.print(f"{out / 'control.html'}, control.json, outcomes.jsonl")
