"""Verbs about recordings of event cameras, and the labels that a person gives to them."""

from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any, Literal

from tyro.conf import Positional, arg

from evslip.cli.options import SILENT, Browser, Port, given, options_of
from evslip.exchange.importing.settings import Importing
from evslip.exchange.selection import ENDLESS_S, Flip, Rotation
from evslip.utils.console import console
from evslip.utils.errors import ConfigError, DataError
from evslip.utils.files import require_not_read

ImportOptions = options_of(
    Importing,
    {
        "crop": Annotated[tuple[int, int, int, int] | None, arg(metavar="X Y WIDTH HEIGHT"), SILENT],
        "size": Annotated[tuple[int, int] | None, arg(metavar="WIDTH HEIGHT"), SILENT],
        "centre_m": Annotated[tuple[float, float, float] | None, arg(metavar="X Y Z"), SILENT],
    },
)


def import_(
    recording: Positional[Path],
    out: Positional[Path],
    *,
    settings: Annotated[Importing, arg(constructor=ImportOptions)],
    length_s: float = 0.15,
) -> None:
    """Bring a real recording, or a sample of another simulator, into evslip's own format.

    Args:
        recording: File of an event camera that `evslip convert` reads; or a simulator's folder with isaac_stats.csv or
            poses.csv, frames/ and perhaps events; or a folder with VT-SNN's prophesee_recordings.
        out: HDF5 file to write; of VT-SNN's layout a folder for one file each.
        length_s: How long a file of VT-SNN's layout lasts, s.
    """
    from evslip.codecs.triggers import left_out
    from evslip.exchange.importing.recordings import import_recording
    from evslip.exchange.vt_snn import import_vt_snn, is_vt_snn

    settings = Importing(**given(settings))
    require_not_read(out, recording, settings.labels)
    if is_vt_snn(recording):
        made = import_vt_snn(recording, out, length_s, settings.size)
        console.print(f"{out}: {len(made)} records")
        return
    record = import_recording(recording, out, settings)
    console.print(f"{out}: {describe(record.events, record.size)}")
    parts = [f"{len(record.intervals)} labelled intervals"] if record.intervals else []
    parts += [f"{len(record.footage.t_us)} frames"] if record.footage is not None else []
    parts += [f"poses and ground truth of {record.truth.t_us[-1] / 1e6:.3f} s"] if record.truth is not None else []
    if parts:
        console.print(f"{'; '.join(parts)}; label of the whole: {record.label}")
    if recording.is_file() and (lost := left_out(recording, settings.camera)):
        console.print(f"note: {out.name} does not hold {lost}")


def convert(
    source: Positional[Path],
    out: Positional[Path],
    *,
    crop: Annotated[tuple[int, int, int, int] | None, arg(metavar="X Y WIDTH HEIGHT")] = None,
    start_s: float = 0.0,
    end_s: float | None = None,
    slice: Annotated[tuple[float, float] | None, arg(metavar="START END")] = None,
    polarity: Annotated[Literal["on", "off"] | None, arg(metavar="on|off")] = None,
    without: Path | None = None,
    from_zero: bool = False,
    rotate: Rotation = 0,
    flip: Flip | None = None,
    frames_hz: float = 30.0,
    camera: str | None = None,
) -> None:
    """Write the events of a file in another format, or a part of them.

    Args:
        source: File of events: HDF5, AEDAT4, AEDAT2, Prophesee RAW or DAT, Event Stream (.es), ROS bags, .npz, .csv,
            v2e's .txt, VT-SNN's .mat.
        out: File to write; its suffix says the format. RAW is EVT 3.0, or EVT 2.0 if the name ends in .evt2.raw. Bags
            have EventPacket in mono, or in evt3 if the name ends in .evt3.bag, or EventArray if in .dvs.bag (.db3,
            .mcap alike); of a whole record they have poses, frames and truth, too.
        crop: Pixels to keep; the corner X Y becomes 0 0.
        start_s: Begin so many seconds after the first event.
        end_s: End so many seconds after the first event; default: with the last one.
        slice: Both at once.
        polarity: Keep the ON or the OFF events alone.
        without: CSV file of pixels to leave out, lines x,y, as `evslip info --hot` writes it; before the crop.
        from_zero: Shift the times so that the first event is at 0; for formats that hold only short times.
        rotate: Turn the picture clockwise, after the crop.
        flip: Mirror the picture after that: left and right (x), or top and bottom (y).
        frames_hz: Frames a second in a bag of a whole simulated record; 0: none.
        camera: Of a file of two cameras, the one whose events are written, such as left; a whole record
            in a bag has both without it.
    """
    from evslip.exchange.format_to_format import convert_format
    from evslip.exchange.pixel_list import read_pixels
    from evslip.exchange.selection import Selection

    whole = (start_s, end_s) == (0.0, None)
    if slice is not None and not whole:
        raise ConfigError("slice: expected either --slice, or --start-s and --end-s")
    if not whole:
        slice = (start_s, ENDLESS_S if end_s is None else end_s)
        if not 0 <= start_s < ENDLESS_S:
            raise ConfigError(f"start-s: {start_s:g}; expected 0 or more seconds after the first event")
        if not start_s < slice[1] <= ENDLESS_S:
            raise ConfigError(f"end-s: {slice[1]:g}; expected more than the start's {start_s:g} s")
    require_not_read(out, without)
    pixels = () if without is None else read_pixels(without)
    selection = Selection(crop, slice, polarity, from_zero, rotate, flip, pixels)
    done = convert_format(source, out, selection, frames_hz, camera)
    console.print(f"{out}: {summarise(done.events, done.on, done.start_us, done.end_us, done.size)}")
    if slice is not None and not done.events:
        span = f"from {slice[0]:g} s on" if slice[1] == ENDLESS_S else f"from {slice[0]:g} to {slice[1]:g} s"
        console.print(f"note: none of the events that are kept is {span} after the first of {source.name}")
    if done.lost:
        console.print(f"note: {out.name} does not hold {' and '.join(done.lost)}")


def info(
    file: Positional[Path],
    *,
    gap_ms: float = 10.0,
    hot: Path | None = None,
    camera: str | None = None,
    json: bool = False,
) -> None:
    """Say what a file of events or a record holds, how good the recording is, and what of it hurts a detector.

    Args:
        file: File of any format that `evslip convert` reads.
        gap_ms: From this length on a pause of all pixels is counted as a gap, ms.
        hot: CSV file to write, of the columns and rows of hot pixels, for `evslip convert --without`.
        camera: Of a file of two cameras, the one whose events are examined, such as left.
        json: For a machine.
    """
    from json import dumps

    from evslip.codecs.facts import examine
    from evslip.codecs.triggers import trigger_facts
    from evslip.data.record import about
    from evslip.data.record_file import is_record, read
    from evslip.events.quality.findings import described, harms
    from evslip.exchange.pixel_list import write_pixels

    if not 0 <= gap_ms < 1e12:
        raise ConfigError(f"gap-ms: {gap_ms:g} is out of range, expected 0 or more")
    require_not_read(hot, file)
    gap_us = round(gap_ms * 1e3)
    known = about(read(file, events=False, camera=camera)) if is_record(file) else {}
    facts, quality = examine(file, gap_us, camera)
    if hot is not None:
        if quality.pixels is None:
            raise DataError(f"{file}: its sensor is too large to judge its pixels; crop it with `evslip convert`")
        write_pixels(hot, quality.pixels.hot)
    hurts, triggers = harms(quality), trigger_facts(file, camera)
    if json:
        beside = {"record": known, "triggers": None if triggers is None else asdict(triggers)}
        print(dumps(facts.as_json() | beside | {"quality": quality.as_json() | {"harms": hurts}}, indent=2))
        return
    entries = known if triggers is None else known | {"triggers": str(triggers)}
    rows = (f"{name:>10}  {text}" for name, text in (entries | described(quality)).items())
    for line in (*facts.lines(gap_us), *rows):
        console.print(line)
    for number, line in enumerate(hurts):
        console.print(f"{'' if number else 'hurts':>10}  {line}")
    if quality.count and not hurts:
        console.print(f"{'hurts':>10}  nothing found that hurts a detector")


def label(recording: Positional[Path], *, out: Path | None = None, port: Port = 8899, browser: Browser = True) -> None:
    """Mark slip and hold on a recording's time line in the browser. Every change is saved at once. Ctrl-C ends it.

    Args:
        recording: File of events of any known format.
        out: CSV file of the intervals (start_s, end_s, label), which is continued if it is there; default: beside the
            recording, with -labels.csv at its end.
    """
    from evslip.codecs.formats import stem_of
    from evslip.view.explorer.labels import Labels
    from evslip.view.explorer.serve import explore
    from evslip.view.explorer.shelf import open_recording

    shelf = open_recording(recording)
    labels = Labels(out or recording.with_name(f"{stem_of(recording)}-labels.csv"))
    explore(shelf, labels=labels, port=port, browser=browser)


def label_agreement(a: Positional[Path], b: Positional[Path]) -> None:
    """Compare two people's labels of one recording: Cohen's kappa over time, and intersection over union.

    Args:
        a: CSV file of one (start_s, end_s, label).
        b: CSV file of the other.
    """
    from evslip.data.intervals import read_intervals
    from evslip.view.explorer.agreement import agreement

    found = [read_intervals(path) for path in (a, b)]
    for path, intervals in zip((a, b), found, strict=True):
        if not intervals:
            raise DataError(f"{path}: holds no interval; expected one or more to compare")
    print(agreement(*found).table())


def describe(stream: Any, size: tuple[int, int]) -> str:
    """One line about a stream of events."""
    start, end = (int(stream.t_us[0]), int(stream.t_us[-1])) if stream.count else (0, 0)
    return summarise(stream.count, int(stream.p.sum()), start, end, size)


def summarise(count: int, on: int, start_us: int, end_us: int, size: tuple[int, int]) -> str:
    """One line about a stream of `count` events, `on` of them ON, between two times."""
    if not count:
        return f"no events, {size[0]}x{size[1]}"
    seconds = (end_us - start_us) / 1e6
    rate = f", {count / seconds / 1e3:,.1f} k events/s" if seconds else ""
    return f"{count:,} events in {seconds:.3f} s{rate}, {on / count:.0%} ON, {size[0]}x{size[1]}"
