"""Verbs that turn frames into events, with options for every parameter of the event pixels; verbs of live streams."""

import contextlib
import sys
import time
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from tyro.conf import Positional, arg

from evslip.cli.options import HIDDEN, DetectorFolder, given, options_of
from evslip.events.datasheet import UNITS
from evslip.events.pixel_model import LIMITS, MAPS, PARAMETERS, PixelModel
from evslip.events.readout.settings import READOUT_LIMITS, READOUT_PARAMETERS, READOUT_UNITS, Readout
from evslip.exchange.frames_to_events_settings import FrameConversion
from evslip.utils.console import console
from evslip.utils.errors import ConfigError, DataError
from evslip.utils.progress import Step
from evslip.windows.settings import Align

LONGEST_S = 1e7
"""Longest time that a live stream can be asked to be followed."""


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
    with contextlib.suppress(ValueError):
        return float(text)
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


def live(
    source: Positional[str],
    *,
    model: DetectorFolder = Path("default"),
    hop_s: float = 0.005,
    size: Annotated[tuple[int, int] | None, arg(metavar="WIDTH HEIGHT")] = None,
    align: Align | None = None,
    network: str | None = None,
    json: bool = False,
    once: bool = False,
    duration_s: float | None = None,
    to: str | None = None,
    page: Annotated[int | None, arg(metavar="PORT")] = None,
) -> None:
    """Run a detector on a live stream of events: a camera, the network, or a file at its own pace.

    Alarms and once a second the counters are printed: what came, what was lost, how late answers are. If the machine is
    too slow, the newest moments are answered first and the others counted as skipped. A source that vanishes is waited
    for.

    Args:
        source: Where events come from: dv://HOST:PORT, a server of dv-processing; udp://HOST:PORT, with ?format=faery
            for faery's datagrams; zenoh://KEY, or zenoh://DOMAIN/TOPIC?format=ros2, a topic of ROS 2; usb:// or
            usb://SERIAL, a camera; or a file of events.
        hop_s: Time between two answers.
        size: Width and height of the sensor, for sources that do not state it, such as faery's datagrams; default: of
            the sensor that the detector was trained on.
        align: On a sensor of another size than the detector was trained on, look at as many pixels around its centre,
            or from its corner. Without it such events are refused.
        network: Class of the model's network, module:Class, where it is of another package that does not offer it.
        json: Print each answer, note and state of the counters as a line of JSON.
        once: End when the source ends or vanishes; do not wait for one that is not there.
        duration_s: End after so many seconds.
        to: Send each answer as JSON to a controller: udp://HOST:PORT, a datagram each, or ws://HOST:PORT/PATH, a
            message each.
        page: Draw events, probability, alarms and counters on a page at this port; 0 takes a free one.
    """
    from evslip.exchange.live import make_source
    from evslip.exchange.live.feed import Feed
    from evslip.exchange.live.outlet import Outlet
    from evslip.learn import Detector
    from evslip.learn.networks import register
    from evslip.learn.streaming.live import LiveDetector
    from evslip.view.live.serve import serve_live
    from evslip.view.live.terminal import Lines, follow, send_answers, show_json
    from evslip.view.web.serving import require_server

    if duration_s is not None and not 0 < duration_s <= LONGEST_S:
        raise ConfigError(f"duration_s: {duration_s:g} is out of range, expected above 0 to {LONGEST_S:g}")
    if size is not None and not all(1 <= side <= 65_536 for side in size):
        raise ConfigError(f"size: {size[0]} x {size[1]}: expected width and height, each from 1 to 65536")
    if network is not None:
        register(network)
    make = partial(Detector, model, align=align, hop_s=hop_s, rolling=True)
    make(size=size)  # what is wrong shows now
    feed = Feed(make_source(source), once=once, size=size)
    outlet = None if to is None else Outlet(to)
    if page is not None:
        require_server(page)
    end_s = float("inf") if duration_s is None else time.monotonic() + duration_s
    detector = LiveDetector(feed, lambda found: make(size=found), lambda: time.monotonic() >= end_s)
    # A thread that waits for the interpreter gets it sooner: datagrams wait in a buffer that is not large.
    sys.setswitchinterval(0.0005)
    feed.start()
    shows = [show_json if json else Lines(source).show]
    if outlet is not None:
        shows.append(partial(send_answers, outlet))
    try:
        if page is None:
            follow(detector, shows)
        else:
            serve_live(detector, shows, source, feed, page)
    finally:
        if outlet is not None:
            outlet.close()


def stream(
    file: Positional[Path],
    target: Positional[str],
    *,
    speed: float = 1.0,
    loop: bool = False,
) -> None:
    """Send a file of events at its own pace, as if a camera did, for `evslip live` and others.

    Args:
        file: A record, a recording or plain events, a file of any known format.
        target: Where events go: dv://HOST:PORT, for all readers of dv-processing's network stream; udp://HOST:PORT,
            with ?format=faery for faery's datagrams, and &bytes=1400 for their length; zenoh://KEY.
        speed: Times the recording's own pace; 0: as fast as it goes.
        loop: Begin anew at the end, until Ctrl-C; times go on.
    """
    from evslip.exchange.live import make_target
    from evslip.exchange.live.sender import send_file

    sent = send_file(file, lambda size: make_target(target, size), speed=speed, loop=loop)
    console.print(f"{target}: {sent}")
