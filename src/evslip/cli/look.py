"""Verbs that show: pages in the browser, videos, pictures, a report."""

from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import Positional, UseAppendAction, arg

from evslip.cli.options import DETECTOR, Browser, Port, given, options_of
from evslip.utils.console import console
from evslip.utils.errors import ConfigError, DataError
from evslip.utils.files import require_not_read
from evslip.utils.progress import Step
from evslip.view.pictures.film_settings import FilmSettings

Times = Annotated[UseAppendAction[tuple[float, ...]], arg(metavar="SECONDS")]
LEAST, MOST = 16, 4096


def view(
    dataset: Positional[Path],
    *,
    model: Annotated[Path | None, arg(help=f"{DETECTOR}, whose slip probability is drawn over time.")] = None,
    camera: str = "all",
    port: Port = 8899,
    browser: Browser = True,
) -> None:
    """Look at a data set or a recording in the browser: frames, events, curves, labels. Ctrl-C ends it.

    Args:
        dataset: Folder of a data set, or a file of events of any known format.
        camera: Of samples that two cameras saw: left, right, or all.
    """
    from evslip.view.explorer.serve import explore
    from evslip.view.explorer.shelf import open_shelf

    explore(open_shelf(dataset, camera), model=model, port=port, browser=browser)


def play(
    *,
    config: str = "play",
    controller: str = "detector",
    model: Annotated[str, arg(help=f"{DETECTOR}.")] = "default-hold",
    port: Port = 8898,
    browser: Browser = True,
) -> None:
    """Pull at an object in the hand, live in the browser: events, slip probability and grip force. Ctrl-C ends it.

    Args:
        config: Preset or TOML file that the objects and motions are drawn from.
        controller: Controller of the grip force at the start: off, constant, strong, oracle, cone-oracle, late-oracle,
            event-rate, detector or detector-pi.
    """
    from evslip.view.play.serve import play as serve_play

    serve_play(config=config, controller=controller, model=model, port=port, browser=browser)


def video(
    records: Annotated[Positional[tuple[Path, ...]], arg(metavar="RECORD...")],
    *,
    out: Path,
    camera: str | None = None,
    settings: Annotated[FilmSettings, arg(constructor=options_of(FilmSettings))],
) -> None:
    """Write a slow-motion video of a sample or a recording, of several side by side: frames, events, angle.

    Args:
        records: Files of events of any known format; only samples of evslip have frames and angles.
        out: Video to write (.mp4, .mkv, .mov, .avi).
        camera: Of records of two cameras, the one whose view is shown: left, right, or all side by side.
    """
    from evslip.data.record_file import views
    from evslip.view.pictures.slip_video import Film
    from evslip.view.pictures.video import check_video

    check_video("out", out)
    if not records:
        raise ConfigError("records: expected one or more files")
    film = Film([record for path in records for record in views(path, camera)], FilmSettings(**given(settings)))
    with Step("video", len(film)) as advance:
        film.write(out, advance)
    console.print(f"{out}: {len(film)} pictures")


def rerun(source: Positional[Path], out: Positional[Path], *, count: int = 4) -> None:
    """Write a file for the Rerun viewer: robot, poses, camera, frames, events and curves on one time line.

    Args:
        source: Folder of a data set, or a file of events of any known format.
        out: File to write (.rrd); `rerun FILE` opens it.
        count: Samples of a data set, from the first on.
    """
    from evslip.view.explorer.shelf import open_shelf
    from evslip.view.rerun_log import check_rerun, write_rerun

    check_rerun(out)
    if count < 1:
        raise ConfigError(f"count: {count} is out of range, expected 1 or more")
    shelf = open_shelf(source)
    number = min(count, len(shelf))
    with Step("rerun", number) as advance:
        write_rerun(out, (shelf.read(position) for position in range(number)), advance)
    console.print(f"{out}: {number} samples")


def report(
    folder: Positional[Path],
    *,
    model: Path | None = None,
    windows: Path | None = None,
    compare: tuple[Path, ...] = (),
    pictures: int = 60,
    camera: str | None = None,
    out: Path | None = None,
) -> None:
    """Write one HTML page that shows a data set, a model or an evaluation. It needs no network.

    Args:
        folder: A data set, imported recordings, or one record; a model; or what `evslip evaluate` wrote.
        model: Of a data set: folder of a model trained on it, or of its evaluation.
        windows: Of a data set: HDF5 file of its windows.
        compare: Of a data set: real recordings, files of events of any known format, to compare its events with.
        pictures: Of a data set: most samples to draw in the gallery, which lists all.
        camera: Of a data set that two cameras saw: left or right.
        out: Page to write; default: report.html in the folder.
    """
    from evslip.data.record_file import read_recording
    from evslip.data.recordings import open_samples
    from evslip.view.report.report import is_model_or_evaluation, write_model_report, write_report

    if pictures < 0:
        raise ConfigError(f"pictures: {pictures} is out of range, expected 0 or more")
    where = out or (folder.parent if folder.is_file() else folder) / "report.html"
    require_not_read(where, folder, model, windows, *compare)
    if is_model_or_evaluation(folder):
        for name, value in {"model": model, "windows": windows, "compare": compare, "camera": camera}.items():
            if value:
                raise ConfigError(f"{name}: {folder} is no data set, to which alone {name} belongs")
        console.print(f"report: {write_model_report(where, folder)}")
        return
    if not folder.exists():
        raise DataError(f"{folder}: is not there; expected a data set, a model, or what `evslip evaluate` wrote")
    samples, real = open_samples(folder).seen_by(camera), [read_recording(path) for path in compare]
    page = write_report(where, samples, windows, model, compare=real, most_pictures=pictures)
    console.print(f"report: {page}")


def render(
    record: Positional[Path],
    *,
    out: Path,
    renderer: Literal["raycast", "pathtrace"] | None = None,
    camera: Literal["wrist", "scene", "left", "right"] = "wrist",
    size: Annotated[tuple[int, int] | None, arg(metavar="WIDTH HEIGHT")] = None,
    color: bool = False,
    spp: int | None = None,
    key_motion: float = 0.0,
    every: float | None = None,
    times: Times = (),
    phase: str | None = None,
    outputs: str = "",
) -> None:
    """Draw a stored record again, at any size, in colour, with either renderer: a video or a folder of pictures.

    Args:
        record: The record, such as data/samples/train/000/0000007.h5.
        out: Video (.mp4, .mkv, .mov, .avi; 30 pictures a second) or folder for PNG files.
        renderer: Raycast or pathtrace; default: the one that the record was made with.
        camera: Wrist, as the record has it, left or right of two cameras, or scene: the whole robot, for which
            pathtrace is needed.
        size: Width and height in pixels, such as 1730 1300 or 1730x1300; default: the record's.
        color: In colour instead of grey.
        spp: Light paths a pixel of pathtrace; more of them, less noise. Default: the record's.
        key_motion: Pathtrace, wrist: pixels that anything may move between two pictures that are traced; those between
            follow by re-projection. 0 traces all.
        every: Milliseconds between pictures; default: 33.3, which plays at true speed.
        times: Draw these instants only, in seconds; may be given several times.
        phase: Draw this phase only, such as tilt; default: all that is recorded.
        outputs: Any of depth,normal,motion, separated by commas: as .npz beside the pictures.
    """
    from evslip.codecs.arrays.record_head import wrong_camera
    from evslip.config.sections.camera import CAMERAS
    from evslip.data import record_file
    from evslip.view.pictures.replay import check_target, instants, redrawn, replay

    names = tuple(name for name in outputs.split(",") if name)
    chosen = camera if camera in CAMERAS else None
    view = "wrist" if chosen else camera
    check_target(out, names, view)
    if size is not None and not all(LEAST <= side <= MOST for side in size):
        raise ConfigError(f"size: {size[0]} x {size[1]}: expected width and height, each from {LEAST} to {MOST}")
    stored = record_file.read(record, events=False, camera=chosen)
    if stored.streams and view != "scene":
        raise ConfigError(f"{record}: {wrong_camera(tuple(stored.streams), chosen)}")
    stored = redrawn(stored, renderer=renderer, spp=spp, key_motion_px=key_motion)
    times_us = instants(stored, every_ms=every, times_s=times, phase=phase)
    if stored.params is not None and stored.params.render.renderer == "pathtrace":
        from evslip.rendering.pathtrace.variant import describe

        console.print(describe())
    with Step("render", len(times_us)) as advance:
        replay(stored, out, times_us, size=size, view=view, color=color, outputs=names, progress=advance)
    console.print(f"{out}: {len(times_us)} pictures")
