"""Verbs about live streams of events."""

import json
import sys
import time
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from evslip.utils.console import console
from evslip.utils.errors import ConfigError
from evslip.windows.settings import Align

LONGEST_S = 1e7


def live(
    source: Positional[str],
    *,
    model: Path = Path("default"),
    hop_s: float = 0.005,
    size: Annotated[tuple[int, int] | None, arg(metavar="WIDTH HEIGHT")] = None,
    align: Align | None = None,
    network: str | None = None,
    json: bool = False,
    once: bool = False,
    duration_s: float | None = None,
) -> None:
    """Run a detector on a live stream of events: a camera, the network, or a file at its own pace.

    Alarms and once a second the counters are printed: what came, what was lost, how late answers are. If the machine is
    too slow, the newest moments are answered first and the others counted as skipped. A source that vanishes is waited
    for.

    Args:
        source: Where events come from: dv://HOST:PORT, a server of dv-processing; udp://HOST:PORT, with ?format=faery
            for faery's datagrams; zenoh://KEY; usb:// or usb://SERIAL, a camera; or a file of events.
        model: Folder of a detector, or `default`, the one of the package.
        hop_s: Time between two answers.
        size: Width and height of the sensor, for sources that do not state it, such as faery's datagrams; default: of
            the sensor that the detector was trained on.
        align: On a sensor of another size than the detector was trained on, look at as many pixels around its centre,
            or from its corner. Without it such events are refused.
        network: Class of the model's network, module:Class, where it is of another package that does not offer it.
        json: Print each answer, note and state of the counters as a line of JSON.
        once: End when the source ends or vanishes; do not wait for one that is not there.
        duration_s: End after so many seconds.
    """
    from evslip.exchange.live import make_source
    from evslip.exchange.live.feed import Feed
    from evslip.learn import Detector
    from evslip.learn.networks import register
    from evslip.learn.streaming.live import LiveDetector

    if duration_s is not None and not 0 < duration_s <= LONGEST_S:
        raise ConfigError(f"duration_s: {duration_s:g} is out of range, expected above 0 to {LONGEST_S:g}")
    if size is not None and not all(1 <= side <= 65_536 for side in size):
        raise ConfigError(f"size: {size[0]} x {size[1]}: expected width and height, each from 1 to 65536")
    if network is not None:
        register(network)
    Detector(model, size=size, align=align, hop_s=hop_s)  # what is wrong shows now
    feed = Feed(make_source(source), once=once, size=size)
    end_s = float("inf") if duration_s is None else time.monotonic() + duration_s
    detector = LiveDetector(
        feed,
        lambda found: Detector(model, size=found, align=align, hop_s=hop_s),
        lambda: time.monotonic() >= end_s,
    )
    # A thread that waits for the interpreter gets it sooner: datagrams wait in a buffer that is not large.
    sys.setswitchinterval(0.0005)
    feed.start()
    show = _show_json if json else _Lines(source).show
    for report in detector.reports():
        show(report)


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


def _show_json(report) -> None:
    from evslip.learn.streaming.live import Answered, Note

    if isinstance(report, Answered):
        lines = [json.dumps(row) for row in report.rows()]
    elif isinstance(report, Note):
        lines = [json.dumps({"note": report.text})]
    else:
        lines = [json.dumps({"status": report.as_json()})]
    if lines:
        print("\n".join(lines), flush=True)


class _Lines:
    """Lines for a person."""

    def __init__(self, source: str):
        self._source = source
        self._newest: float | None = None

    def show(self, report) -> None:
        from evslip.learn.streaming.live import Answered, Note

        if isinstance(report, Note):
            console.print(f"note: {report.text}")
        elif isinstance(report, Answered):
            found = report.detection
            for i in report.begins.nonzero()[0]:
                console.print(f"{found.t_us[i] / 1e6:10.3f} s  SLIP  {found.p_slip[i]:.2f}")
            if len(found.p_slip):
                self._newest = float(found.p_slip[-1])
        else:
            slip = "no answer yet" if self._newest is None else f"slip {self._newest:.2f}"
            delay = "" if report.delay_ms is None else f", delay {report.delay_ms:.1f} ms"
            rates = f"{report.rate_hz / 1e6:.3f} million events/s, {report.answers_hz:.0f} answers/s{delay}"
            if report.final:
                console.print(f"{self._source}: {report.counters.answers:,} answers, {report.counters.alarms:,} alarms")
                console.print(report.counters.line())
            elif report.rate_hz or report.answers_hz:
                console.print(f"{slip}  {rates}; {report.counters.line()}")
