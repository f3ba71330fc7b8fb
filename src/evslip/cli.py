"""The command line: a function a verb, each of which calls one function of the library."""

import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro
from tyro.conf import Positional, UseAppendAction, arg

from evslip import __version__
from evslip.console import console, progress_bar
from evslip.errors import ConfigError, EvslipError

Overrides = Annotated[UseAppendAction[tuple[str, ...]], arg(name="set", metavar="KEY=VALUE")]
Split = Literal["train", "test"]
DESCRIPTION = (
    "Event-camera data for slip detection: generate, label, train, measure. `evslip VERB --help` explains a verb."
)


def demo(out: Positional[Path] = Path("demo"), *, count: int = 24, workers: int | None = None, seed: int = 0) -> None:
    """From nothing to a measured slip detector: generate samples, cut windows, train, evaluate, write a report.

    Args:
        out: Folder for everything.
        count: Number of samples; two thirds are for training, the rest is never seen by it.
        workers: Worker processes; default: one a core.
        seed: Seed of everything.
    """
    from evslip.demo import run_demo

    run_demo(out, count=count, workers=workers, seed=seed)


def show(
    preset: Positional[str],
    name: Positional[str | None] = None,
    *,
    set: Overrides = (),
    index: int | None = None,
    split: Split = "train",
) -> None:
    """Print a configuration in full, the parameters drawn for one index, or a camera with units and meanings.

    Args:
        preset: Name of a preset (demo, simple, complex), a TOML file, "parameters" for a table of all keys, or
            "camera" for the event cameras.
        name: After "camera": preset of the event camera; default: a table of all.
        set: Override, such as object.mass_kg=0.05; may be given several times.
        index: Show what is drawn for this sample instead.
        split: Split of that sample.
    """
    from evslip.config import dump_config, load_config
    from evslip.params import draw
    from evslip.reference import parameters_table

    if preset == "camera":
        _show_camera(name)
        return
    if name is not None:
        raise ConfigError(f"show {preset}: {name!r} is one word too many; only `show camera` takes a name")
    if preset == "parameters":
        print(parameters_table(), end="")
        return
    config = load_config(preset, overrides(set))
    if index is None:
        print(dump_config(config), end="")
    else:
        print(draw(config, index, split).model_dump_json(indent=2))


def _show_camera(name: str | None) -> None:
    from evslip.events.datasheet import datasheet, presets_table

    print(presets_table() if name is None else datasheet(name), end="")


def generate(
    preset: Positional[str],
    out: Positional[Path],
    *,
    count: int,
    workers: int | None = None,
    split: Split = "train",
    set: Overrides = (),
    runner: str = "local",
) -> None:
    """Generate samples into a data set. Run it again to resume or to add more.

    Args:
        preset: Name of a preset (demo, simple, complex) or a TOML file.
        out: Folder of the data set.
        count: Number of samples the split shall have.
        workers: Worker processes; default: one a core. The result does not depend on it.
        split: Which split; train and test share no parameter value.
        set: Override, such as object.mass_kg=0.05; may be given several times.
        runner: Who does the work.
    """
    from evslip.config import load_config
    from evslip.generation import STAGES
    from evslip.generation import generate as run

    config = load_config(preset, overrides(set))
    with progress_bar(f"generate {split}", count) as advance:
        summary = run(
            config, out, count, split=split, workers=workers, runner_name=runner, progress=lambda made: advance()
        )
    entries = [made.entry for made in summary.made]
    rejected = sum(entry["kind"] == "rejected" for entry in entries)
    made = f"{len(entries)} samples made ({rejected} rejected)"
    console.print(f"{made}, {summary.skipped} there already, in {summary.seconds:.1f} s")
    if entries:
        seconds = {stage: sum(made.seconds[stage] for made in summary.made) / len(entries) for stage in STAGES}
        each = ", ".join(f"{stage} {value:.2f} s" for stage, value in seconds.items())
        events = sum(entry["events"] for entry in entries) / len(entries)
        size = sum(entry["bytes"] for entry in entries) / len(entries)
        console.print(f"a sample on average, processor time: {each}; {events:,.0f} events, {size / 1e6:.2f} MB")


def status(dataset: Positional[Path]) -> None:
    """Say what a data set holds and what is missing.

    Args:
        dataset: Folder of the data set.
    """
    from evslip.dataset import open_dataset

    for name, value in open_dataset(dataset).status().items():
        console.print(f"{name:>12}  {value}")


def verify(dataset: Positional[Path]) -> None:
    """Check every byte of a data set; exit code 2 if anything is damaged, missing or surplus.

    Args:
        dataset: Folder of the data set.
    """
    from evslip.dataset import open_dataset

    problems = open_dataset(dataset).verify()
    for problem in problems:
        console.print(problem)
    if problems:
        raise EvslipError(f"{dataset}: {len(problems)} problems found; delete the files named and generate again")
    console.print(f"{dataset}: every record is whole")


def windows(
    dataset: Positional[Path],
    out: Positional[Path],
    *,
    split: Split | None = None,
    length_s: float = 0.16,
    hop_s: float = 0.16,
    slip_deg: float = 1.0,
    hold_deg: float = 0.1,
    balance: bool = True,
    seed: int = 0,
) -> None:
    """Cut a data set into labelled windows.

    Args:
        dataset: Folder of the data set.
        out: HDF5 file to write.
        split: Only this split; default: all there is.
        length_s: Length of a window.
        hop_s: From one window's start to the next one's.
        slip_deg: A window is slip from this rotation in the hand on.
        hold_deg: A window is hold below this rotation; between the two it is dropped.
        balance: Remove windows of the commoner label at random until both are equally many.
        seed: Seed of that removal.
    """
    from evslip.dataset import open_dataset
    from evslip.window_set import WindowSettings

    settings = WindowSettings(
        length_s=length_s, hop_s=hop_s, slip_deg=slip_deg, hold_deg=hold_deg, balance=balance, seed=seed
    )
    samples = open_dataset(dataset)
    cut = (samples.split(split) if split else samples).windows(settings)
    cut.save(out)
    console.print(f"{out}: {cut.summary()}")


def train(
    windows: Positional[Path],
    out: Positional[Path],
    *,
    model: str = "cnn3d_bn",
    epochs: int | None = None,
    batch: int | None = None,
    lr: float | None = None,
    seed: int = 0,
) -> None:
    """Train a detector on windows; validation is on trajectories kept apart.

    Args:
        windows: HDF5 file made by `evslip windows`.
        out: Folder for the model.
        model: Name of a network.
        epochs: Most passes over the windows; training stops earlier when validation stops improving.
        batch: Windows a step.
        lr: Learning rate.
        seed: Seed of initial weights, order and augmentation.
    """
    from evslip.learn import TrainSettings
    from evslip.learn import train as run
    from evslip.window_set import load_windows

    chosen = {"epochs": epochs, "batch": batch, "lr": lr}
    settings = TrainSettings(model=model, seed=seed, **{k: v for k, v in chosen.items() if v is not None})
    result = run(load_windows(windows), out, settings)
    console.print(f"{out}: {result.summary()}")


def evaluate(model: Positional[Path], windows: Positional[Path], *, out: Path | None = None) -> None:
    """Measure a detector on windows it has not been trained on.

    Args:
        model: Folder of the model.
        windows: HDF5 file made by `evslip windows`.
        out: JSON file for the figures; default: evaluation.json in the model's folder.
    """
    from evslip.learn import evaluate as run
    from evslip.window_set import load_windows

    metrics = run(model, load_windows(windows))
    metrics.save(out or model / "evaluation.json")
    console.print(metrics.table())


def report(
    dataset: Positional[Path], *, model: Path | None = None, windows: Path | None = None, out: Path | None = None
) -> None:
    """Write one HTML page that shows a data set and, if given, a detector. It needs no network.

    Args:
        dataset: Folder of the data set.
        model: Folder of a model trained on it.
        windows: HDF5 file of its windows.
        out: Page to write; default: report.html in the data set's folder.
    """
    from evslip.dataset import open_dataset
    from evslip.view.report import write_report

    page = write_report(out or dataset / "report.html", open_dataset(dataset), windows=windows, model_dir=model)
    console.print(f"report: {page}")


def events(
    frames: Positional[Path],
    out: Positional[Path],
    *,
    fps: float | None = None,
    camera: str = "davis346",
    seed: int = 0,
    noise_map: Path | None = None,
) -> None:
    """Turn frames that a camera or another renderer made into events.

    Args:
        frames: Folder of images, or a video file.
        out: File to write; its suffix says the format.
        fps: Frames a second; a video knows its own.
        camera: Preset of the event camera.
        seed: Seed of its noise.
        noise_map: File made by `evslip calibrate-noise`: each pixel is as noisy as that of the real sensor.
    """
    from evslip.codecs import check_suffix, write_events
    from evslip.events import EventCamera, load_noise_map
    from evslip.events.sources import frame_size, frames_from

    check_suffix(out, writing=True)
    source = frames_from(frames, fps)
    size = frame_size(frames)
    noise = None if noise_map is None else load_noise_map(noise_map)
    stream = EventCamera(camera, size=size, seed=seed, intensity="uint8", noise_map=noise).run(source)
    write_events(out, stream, size)
    console.print(f"{out}: {describe(stream, size)}")


def calibrate_noise(recording: Positional[Path], out: Positional[Path]) -> None:
    """Measure the noise of each pixel of a real sensor, from a recording of a still scene in constant light.

    Args:
        recording: File of events; several minutes long, since rare events need time.
        out: File to write, .npz: for `evslip events --noise-map`, or the camera's parameter noise_map.
    """
    from evslip.codecs import read_recording
    from evslip.events.calibrate import check_noise_suffix, measure_noise, save_noise_map

    check_noise_suffix(out)
    record = read_recording(recording)
    rates = measure_noise(record.events, record.size)
    save_noise_map(out, rates)
    on, off = rates.mean((1, 2))
    busiest = float(rates.sum(0).max())
    console.print(f"{recording}: {describe(record.events, record.size)}")
    console.print(f"{out}: {on:.3g} ON and {off:.3g} OFF events/s a pixel; the busiest pixel has {busiest:.3g}/s")
    silent = float((rates.sum(0) == 0).mean())
    if silent > 0.5:
        console.print(f"{silent:.0%} of the pixels never fired: record for longer to measure them")


def import_(recording: Positional[Path], out: Positional[Path]) -> None:
    """Bring a real recording into evslip's own format.

    Args:
        recording: File of an event camera, such as AEDAT4.
        out: HDF5 file to write.
    """
    from evslip.codecs import import_recording

    record = import_recording(recording, out)
    console.print(f"{out}: {describe(record.events, record.size)}")


def detect(
    model: Positional[Path],
    recording: Positional[Path],
    *,
    out: Path | None = None,
    hop_s: float = 0.02,
) -> None:
    """Run a detector over a recording: slip probability over time as CSV and PNG.

    Args:
        model: Folder of the model.
        recording: HDF5 file of a record, a recording or plain events.
        out: Name of the two files without suffix; default: beside the recording.
        hop_s: Time between two answers.
    """
    from evslip.codecs import read_recording
    from evslip.learn import detect as run
    from evslip.view.detection import write_csv, write_png

    record = read_recording(recording)
    detection = run(model, record.events, record.size, hop_s=hop_s)
    stem = out or recording.with_name(recording.stem + "-slip")
    csv, png = stem.with_suffix(".csv"), stem.with_suffix(".png")
    write_csv(detection, csv)
    write_png(detection, png, title=recording.name)
    console.print(f"{csv} and {png}: {detection.summary()}")


def doctor(*, count: int = 192) -> None:
    """Say what is installed, what is missing, and how much disk a data set needs.

    Args:
        count: Number of samples to plan for.
    """
    from evslip.doctor import examine

    for line in examine(count):
        console.print(line)


VERBS: dict[str, Callable[..., None]] = {
    "demo": demo,
    "show": show,
    "generate": generate,
    "status": status,
    "verify": verify,
    "windows": windows,
    "train": train,
    "evaluate": evaluate,
    "report": report,
    "events": events,
    "calibrate-noise": calibrate_noise,
    "import": import_,
    "detect": detect,
    "doctor": doctor,
}


def overrides(texts: tuple[str, ...]) -> dict[str, Any]:
    """KEY=VALUE arguments as a dictionary."""
    from evslip.config import parse_override

    return dict(map(parse_override, texts))


def describe(stream: Any, size: tuple[int, int]) -> str:
    """One line about a stream of events."""
    if not stream.count:
        return f"no events, {size[0]}x{size[1]}"
    seconds = (int(stream.t_us[-1]) - int(stream.t_us[0])) / 1e6
    rate = f", {stream.count / seconds / 1e3:,.1f} k events/s" if seconds else ""
    return f"{stream.count:,} events in {seconds:.3f} s{rate}, {stream.p.mean():.0%} ON, {size[0]}x{size[1]}"


def main() -> None:
    """Entry point. Errors of use: one line on stderr, exit code 2. Ctrl-C: exit code 130."""
    if sys.argv[1:] in (["--version"], ["-V"]):
        print(f"evslip {__version__}")
        return
    try:
        tyro.extras.subcommand_cli_from_dict(VERBS, prog="evslip", description=DESCRIPTION)
    except EvslipError as error:
        sys.exit(_fail(str(error), 2))
    except KeyboardInterrupt:
        sys.exit(_fail("stopped; what was finished is kept", 130))
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _fail(message: str, code: int) -> int:
    print(f"evslip: {' '.join(message.split())}", file=sys.stderr)
    return code
