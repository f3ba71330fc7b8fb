"""The verb that scores simulated events against real ones."""

from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from evslip.learn.realism.settings import RealismSettings
from evslip.utils.console import console, print_table
from evslip.utils.errors import ConfigError


def realism(
    recording_and_simulation: Annotated[Positional[tuple[Path, ...]], arg(metavar="REAL [SIMULATED]")],
    *,
    preset: str | None = None,
    settings: RealismSettings = RealismSettings(),
    json: Path | None = None,
    out: Path = Path("realism.html"),
) -> None:
    """Score simulated events against real ones of the same scene: a table, and a page with pictures side by side.

    Args:
        recording_and_simulation: Recording of a real camera, a file of events of any known format; then a file of
            simulated events of the same scene, unless --preset makes them from the recording's frames.
        preset: Camera that sees the recording's frames, see `evslip show camera`; it gives the floor too.
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
    if len(files) != (2 if preset is None else 1):
        words = " ".join(map(str, files)) or "nothing"
        raise ConfigError(
            f"realism: {words} given{'' if preset is None else f' with --preset {preset}'}; expected a recording and a "
            "file of simulated events, or a recording and --preset"
        )
    if preset is None:
        title, pair = f"{files[1].name} against {files[0].name}", pair_of_files(files[0], files[1], settings)
    else:
        between = settings.interpolate + (f" x {settings.upsample}" if settings.interpolate == "flow" else "")
        title = f"Preset {preset} on the frames of {files[0].name} ({between}, seed {settings.seed})"
        pair = pair_of_preset(files[0], preset, settings)
    found = compare(pair, seed=settings.seed, classifier=settings.classifier)
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
