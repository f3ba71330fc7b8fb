"""Verbs that train, measure and use detectors."""

from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import Positional, arg

from evslip.cli.options import Align, Split
from evslip.learn.networks import NETWORKS
from evslip.utils.console import console, print_table, progress_bar
from evslip.utils.errors import ConfigError

NETWORK = f"Name of a network: {', '.join(NETWORKS)}; of one that an installed package offers; or module:Class."


def windows(
    datasets_and_out: Annotated[Positional[tuple[Path, ...]], arg(metavar="DATASET... OUT")],
    *,
    split: Split | None = None,
    length_s: float = 0.16,
    hop_s: float = 0.16,
    labels: Literal["motion", "angular", "paper"] = "motion",
    slip_deg: float = 1.0,
    hold_deg: float = 0.1,
    slip_mm: float = 2.0,
    hold_mm: float = 0.1,
    balance: bool = True,
    seed: int = 0,
    visualize: Path | None = None,
    vt_snn: Path | None = None,
) -> None:
    """Cut data sets, or imported recordings, into labelled windows.

    Args:
        datasets_and_out: Folders of data sets, or of imported recordings, or single records; then the HDF5 file to
            write. Recordings have windows where a person's labels say slip or hold. Of several, windows carry the name
            of their folder, and all must be from sensors of one size.
        split: Only this split; default: all there is.
        length_s: Length of a window.
        hop_s: From one window's start to the next one's.
        labels: What counts. motion: turning or sliding in the hand. angular: turning alone, as in the paper. paper: a
            rise of the paper's theta alone, as its public code has it; for comparison.
        slip_deg: A window is slip from this rotation in the hand on.
        hold_deg: A window is hold below this rotation; between the two it is dropped.
        slip_mm: By motion, a window is slip also from this slide in the hand on.
        hold_mm: By motion, a window is hold only below this slide.
        balance: Remove windows of the commoner label at random until both are equally many.
        seed: Seed of that removal.
        visualize: Folder for a video and single pictures of every window, named by label and change of angle; 17 files
            and about 4 s a window.
        vt_snn: Folder in which to write the windows in VT-SNN's layout, too: prophesee_recordings/rotate_01_td.mat ...
    """
    from evslip.data.recordings import open_samples
    from evslip.exchange.vt_snn import export_windows
    from evslip.windows.cutting import windows_of
    from evslip.windows.mixture import mixture
    from evslip.windows.window_set import WindowSettings

    *datasets, out = datasets_and_out
    if not datasets:
        raise ConfigError(f"windows: {out} alone is named; expected one or more data sets, then the file to write")
    settings = WindowSettings(
        length_s=length_s, hop_s=hop_s, labels=labels, slip_deg=slip_deg, hold_deg=hold_deg, slip_mm=slip_mm,
        hold_mm=hold_mm, balance=balance, seed=seed,
    )  # fmt: skip
    sets = [open_samples(path) if split is None else open_samples(path).split(split) for path in datasets]
    if visualize is not None and (len(sets) > 1 or not sets[0].splits):
        which = "several are given" if len(sets) > 1 else f"{datasets[0]} is none"
        raise ConfigError(f"visualize: expected one data set of simulated samples, whose frames can be drawn; {which}")
    if visualize is not None:
        from evslip.view.pictures.window_pictures import check_folder

        check_folder(visualize)
    cut = windows_of(mixture(sets), settings)
    cut.save(out)
    console.print(f"{out}: {cut.summary()}")
    if vt_snn is not None:
        console.print(f"{vt_snn}: {export_windows(cut, vt_snn)} files")
    if visualize is not None:
        from evslip.view.pictures.window_pictures import write_windows

        with progress_bar("windows", len(cut)) as advance:
            write_windows(visualize, cut, sets[0], advance)


def train(
    windows: Positional[Path],
    out: Positional[Path],
    *,
    model: Annotated[str, arg(help=NETWORK)] = "cnn3d_bn",
    epochs: int | None = None,
    batch: int | None = None,
    lr: float | None = None,
    schedule: Literal["cycle", "constant"] | None = None,
    optimiser: Literal["adam", "rmsprop"] | None = None,
    weight_decay: float | None = None,
    smoothing: float | None = None,
    patience: int | None = None,
    val_fraction: float = 0.2,
    protocol: Literal["trajectory", "paper"] = "trajectory",
    flip: bool = True,
    shift_px: int = 0,
    time_dropout: float = 0.0,
    event_dropout: float = 0.0,
    noise_hz: float = 0.0,
    noise: Path | None = None,
    wandb: bool = False,
    seed: int = 0,
) -> None:
    """Train a detector on windows; validation is on trajectories kept apart. Run it again after a stop to go on.

    The course of the training is in the folder `tensorboard` of the model: tensorboard --logdir OUT.

    Args:
        windows: HDF5 file made by `evslip windows`.
        out: Folder for the model.
        epochs: Most passes over the windows; training stops earlier when validation stops improving. What is not given
            here and in the next seven options is what suits the network.
        batch: Windows a step.
        lr: Learning rate.
        schedule: cycle: the rate rises, then falls to nothing. constant: as in the paper.
        optimiser: adam (AdamW) or rmsprop.
        weight_decay: How strongly weights are pulled towards 0.
        smoothing: Label smoothing: keeps the probabilities of few windows from running to 0 and 1.
        patience: Epochs without a better validation loss before training stops.
        val_fraction: Share of the trajectories kept for validation.
        protocol: trajectory: validation on other trajectories. paper: on other windows of the same ones, as the paper's
            public code does; for comparison alone.
        flip: Mirror half of the windows left to right.
        shift_px: Move each window by up to so many pixels.
        time_dropout: Silence up to this share of each window's time.
        event_dropout: Remove up to this share of each window's events.
        noise_hz: Add up to so many events a second and pixel at random, as a sensor's shot noise does.
        noise: Recording whose events are added to the windows.
        wandb: Log to Weights & Biases, too; WANDB_MODE=offline keeps it on this machine.
        seed: Seed of initial weights, order and augmentation.
    """
    from evslip.learn import TrainSettings
    from evslip.learn import train as run
    from evslip.windows.window_set import load_windows

    settings = TrainSettings.of(
        model, epochs=epochs, batch=batch, lr=lr, schedule=schedule, optimiser=optimiser, weight_decay=weight_decay,
        smoothing=smoothing, patience=patience, val_fraction=val_fraction, protocol=protocol, flip=flip,
        shift_px=shift_px, time_dropout=time_dropout, event_dropout=event_dropout, noise_hz=noise_hz,
        noise=str(noise or ""), seed=seed,
    )  # fmt: skip
    result = run(load_windows(windows), out, settings, wandb=wandb)
    console.print(f"{out}: {result.summary()}")


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
    from evslip.learn.checkpoint import load_model
    from evslip.learn.evaluation.assessment import assess
    from evslip.learn.evaluation.comparison import compare
    from evslip.learn.evaluation.test_data import open_exam
    from evslip.learn.networks import register
    from evslip.learn.shipped import is_shipped
    from evslip.view.evaluation.evaluation import alarm_table, comparison_table, short_names, write_evaluation

    *models, data = models_and_data
    if not models:
        raise ConfigError(f"evaluate: {data} alone is named; expected one or more models, then the data")
    if network is not None:
        register(network)
    for model in models:
        load_model(model)  # a wrong name shows now, not after the models before it
    exam = open_exam(data, split)
    found = []
    for model in models:
        with progress_bar(f"evaluate {model.name}", exam.steps) as advance:
            found.append(assess(model, exam, hop_s=hop_s, resamples=resamples, align=align, progress=advance))
    own = len(models) == 1 and not is_shipped(models[0])
    folder = out or (models[0] if own else Path("evaluation"))
    write_evaluation(folder, found, exam)
    scores = found[0].scores
    console.print(f"{scores.windows} windows of {scores.trajectories} trajectories: {exam.name}")
    print_table(comparison_table(compare(found)))
    if any(one.own for one in found):
        print_table(list(zip(*alarm_table(found, short_names(found)), strict=True)))
    for note in dict.fromkeys(note for one in found for note in one.notes):
        console.print(f"note: {note}")
    console.print(f"{folder / 'evaluation.html'}, evaluation.json, scores.png, circumstances.png, failures/")


def export(model: Positional[Path], out: Positional[Path]) -> None:
    """Write a spiking detector as NIR, which simulators and neuromorphic chips read.

    NIR (Neuromorphic Intermediate Representation) describes weights, leaky integrators and thresholds. The graph begins
    at the spikes of the input neurons. Needs the extra nir.

    Args:
        model: Folder of a model of the network snn.
        out: File to write, by custom *.nir.
    """
    from evslip.learn.checkpoint import load_model
    from evslip.learn.nir_graph import write_nir

    network, description = load_model(model)
    write_nir(network, out)
    parameters = sum(parameter.numel() for parameter in network.parameters())
    console.print(f"{out}: NIR graph of {model}, {description.model}, {parameters:,} weights")


def report(
    folder: Positional[Path],
    *,
    model: Path | None = None,
    windows: Path | None = None,
    compare: tuple[Path, ...] = (),
    pictures: int = 60,
    out: Path | None = None,
) -> None:
    """Write one HTML page that shows a data set, a model or an evaluation. It needs no network.

    Args:
        folder: A data set, imported recordings, or one record; a model; or what `evslip evaluate` wrote.
        model: Of a data set: folder of a model trained on it, or of its evaluation.
        windows: Of a data set: HDF5 file of its windows.
        compare: Of a data set: real recordings, files of events of any known format, to compare its events with.
        pictures: Of a data set: most samples to draw in the gallery, which lists all.
        out: Page to write; default: report.html in the folder.
    """
    from evslip.data.record_file import read_recording
    from evslip.data.recordings import open_samples
    from evslip.view.report.report import is_model_or_evaluation, write_model_report, write_report

    if pictures < 0:
        raise ConfigError(f"pictures: {pictures} is out of range, expected 0 or more")
    where = out or (folder.parent if folder.is_file() else folder) / "report.html"
    if is_model_or_evaluation(folder):
        given = {"model": model, "windows": windows, "compare": compare}
        for name, value in given.items():
            if value:
                raise ConfigError(f"{name}: {folder} is no data set, to which alone {name} belongs")
        console.print(f"report: {write_model_report(where, folder)}")
        return
    samples, real = open_samples(folder), [read_recording(path) for path in compare]
    page = write_report(where, samples, windows, model, compare=real, most_pictures=pictures)
    console.print(f"report: {page}")


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
    from evslip.data.record_file import read_recording
    from evslip.learn import detect as run
    from evslip.learn.networks import register
    from evslip.view.pictures.detection import write_csv, write_png

    given = [*([] if model is None else [model]), *model_and_recording]
    if len(given) != 2:
        told = " ".join(map(str, given)) or "nothing"
        raise ConfigError(
            f"detect: {told} given; expected a model and a recording, such as: detect --model default REC"
        )
    if network is not None:
        register(network)
    which, recording = given
    record = read_recording(recording)
    detection = run(which, record.events, record.size, align=align, hop_s=hop_s)
    stem = out or recording.with_name(recording.stem + "-slip")
    csv, png = stem.with_suffix(".csv"), stem.with_suffix(".png")
    write_csv(detection, csv)
    write_png(detection, png, title=recording.name, truth=record.truth, intervals=record.intervals)
    console.print(f"{csv} and {png}: {detection.summary()}")
