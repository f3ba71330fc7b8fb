"""How soon a wrong label is found in `evslip view`: benchmarks/mislabelled.py DATA [--seed N] [--shots FOLDER]

In a copy of a data set's journal one sample, drawn at random among those that slip, is called hold. Then a headless
Chromium (on the path, driven by Playwright) does what a person who has read nothing would do: open the list, click
"doubtful only", click the name that is left, play. Printed is what then stood there, and after how many seconds since
the address was entered; `--shots` keeps screenshots for a person to judge.
"""

import argparse
import shutil
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from playwright.sync_api import Page, sync_playwright
from view import find_chromium, served

from evslip.data import dataset, layout
from evslip.data.journal import Journal


def mislabelled(data: Path, root: Path, seed: int) -> str:
    """A data set with the same samples, one of them called hold although it slips; returns that one's name."""
    entries = dataset.open_dataset(data).entries
    slips = [entry["name"] for entry in entries if entry.get("label") == "slip"]
    if not slips:
        sys.exit(f"{data}: has no sample that slips")
    chosen = str(np.random.default_rng(seed).choice(slips))
    root.mkdir()
    shutil.copy(data / layout.CONFIG, root)
    (root / layout.SAMPLES).symlink_to((data / layout.SAMPLES).absolute())
    journal = Journal(root / layout.JOURNAL)
    for entry in entries:
        if entry["name"] == chosen:
            entry["label"] = "hold"
        journal.append(entry)
    return chosen


def look(page: Page, address: str, shots: Path | None) -> None:
    """Open, filter, open the sample, play; each step with its time."""
    start = time.perf_counter()

    def seen(step: str, text: str) -> None:
        print(f"{time.perf_counter() - start:5.1f} s  {step}: {' '.join(text.split())}")
        if shots is not None:
            page.screenshot(path=shots / f"{step}.png")

    page.goto(address)
    page.wait_for_selector("#rows tr")
    seen("list", page.inner_text("#count"))
    page.wait_for_selector("body[data-complete]")
    seen("facts", page.inner_text("label:has(#doubtful)"))
    page.check("#doubtful")
    seen("doubtful", page.inner_text("#rows"))
    page.click("#rows a")
    page.wait_for_selector("#stage[data-complete]:not([data-complete=''])", timeout=60_000)
    seen("sample", page.inner_text("#facts"))
    page.keyboard.press("Space")
    page.wait_for_selector("#play:has-text('pause')")
    seen("playing", page.inner_text("#now"))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--shots", type=Path)
    options = parser.parse_args()
    chromium = find_chromium()
    if options.shots is not None:
        options.shots.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder) / options.data.absolute().name
        chosen = mislabelled(options.data, root, options.seed)
        with served(root) as address, sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
            look(browser.new_page(viewport={"width": 1280, "height": 800}), address, options.shots)
            browser.close()
    print(f"         it was {chosen}")


if __name__ == "__main__":
    main()
