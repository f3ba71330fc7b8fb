"""Run the page of a live stream on this machine."""

import threading
from collections.abc import Callable, Sequence

from evslip.exchange.live.feed import Feed
from evslip.learn.streaming.live import LiveDetector, Note, Report
from evslip.utils.errors import EvslipError
from evslip.view.live.terminal import follow
from evslip.view.web.serving import serve


def serve_live(
    detector: LiveDetector, shows: Sequence[Callable[[Report], None]], name: str, feed: Feed, port: int
) -> None:
    """Follow a stream in a thread, and serve its page until Ctrl-C; the page stays when the stream is over. Raises what
    ended the stream, after the page."""
    from evslip.view.live.page import LiveView, make_app

    view, failures = LiveView(name, feed.size), []

    def put(report: Report) -> None:
        view.size = feed.size or view.size
        view.put(report)

    def run() -> None:
        try:
            follow(detector, [*shows, put])
        except EvslipError as error:
            failures.append(error)
            for show in (*shows, put):
                show(Note(str(error)))
            view.is_over = True

    thread = threading.Thread(target=run, name="live detector", daemon=True)
    thread.start()
    try:
        serve(lambda hosts: make_app(view, hosts), port=port, browser=False, streams=True)
    finally:
        feed.stop()
        thread.join(timeout=5.0)
    if failures:
        raise failures[0]
