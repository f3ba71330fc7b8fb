"""Verbs about event cameras and their recordings."""

from functools import partial
from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import OmitArgPrefixes, Positional, arg

from evslip.cli.options import describe, summarise
from evslip.cli.pixels import PixelOptions, parameters_of
from evslip.utils.console import console, progress_bar
from evslip.utils.errors import ConfigError

RESTLESS = 3.0
"""A scene of more `unrest` is not still."""


def events(
    clip: Positional[Path],
    out: Positional[Path],
    *,
    fps: Annotated[float | None, arg(metavar="NUMBER")] = None,
    times: Annotated[Path | None, arg(metavar="FILE")] = None,
    times_unit: Annotated[str | None, arg(metavar="us|s")] = None,
    camera: str = "davis346",
    mode: Annotated[str, arg(metavar="accurate|v2e")] = "accurate",
    intensity: Annotated[str | None, arg(metavar="uint8|srgb|linear")] = None,
    interpolate: Annotated[str, arg(metavar="linear|none|rife")] = "linear",
    upsample: int = 8,
    seed: int = 0,
    threads: int = 1,
    device: Annotated[str, arg(metavar="cpu|cuda")] = "cpu",
    preview: Annotated[Path | None, arg(metavar="FILE")] = None,
    preview_ms: float = 33.3,
    plot: Annotated[Path | None, arg(metavar="FILE")] = None,
    pixels: OmitArgPrefixes[PixelOptions] = PixelOptions(),  # noqa: B008
) -> None:
    """Turn frames that a camera or another renderer made into events.

    Args:
        clip: Folder of images, video file, or .npz file with the arrays frames and t_us or t_s.
        out: File to write; its suffix says the format. HDF5 (.h5) needs little memory, however long the clip is, and
            keeps the settings: `evslip show OUT`.
        fps: Frames a second. A folder needs this or times; a video or .npz file knows its own.
        times: Text file with the time of each frame, one a line, first column; a header t_us or t_s says the unit.
        times_unit: Unit of the times where no header says it; default: us.
        camera: Preset of the event camera, see `evslip show camera`.
        mode: Rules of the pixels: accurate, or those of v2e to the letter.
        intensity: What the numbers of the frames mean. uint8: codes of 0 to 255, mapped to log intensity as v2e does;
            srgb: such codes, decoded to light first; linear: light, white = 1 (255 for bytes). Default: linear for
            floats, uint8 for all others.
        interpolate: What is between two frames. linear: log intensity changes evenly (in mode v2e: its events come
            evenly). none: a frame stands still until the next one comes. rife: a neural network invents frames that
            follow the motion, for slow videos of fast motion; needs the extra rife.
        upsample: Intervals that rife makes of one: 2, 4, 8, 16 or 32.
        seed: Seed of the noise and the mismatch.
        threads: Threads that share the rows; the result does not depend on it.
        device: Where the pixels are computed; cuda needs an NVIDIA GPU and the extra cuda.
        preview: Video to write (.mp4, .mkv, .mov, .avi): red ON, blue OFF, 30 pictures a second.
        preview_ms: Time that one picture of it shows, ms; 33.3 plays at true speed, 3.33 ten times slower.
        plot: PNG to write: events a second over time.
    """
    from evslip.codecs import format_of
    from evslip.codecs.settings import keeps_settings
    from evslip.exchange.conversion import Conversion, convert, open_conversion, require_other
    from evslip.view.pictures.preview import check_preview
    from evslip.view.pictures.preview import preview as preview_video
    from evslip.view.pictures.rates import check_plot, rates_plot

    format_of(out, writing=True)
    watchers = []
    conversion = Conversion(
        clip=clip,
        fps=fps,
        times=times,
        times_unit=times_unit,
        camera=camera,
        mode=mode,
        intensity=intensity,
        interpolate=interpolate,
        upsample=upsample,
        seed=seed,
        parameters=parameters_of(pixels),
    )
    source = open_conversion(conversion)
    if preview is not None:
        check_preview(preview, preview_ms)
        require_other(preview, source)
        watchers.append(partial(preview_video, preview, source.size, picture_ms=preview_ms))
    if plot is not None:
        check_plot(plot)
        require_other(plot, source)
        watchers.append(partial(rates_plot, plot, f"{clip.name}, {camera}"))
    with progress_bar("frames", source.count) as advance:
        made = convert(
            conversion,
            source,
            out,
            watchers=watchers,
            threads=threads,
            device=device,
            progress=advance,
        )
    console.print(f"{out}: {made.summary()}")
    for written in filter(None, (preview, plot)):
        console.print(str(written))
    if source.intensity == "linear" and made.brightest > 16:
        console.print(
            f"note: the frames reach {made.brightest:g}, taken as light with white = 1; "
            "numbers of 0 to 255 need --intensity uint8 or srgb"
        )
    if not keeps_settings(out):
        console.print(f"note: {out.suffix} files have no place for the settings")


def calibrate_noise(recording: Positional[Path], out: Positional[Path]) -> None:
    """Measure the noise of each pixel of a real sensor, from a recording of a still scene in constant light.

    Args:
        recording: File of events; several minutes long, since rare events need time.
        out: File to write, .npz: for `evslip events --noise-map`, or the camera's parameter noise_map.
    """
    from evslip.data.record_file import read_recording
    from evslip.events.noise_map import check_noise_suffix, measure_noise, save_noise_map, unrest

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
    moved = unrest(record.events, record.size)
    if moved > RESTLESS:
        console.print(
            f"note: the scene was not still: the pixels' counts differ {moved:.3g} times as much between the halves of "
            "the recording as noise does; the rates contain what moved"
        )


def convert(
    source: Positional[Path],
    out: Positional[Path],
    *,
    crop: Annotated[tuple[int, int, int, int] | None, arg(metavar="X Y WIDTH HEIGHT")] = None,
    slice: Annotated[tuple[float, float] | None, arg(metavar="START END")] = None,
    polarity: Annotated[Literal["on", "off"] | None, arg(metavar="on|off")] = None,
    from_zero: bool = False,
    rotate: Literal[0, 90, 180, 270] = 0,
    flip: Literal["x", "y"] | None = None,
) -> None:
    """Write the events of a file in another format, or a part of them.

    Args:
        source: File of events: HDF5, AEDAT4, AEDAT2, Prophesee RAW or DAT, Event Stream (.es), rosbag, .npz, .csv,
            v2e's .txt, VT-SNN's .mat.
        out: File to write; its suffix says the format. RAW is EVT 3.0, or EVT 2.0 if the name ends in .evt2.raw.
        crop: Pixels to keep; the corner X Y becomes 0 0.
        slice: Time to keep, seconds after the first event.
        polarity: Keep the ON or the OFF events alone.
        from_zero: Shift the times so that the first event is at 0; for formats that hold only short times.
        rotate: Turn the picture clockwise, after the crop.
        flip: Mirror the picture after that: left and right (x), or top and bottom (y).
    """
    from evslip.exchange.translation import Part, translate

    part = Part(crop, slice, polarity, from_zero, rotate, flip)
    with progress_bar("events", None) as advance:
        done = translate(source, out, part, advance)
    console.print(f"{out}: {summarise(done.events, done.on, done.start_us, done.end_us, done.size)}")
    if done.lost:
        console.print(f"note: {out.name} does not hold {' and '.join(done.lost)}")


def import_(
    recording: Positional[Path],
    out: Positional[Path],
    *,
    labels: Path | None = None,
    crop: Annotated[tuple[int, int, int, int] | None, arg(metavar="X Y WIDTH HEIGHT")] = None,
    rotate: Literal[0, 90, 180, 270] = 0,
    flip: Literal["x", "y"] | None = None,
    frames: bool = True,
    sensor: str = "",
    mount: str = "",
    size: Annotated[tuple[int, int] | None, arg(metavar="WIDTH HEIGHT")] = None,
    camera: str = "davis346",
    seed: int = 0,
    centre_m: Annotated[tuple[float, float, float], arg(metavar="X Y Z")] = (0.0, 0.0, 0.0),
    length_s: float = 0.15,
) -> None:
    """Bring a real recording, or a sample of another simulator, into evslip's own format.

    Args:
        recording: File of an event camera that `evslip convert` reads; or a simulator's folder with isaac_stats.csv or
            poses.csv, frames/ and perhaps events; or a folder with VT-SNN's prophesee_recordings.
        out: HDF5 file to write; of VT-SNN's layout a folder for one file each.
        labels: CSV file start_s,end_s,label: seconds after the first event, slip or hold.
        crop: Pixels to keep; the corner X Y becomes 0 0.
        rotate: Turn the picture clockwise, after the crop.
        flip: Mirror the picture after that: left and right (x), or top and bottom (y).
        frames: Keep the frames, if there are any.
        sensor: Note of the sensor.
        mount: Note of how it was mounted.
        size: Of the sensor, where the file does not state it: by default the extent of its events; of a simulator,
            whose frames are brought to this size, 346 260.
        camera: Event camera that looks at a simulator's frames where there are no events.
        seed: Seed of that camera.
        centre_m: The point between the fingers in the frame of a simulator's gripper, m.
        length_s: How long a file of VT-SNN's layout lasts, s.
    """
    from evslip.exchange.importing import Importing, import_recording, import_vt_snn, is_vt_snn

    if is_vt_snn(recording):
        made = import_vt_snn(recording, out, length_s, size)
        console.print(f"{out}: {len(made)} records")
        return
    how = Importing(
        labels=labels, crop=crop, rotate=rotate, flip=flip, frames=frames, sensor=sensor, mount=mount, size=size,
        camera=camera, seed=seed, centre_m=centre_m,
    )  # fmt: skip
    record = import_recording(recording, out, how)
    console.print(f"{out}: {describe(record.events, record.size)}")
    parts = [f"{len(record.intervals)} labelled intervals"] if record.intervals else []
    parts += [f"{len(record.footage.t_us)} frames"] if record.footage is not None else []
    parts += [f"poses and ground truth of {record.truth.t_us[-1] / 1e6:.3f} s"] if record.truth is not None else []
    if parts:
        console.print(f"{'; '.join(parts)}; label of the whole: {record.label}")


def info(file: Positional[Path], *, gap_ms: float = 10.0, json: bool = False) -> None:
    """Say what a file of events or a record holds: sensor, duration, rates, polarity, gaps, order errors.

    Args:
        file: File of any format that `evslip convert` reads.
        gap_ms: From this length on a pause of all pixels is counted as a gap, ms.
        json: For a machine.
    """
    from json import dumps

    from evslip.codecs.facts import facts_of
    from evslip.data.record import about
    from evslip.data.record_file import is_record, read

    if not 0 <= gap_ms < 1e12:
        raise ConfigError(f"gap-ms: {gap_ms:g} is out of range, expected 0 or more")
    gap_us = round(gap_ms * 1e3)
    known = about(read(file, events=False)) if is_record(file) else {}
    if json:
        print(dumps(facts_of(file, gap_us).as_json() | {"record": known}, indent=2))
        return
    with progress_bar("events", None) as advance:
        facts = facts_of(file, gap_us, advance)
    for line in [*facts.lines(gap_us), *(f"{name:>9}  {text}" for name, text in known.items())]:
        console.print(line)
