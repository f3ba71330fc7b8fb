"""How quickly the pages of `evslip view` answer: benchmarks/view.py [--samples N] [--scrubs N]

Makes a data set whose list is long (records with few events; their physics is that of sample 0) and one real sample of
`simple` in a temporary folder, serves them, and drives a headless Chromium (on the path) with Playwright. Printed are
medians and the slow ones of some runs by the clock: the first paint of the list, until all its rows stand there, and on
a sample's page from a click into the curves until the frame and the events of that time are both drawn.
"""

import argparse
import dataclasses
import shutil
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import uvicorn
from playwright.sync_api import Page, sync_playwright

import evslip
from evslip.config.loading import dump_config, load_config
from evslip.data import building, record_file
from evslip.data.record import Record
from evslip.events.stream import Events
from evslip.physics.truth import measure
from evslip.view.explorer.app import Explorer, make_app
from evslip.view.explorer.shelf import open_shelf

CONFIG = load_config("simple")


def real_sample() -> Record:
    """Sample 0 of `simple`."""
    params = evslip.draw(CONFIG, 0)
    trajectory = evslip.simulate(params)
    events = evslip.EventCamera("davis346").run(evslip.render(trajectory))
    return Record(
        kind="simulated",
        name="train/0000000",
        size=(346, 260),
        events=events,
        split="train",
        index=0,
        params=params,
        trajectory=trajectory,
        truth=measure(trajectory),
    )


def make_list(root: Path, first: Record, count: int) -> None:
    """A data set of `count` samples; all but the first have hardly an event."""
    building.create(root, dump_config(CONFIG))
    building.add(root, first, record_file.encode(first))
    few = Events(*(column[:: max(1, first.events.count // 100)] for column in first.events.columns))
    for index in range(1, count):
        params = evslip.draw(CONFIG, index)
        assert first.trajectory is not None
        trajectory = first.trajectory._replace(params=params)
        sample = dataclasses.replace(
            first, name=f"train/{index:07d}", index=index, params=params, trajectory=trajectory, events=few
        )
        building.add(root, sample, record_file.encode(sample))


@contextmanager
def served(root: Path) -> Iterator[str]:
    """The pages' address."""
    port = 8897
    app = make_app(Explorer(open_shelf(root)), [f"127.0.0.1:{port}"])
    server = uvicorn.Server(uvicorn.Config(app, port=port, log_level="warning", ws="none", lifespan="off"))
    thread = threading.Thread(target=server.run)
    thread.start()
    while not server.started:
        time.sleep(0.01)
    try:
        yield f"http://127.0.0.1:{port}"
    finally:
        server.should_exit = True
        thread.join()


def find_chromium() -> str:
    """The browser on the path; ends the program where there is none."""
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if chromium is None:
        sys.exit("needs a Chromium browser on the path")
    return chromium


def first_paint(page: Page, address: str) -> tuple[float, float]:
    """Milliseconds from the request to the first paint, and to the last row of the list."""
    page.goto(address)
    page.wait_for_selector("#rows tr")
    rows = page.evaluate("performance.now()")
    paint = page.evaluate("performance.getEntriesByName('first-contentful-paint')[0].startTime")
    return paint, rows


def scrub(page: Page, places: np.ndarray) -> list[float]:
    """Milliseconds from each jump in time until the page says that the frame and the events of that time are drawn."""
    return [page.evaluate(JUMP, float(place)) for place in places]


JUMP = """async (share) => {
    const charts = document.getElementById("charts"), stage = document.getElementById("stage");
    const box = charts.getBoundingClientRect(), before = stage.dataset.complete;
    const drawn = new Promise((done) => new MutationObserver(() => {
        if (stage.dataset.complete && stage.dataset.complete !== before) done(performance.now());
    }).observe(stage, {attributeFilter: ["data-complete"]}));
    const x = box.left + 66 + share * (box.width - 76);
    const where = {clientX: x, clientY: box.top + 30, pointerId: 1, bubbles: true};
    charts.setPointerCapture = () => {};
    const start = performance.now();
    charts.dispatchEvent(new PointerEvent("pointerdown", where));
    charts.dispatchEvent(new PointerEvent("pointerup", where));
    return await drawn - start;
}"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=1200)
    parser.add_argument("--scrubs", type=int, default=50)
    options = parser.parse_args()
    chromium = find_chromium()
    first = real_sample()
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder) / "data"
        make_list(root, first, options.samples)
        with served(root) as address, sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
            page = browser.new_page(viewport={"width": 1280, "height": 800})
            paints = np.array([first_paint(page, address) for _ in range(5)])
            page.goto(f"{address}/sample/0")
            page.wait_for_selector("#stage[data-complete]:not([data-complete=''])", timeout=120_000)
            page.wait_for_timeout(3000)
            waits = scrub(page, np.random.default_rng(0).uniform(0.02, 0.98, options.scrubs))
            browser.close()
    events = f"{first.events.count / 1e6:.1f} M events"
    print("| | median, ms | 90 % within | slowest |\n|---|---|---|---|")
    for what, values in (
        (f"first paint of {options.samples:,} samples", paints[:, 0]),
        ("all rows of the list", paints[:, 1]),
        (f"a jump in time, sample of {events}", np.array(waits)),
    ):
        print(f"| {what} | {np.median(values):.0f} | {np.quantile(values, 0.9):.0f} | {values.max():.0f} |")


if __name__ == "__main__":
    main()
