"""The verb that draws stored records again."""

from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import Positional, UseAppendAction, arg

from evslip.utils.console import console, progress_bar
from evslip.utils.errors import ConfigError

Times = Annotated[UseAppendAction[tuple[float, ...]], arg(metavar="SECONDS")]
LEAST, MOST = 16, 4096


def render(
    record: Positional[Path],
    *,
    out: Path,
    renderer: Literal["raycast", "pathtrace"] | None = None,
    camera: Literal["wrist", "scene"] = "wrist",
    size: Annotated[str | None, arg(metavar="WxH")] = None,
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
        record: The record, such as data/train/0000007.h5.
        out: Video (.mp4, .mkv, .mov, .avi; 30 pictures a second) or folder for PNG files.
        renderer: Raycast or pathtrace; default: the one that the record was made with.
        camera: Wrist, as the record has it, or scene: the whole robot, for which pathtrace is needed.
        size: Width and height in pixels, such as 1730x1300; default: the record's.
        color: In colour instead of grey.
        spp: Light paths a pixel of pathtrace; more of them, less noise. Default: the record's.
        key_motion: Pathtrace, wrist: pixels that anything may move between two pictures that are traced; those between
            follow by re-projection. 0 traces all.
        every: Milliseconds between pictures; default: 33.3, which plays at true speed.
        times: Draw these instants only, in seconds; may be given several times.
        phase: Draw this phase only, such as tilt; default: all that is recorded.
        outputs: Any of depth,normal,motion, separated by commas: as .npz beside the pictures.
    """
    from evslip.data import record_file
    from evslip.view.pictures.replay import check_target, instants, redrawn, replay

    names = tuple(name for name in outputs.split(",") if name)
    check_target(out, names, camera)
    shape = _size(size)
    stored = record_file.read(record, events=False)
    stored = redrawn(stored, renderer=renderer, spp=spp, key_motion_px=key_motion)
    times_us = instants(stored, every_ms=every, times_s=times, phase=phase)
    if stored.params is not None and stored.params.render.renderer == "pathtrace":
        from evslip.rendering.pathtrace.variant import describe

        console.print(describe())
    with progress_bar("render", len(times_us)) as advance:
        replay(stored, out, times_us, size=shape, view=camera, color=color, outputs=names, progress=advance)
    console.print(f"{out}: {len(times_us)} pictures")


def _size(text: str | None) -> tuple[int, int] | None:
    if text is None:
        return None
    parts = text.lower().split("x")
    if len(parts) != 2 or not all(part.isdecimal() and LEAST <= int(part) <= MOST for part in parts):
        raise ConfigError(f"size: {text!r}: expected WIDTHxHEIGHT, such as 692x520, each from {LEAST} to {MOST}")
    return int(parts[0]), int(parts[1])
