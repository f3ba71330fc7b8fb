"""Verbs that measure and use detectors."""

from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from evslip.cli.options import Split
from evslip.utils.console import console, print_table
from evslip.utils.errors import ConfigError
from evslip.utils.progress import Step
from evslip.windows.settings import Align


def evaluate(
    models_and_data: Annotated[Positional[tuple[Path, ...]], arg(metavar="MODEL... DATA")],
    *,
    out: Path | None = None,
    split: Split | None = None,
    hop_s: float = 0.02,
    resamples: int = 1000,
    align: Align | None = None,
    network: str | None = None,
) -> None:
    """Examine detectors on data that they have not been trained on, and compare them.

    Scores with confidence intervals, detected slips, false alarms and latency, accuracy by circumstances, cost:
    printed, and written as JSON, as a page and as pictures, those of the worst windows too.

    Args:
        models_and_data: Folders of models, or `default`, the one of the package; then what to examine them on: a data
            set, a record, a folder of records, or a file of `evslip windows` (scores alone: alarms and circumstances
            need records).
        out: Folder for the files; default: the model's folder; of several models, or of `default`, `evaluation`.
        split: Of a data set, only this split; default: test if there is one, else all.
        hop_s: Time between two answers on records; latencies are exact to it.
        resamples: Resamples of the trajectories that the confidence intervals come from.
        align: On a sensor of another size than the detector was trained on, look at as many pixels around its centre,
            or from its corner. Without it such data are refused.
        network: Class of the models' network, module:Class, where it is of another package that does not offer it.
    """
    from evslip.learn.checkpoint import is_shipped, load_model
    from evslip.learn.evaluation.comparison import compare
    from evslip.learn.evaluation.evaluation import evaluate_model
    from evslip.learn.evaluation.evaluation_data import open_evaluation_data
    from evslip.learn.networks import register
    from evslip.view.evaluation.files import write_evaluation
    from evslip.view.evaluation.tables import alarm_table, comparison_table, short_names

    if len(models_and_data) < 2:
        words = " ".join(map(str, models_and_data)) or "nothing"
        raise ConfigError(f"evaluate: {words} given; expected one or more models, then the data")
    *models, data = models_and_data
    if network is not None:
        register(network)
    for model in models:
        load_model(model)  # a wrong name shows now, not after the models before it
    examined = open_evaluation_data(data, split)
    found = []
    for model in models:
        with Step(f"evaluate {model.name}", examined.steps) as advance:
            found.append(
                evaluate_model(model, examined, hop_s=hop_s, resamples=resamples, align=align, progress=advance)
            )
    own = len(models) == 1 and not is_shipped(models[0])
    folder = out or (models[0] if own else Path("evaluation"))
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
    model: Path | None = None,
    out: Path | None = None,
    hop_s: float = 0.02,
    align: Align | None = None,
    network: str | None = None,
) -> None:
    """Run a detector over a recording: slip probability over time as CSV and PNG, beside the labels if it has any.

    Args:
        model_and_recording: Folder of a model, unless --model names it; then a record, a recording or plain events, a
            file of any known format.
        model: Folder of the model, or `default`, the one of the package.
        out: Name of the two files without suffix; default: beside the recording.
        hop_s: Time between two answers.
        align: On a sensor of another size than the detector was trained on, look at as many pixels around its centre,
            or from its corner (for a file that does not state the sensor's size). Without it such data are refused.
        network: Class of the model's network, module:Class, where it is of another package that does not offer it.
    """
    from evslip.data.record_file import open_recording
    from evslip.learn import detect as run
    from evslip.learn.networks import register
    from evslip.view.pictures.detection import write_detection

    given = [*([] if model is None else [model]), *model_and_recording]
    if len(given) != 2:
        words = " ".join(map(str, given)) or "nothing"
        raise ConfigError(
            f"detect: {words} given; expected a model and a recording, such as: detect --model default REC"
        )
    if network is not None:
        register(network)
    which, recording = given
    record, parts = open_recording(recording)
    detection = run(which, parts, record.size, align=align, hop_s=hop_s)
    stem = out or recording.with_name(recording.stem + "-slip")
    csv, png = stem.with_suffix(".csv"), stem.with_suffix(".png")
    write_detection(detection, csv, png, title=recording.name, truth=record.truth, intervals=record.intervals)
    console.print(f"{csv} and {png}: {detection.summary()}")


def export(model: Positional[Path], out: Positional[Path]) -> None:
    """Write a spiking detector as NIR, which simulators and neuromorphic chips read.

    NIR (Neuromorphic Intermediate Representation) describes weights, leaky integrators and thresholds. The graph begins
    at the spikes of the input neurons. Needs the extra nir.

    Args:
        model: Folder of a model of the network snn.
        out: File to write, by custom *.nir.
    """
    from evslip.learn import load_model
    from evslip.learn.nir_graph import write_nir

    network, description = load_model(model)
    write_nir(network, out)
    parameters = sum(parameter.numel() for parameter in network.parameters())
    console.print(f"{out}: NIR graph of {model}, {description.model}, {parameters:,} weights")
