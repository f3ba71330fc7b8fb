"""Answers to a live stream on the terminal."""

import json
from collections.abc import Callable, Sequence

from evslip.exchange.live.outlet import Outlet
from evslip.learn.streaming.live import Answered, LiveDetector, Note, Report
from evslip.utils.console import console


def follow(detector: LiveDetector, shows: Sequence[Callable[[Report], None]]) -> None:
    """Hand every report to all who show it, until the stream is over."""
    for report in detector.reports():
        for show in shows:
            show(report)


def send_answers(outlet: Outlet, report: Report) -> None:
    """Send the answers of a report to a controller, a line of JSON each."""
    if isinstance(report, Answered):
        for row in report.rows():
            outlet.send(json.dumps(row))


def show_json(report: Report) -> None:
    """Print a report as lines of JSON."""
    if isinstance(report, Answered):
        lines = [json.dumps(row) for row in report.rows()]
    elif isinstance(report, Note):
        lines = [json.dumps({"note": report.text})]
    else:
        lines = [json.dumps({"status": report.as_json()})]
    if lines:
        print("\n".join(lines), flush=True)


class Lines:
    """Lines for a person."""

    def __init__(self, source: str):
        self._source = source
        self._newest: float | None = None

    def show(self, report: Report) -> None:
        """Print a report, if it says something new."""
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
