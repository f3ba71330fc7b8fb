"""The verb that turns frames into events, and options for every parameter of the event pixels."""

from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from tyro.conf import Positional, arg

from evslip.cli.options import HIDDEN, given, options_of
from evslip.events.datasheet import UNITS
from evslip.events.pixel_model import LIMITS, MAPS, PARAMETERS, PixelModel
from evslip.events.readout.settings import READOUT_LIMITS, READOUT_PARAMETERS, READOUT_UNITS, Readout
from evslip.exchange.frames_to_events_settings import FrameConversion
from evslip.utils.console import console
from evslip.utils.errors import ConfigError, DataError
from evslip.utils.progress import Step


def _pixel_option(name: str) -> Any:
    """Type of a parameter's option: a number, or the name of a file for one that differs from pixel to pixel."""
    low, high = LIMITS[name]
    kind, shown, file = float | None, "NUMBER", ""
    if name in MAPS:
        kind, shown, file = str | None, "NUMBER|FILE", " FILE: .npy of shape (height, width)."
    if name == "noise_map":
        shown, file = "FILE", " FILE: .npz of `evslip calibrate`."
    hint = f"[{UNITS[name]}, {low:g} to {high:g}]{file} (default: the preset's)"
    return Annotated[kind, arg(metavar=shown, help_behavior_hint=hint)]


def _readout_option(name: str) -> Any:
    low, high = READOUT_LIMITS[name]
    hint = f"[{READOUT_UNITS[name]}, {low:g} to {high:g}] (default: the preset's)"
    return Annotated[float | None, arg(metavar="NUMBER", help_behavior_hint=hint)]


ConversionOptions = options_of(FrameConversion, {"clip": HIDDEN, "parameters": HIDDEN, "readout": HIDDEN})
PixelOptions = options_of(PixelModel, {name: _pixel_option(name) for name in PARAMETERS})
ReadoutOptions = options_of(Readout, {name: _readout_option(name) for name in READOUT_PARAMETERS})


def events(
    clip: Positional[Path],
    out: Positional[Path],
    *,
    settings: Annotated[FrameConversion, arg(constructor=ConversionOptions)],
    pixels: Annotated[PixelModel, arg(constructor=PixelOptions)],
    readout: Annotated[Readout, arg(constructor=ReadoutOptions)],
    threads: int = 1,
    device: Annotated[str, arg(metavar="cpu|cuda")] = "cpu",
    preview: Path | None = None,
    preview_ms: float = 33.3,
    plot: Path | None = None,
) -> None:
    """Turn frames that a camera or another renderer made into events.

    Args:
        clip: Folder of images, video file, or .npz file with the arrays frames and t_us or t_s.
        out: File to write; its suffix says the format. HDF5 (.h5) needs little memory, however long the clip is, and
            keeps the settings: `evslip show OUT`.
        threads: Threads that share the rows; the result does not depend on it.
        device: Where the pixels are computed; cuda needs an NVIDIA GPU and the extra cuda.
        preview: Video to write (.mp4, .mkv, .mov, .avi): red ON, blue OFF, 30 pictures a second.
        preview_ms: Time that one picture of it shows, ms; 33.3 plays at true speed, 3.33 ten times slower.
        plot: PNG to write: events a second over time.
    """
    from evslip.codecs import format_of
    from evslip.codecs.settings import keeps_settings
    from evslip.exchange.frames_to_events import convert_frames, open_frames, require_other
    from evslip.view.pictures.preview import check_preview
    from evslip.view.pictures.preview import preview as preview_video
    from evslip.view.pictures.rates import check_plot, rates_plot

    format_of(out, writing=True)
    watchers = []
    conversion = FrameConversion(clip=clip, parameters=parameters_of(pixels), readout=given(readout), **given(settings))
    source = open_frames(conversion)
    if preview is not None:
        check_preview(preview, preview_ms)
        require_other(preview, source)
        watchers.append(partial(preview_video, preview, source.size, picture_ms=preview_ms))
    if plot is not None:
        check_plot(plot)
        require_other(plot, source)
        watchers.append(partial(rates_plot, plot, f"{clip.name}, {conversion.camera}"))
    with Step("frames", source.count) as advance:
        made = convert_frames(
            conversion, source, out, watchers=watchers, threads=threads, device=device, progress=advance
        )
    console.print(f"{out}: {made.summary()}")
    if made.readout is not None:
        console.print(made.readout.summary())
    for written in filter(None, (preview, plot)):
        console.print(str(written))
    if source.intensity == "linear" and made.brightest > 16:
        console.print(
            f"note: the frames reach {made.brightest:g}, taken as light with white = 1; "
            "numbers of 0 to 255 need --intensity uint8 or srgb"
        )
    if not keeps_settings(out):
        console.print(f"note: {out.suffix} files have no place for the settings")


def parameters_of(options: Any) -> dict[str, Any]:
    """Keyword arguments of EventCamera that the options name. Raises ConfigError, DataError."""
    return {name: _value(name, value) if name in MAPS else value for name, value in given(options).items()}


def _value(name: str, text: str) -> Any:
    """A number, or the array in the file of that name."""
    from evslip.events.noise_map import load_noise_map

    if name == "noise_map":
        return load_noise_map(text)
    try:
        return float(text)
    except ValueError:
        pass
    path = Path(text)
    if path.suffix.lower() != ".npy":
        raise ConfigError(f"camera parameter {name}: {text!r} is neither a number nor the name of an .npy file")
    if not path.is_file():
        raise DataError(f"{path}: there is no such file")
    try:
        return np.load(path, allow_pickle=False)
    except (OSError, ValueError, EOFError) as error:
        reason = " ".join(str(error).split())[:160]
        raise DataError(f"{path}: not an .npy file of numbers ({reason})") from None
