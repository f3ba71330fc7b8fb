"""Verbs that fit the event camera to a real one, and say how well."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, arg

from evslip.cli.options import given, options_of, require_paths
from evslip.cli.recordings import describe
from evslip.learn.realism.settings import RealismSettings
from evslip.utils.console import console, print_table
from evslip.utils.errors import ConfigError
from evslip.utils.files import require_not_read

if TYPE_CHECKING:
    from evslip.exchange.calibrating import Span


def calibrate(
    recordings_and_out: Annotated[Positional[tuple[Path, ...]], arg(metavar="RECORDING... OUT")],
    *,
    start_s: float = 0.0,
    end_s: float | None = None,
    upsample: int = 10,
    seed: int = 0,
    each_pixel: bool = False,
) -> None:
    """Fit the event camera's parameters to recordings of a real one.

    Args:
        recordings_and_out: Files of events, with frames beside them if possible (AEDAT4, bags, imported records); then
            the preset to write, OUT.toml, which every command takes: --camera OUT.toml, sensor.preset = "OUT.toml". Or
            OUT.npz: the noise of each pixel in one recording of a still scene, for --noise-map; several minutes long,
            since rare events need time.
        start_s: Begin so many seconds after the first event.
        end_s: End so many seconds after the first event; default: with the last one.
        upsample: Steps between two frames along image motion, which the pixels are simulated on.
        seed: Seed of the simulated pixels.
        each_pixel: Thresholds of each pixel too, as maps in an .npz file beside OUT.toml; for a sensor of the same size
            alone, and long recordings: 100 events a pixel and more.
    """
    enough = len(recordings_and_out) >= 2
    require_paths("calibrate", recordings_and_out, enough, "one or more recordings, then the file to write")
    *recordings, out = recordings_and_out
    require_not_read(out, *recordings)
    from evslip.exchange.calibrating import Span, calibrate_recordings

    if not 0 <= seed < 2**64:
        raise ConfigError(f"seed: {seed} is out of range, expected 0 to {2**64 - 1}")
    end = math.inf if end_s is None else end_s
    if not 0.0 <= start_s < end:
        raise ConfigError(f"start-s: {start_s:g} is out of range, expected 0 or more and less than --end-s")
    if out.suffix.lower() == ".npz":
        if each_pixel:
            raise ConfigError(f"each-pixel: thresholds lie beside a preset; expected OUT.toml, not {out}")
        _noise(recordings, out, Span(start_s, end))
        return
    found = calibrate_recordings(recordings, out, Span(start_s, end), upsample, seed, each_pixel)
    facts = [[one.name, f"{one.value:.4g}", f"{one.low:.3g} to {one.high:.3g}", one.note] for one in found.facts]
    print_table([["parameter", "value", "95 % interval", ""], *facts])
    if not math.isnan(found.misfit):
        console.print(f"misfit: {found.misfit:.2f}; about 1 where the model explains the recording")
    for line in found.unknown:
        console.print(f"not known: {line}")
    console.print(f"{out}: a preset; look at it with: evslip show camera {out}")


def realism(
    recording_and_simulation: Annotated[Positional[tuple[Path, ...]], arg(metavar="REAL [SIMULATED]")],
    *,
    camera: Annotated[str | None, arg(aliases=("--preset",))] = None,
    settings: Annotated[RealismSettings, arg(constructor=options_of(RealismSettings))],
    json: Path | None = None,
    out: Path = Path("realism.html"),
) -> None:
    """Score simulated events against real ones of the same scene: a table, and a page with pictures side by side.

    Args:
        recording_and_simulation: Recording of a real camera, a file of events of any known format; then a file of
            simulated events of the same scene, unless --camera makes them from the recording's frames.
        camera: Preset of the event camera that sees the recording's frames, see `evslip show camera`; it gives the
            floor too.
        json: File to write, with all figures.
        out: Page to write.
    """
    from json import dumps

    from evslip.learn.realism.pairs import pair_of_files, pair_of_preset
    from evslip.learn.realism.realism import compare
    from evslip.utils import atomic
    from evslip.view.realism.page import write_realism
    from evslip.view.realism.tables import figure_table, level_table, side_table

    files = recording_and_simulation
    if len(files) != (2 if camera is None else 1):
        words = " ".join(map(str, files)) or "nothing"
        raise ConfigError(
            f"realism: {words} given{'' if camera is None else f' with --camera {camera}'}; expected a recording and a "
            "file of simulated events, or a recording and --camera"
        )
    for written in (out, json):
        require_not_read(written, *files)
    wanted = RealismSettings(**given(settings))
    if camera is None:
        title, pair = f"{files[1].name} against {files[0].name}", pair_of_files(files[0], files[1], wanted)
    else:
        between = wanted.interpolate + (f" x {wanted.upsample}" if wanted.interpolate == "flow" else "")
        title = f"Camera {camera} on the frames of {files[0].name} ({between}, seed {wanted.seed})"
        pair = pair_of_preset(files[0], camera, wanted)
    found = compare(pair, seed=wanted.seed, classifier=wanted.classifier)
    console.print(f"{title}, {found.start_us / 1e6:.3f} to {found.end_us / 1e6:.3f} s after the first event")
    for table in (figure_table(found), side_table(found), level_table(found)):
        if table:
            print_table(table)
    for note in found.notes:
        console.print(f"note: {note}")
    write_realism(out, title, pair, found)
    if json is not None:
        atomic.write_text(json, dumps(found.as_json(), indent=1) + "\n")
    console.print(" and ".join(map(str, filter(None, (out, json)))))


def _noise(recordings: list[Path], out: Path, span: "Span") -> None:
    """Write the noise of each pixel of a recording of a still scene."""
    from evslip.codecs.clips.pixels import check_sensor
    from evslip.data.record_file import read_recording
    from evslip.events.calibration.calibration import RESTLESS
    from evslip.events.noise_map import measure_noise, save_noise_map, unrest
    from evslip.exchange.calibrating import part_of

    if len(recordings) > 1:
        raise ConfigError(f"calibrate: {len(recordings)} recordings given; the noise of each pixel is measured in one")
    (recording,) = recordings
    record = read_recording(recording)
    check_sensor(record.size, recording)
    events = part_of(record.events, span, recording)
    rates = measure_noise(events, record.size)
    save_noise_map(out, rates)
    on, off = rates.mean((1, 2))
    busiest = float(rates.sum(0).max())
    console.print(f"{recording}: {describe(events, record.size)}")
    console.print(f"{out}: {on:.3g} ON and {off:.3g} OFF events/s a pixel; the busiest pixel has {busiest:.3g}/s")
    silent = float((rates.sum(0) == 0).mean())
    if silent > 0.5:
        console.print(f"{silent:.0%} of the pixels never fired: record for longer to measure them")
    moved = unrest(events, record.size)
    if moved > RESTLESS:
        console.print(
            f"note: the scene was not still: the pixels' counts differ {moved:.3g} times as much between the halves of "
            "the recording as noise does; the rates contain what moved"
        )
