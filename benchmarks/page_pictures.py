"""Pictures of docs/how-to/seeing.md: python benchmarks/page_pictures.py WORK --real RECORDING [--out docs/figures]

Does what the page tells a reader to do, with evslip's commands and a headless Chromium (on the path): 24 samples of
`complex`, one of them called hold although it slips, a detector trained on 16 of them, and every page and picture of
these. WORK keeps data and detector: a second run draws again what has changed. RECORDING, of a real camera, is what the
report compares with. Needs the extras [learn], [view] and [dev]; the picture of Rerun's own viewer is not drawn here.
"""

import argparse
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import cycle, pairwise
from pathlib import Path

import av
from accessibility import serving
from mislabelled import mislabelled
from PIL import Image
from playwright.sync_api import Browser, Page, sync_playwright
from view import find_chromium

from evslip.data import record_file
from evslip.data.dataset import open_dataset
from evslip.data.intervals import Interval, write_intervals
from evslip.data.record import Record

TRAIN, TEST = 16, 8
WIDE, NARROW, GAP = (1280, 800), (390, 844), 10
QUALITY = 85
STEPS = 6
"""Of 10 ms each, after the onset of a slip: it is fast then, and not over."""
MARGIN_US, LEAST_US = 25_000, 100_000
"""What a person leaves unmarked at an edge, and the shortest that is marked."""
STRIP_PX = 260
DRAWN = "#stage[data-complete]:not([data-complete=''])"
SECTIONS = {
    "gallery": "Samples",
    "rates": "Event rates and polarity over time",
    "real": "Beside real recordings",
    "worst": "Worst windows",
}
"""Headings of the report, by the picture that begins with each."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("work", type=Path)
    parser.add_argument("--real", type=Path, required=True)
    parser.add_argument("--out", type=Path, default=Path("docs/figures"))
    options = parser.parse_args()
    if not options.real.exists():
        parser.error(f"--real: {options.real} is not there; expected a recording of a real camera")
    chromium, work, out = find_chromium(), options.work, options.out
    out.mkdir(parents=True, exist_ok=True)
    data, model = prepare(work)
    shown = work / "complex"
    shutil.rmtree(shown, ignore_errors=True)
    chosen = mislabelled(data, shown, 0)
    slip, hold = (first(data, slips, without=chosen) for slips in (True, False))
    marked, slip_edge = label(work, slip)
    video(work, slip, hold, out / "seeing_video.jpg")
    windows(work, data, out / "seeing_windows.jpg")
    page = work / "report.html"
    evslip(
        "report", shown, "--model", model, "--windows", work / "windows.h5", "--compare", options.real, "--out", page
    )
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        narrow = [*explorer(browser, shown, model, slip, out), labels(browser, marked, slip_edge, out)]
        beside(narrow, out / "seeing_phone.jpg")
        report(browser, page, out)


def evslip(*words: object) -> None:
    """Run a command as a reader would; end the program where it fails."""
    print("evslip", *words, flush=True)
    command = [sys.executable, "-m", "evslip", *map(str, words)]
    if subprocess.run(command, stdout=subprocess.DEVNULL, check=False).returncode:
        sys.exit("failed: evslip " + " ".join(map(str, words)))


def prepare(work: Path) -> tuple[Path, Path]:
    """Folders of the data and of a measured detector, made as far as they are not there."""
    data, model = work / "data", work / "model"
    for split, count in (("train", TRAIN), ("test", TEST)):
        evslip("generate", "complex", data, "--count", count, "--split", split)
    if not (model / "evaluation.json").is_file():
        evslip("windows", data, work / "windows.h5", "--split", "train", "--hop-s", 0.04)
        evslip("train", work / "windows.h5", model, "--model", "countnet", "--epochs", 8)
        evslip("evaluate", model, data, "--split", "test")
    return data, model


def first(data: Path, slips: bool, without: str) -> Record:
    """The first training sample that slips, or holds, but for one."""
    for listed in open_dataset(data).split("train").listing:
        if (listed.label == "slip") == slips and listed.name != without:
            return record_file.read(listed.path)
    sys.exit(f"{data}: no sample {'slips' if slips else 'holds'}")


def label(work: Path, record: Record) -> tuple[Path, int]:
    """The sample's events as a camera would have recorded them, with labels beside them as a person might set them; and
    how many edges of these come up to the first slip's begin."""
    file = work / "plain.aedat4"
    evslip("convert", path_of(work, record), file)
    assert record.truth is not None
    begin, held = int(record.events.t_us[0]), record.truth.t_us[record.truth.held]
    slips = [at for episode in record.truth.episodes for at in (episode.start_us, episode.end_us)]
    spans = pairwise([int(held[0]), *slips, int(held[-1])])
    found = [
        Interval(start - begin + MARGIN_US, end - begin - MARGIN_US, kind)
        for (start, end), kind in zip(spans, cycle(("hold", "slip")), strict=False)
        if end - start >= LEAST_US
    ]
    write_intervals(work / "plain-labels.csv", found)
    return file, 1 + 2 * next(place for place, one in enumerate(found) if one.label == "slip")


def path_of(work: Path, record: Record) -> Path:
    """File of a sample."""
    return next(one.path for one in open_dataset(work / "data").listing if one.name == record.name)


def video(work: Path, slip: Record, hold: Record, out: Path) -> None:
    """A picture of the video of two samples, in the middle of a slip."""
    assert slip.truth is not None
    assert slip.truth.onset_us is not None
    start_s, file = slip.truth.onset_us / 1e6, work / "both.mp4"
    span = ("--start-s", start_s, "--end-s", start_s + 2e-2 * STEPS)
    evslip("video", path_of(work, slip), path_of(work, hold), "--out", file, *span)
    with av.open(str(file)) as film:
        frames = list(film.decode(video=0))
    frames[-1].to_image().save(out, quality=QUALITY)


def windows(work: Path, data: Path, out: Path) -> None:
    """Every other picture of the window that turns most, and of the one that turns least, without and with events."""
    folder = work / "pictures"
    if not folder.is_dir():
        rare = ("--split", "test", "--hop-s", 1.0)
        evslip("windows", data, work / "windows-rare.h5", *rare, "--visualize", folder)
    names = sorted(file.stem for file in folder.glob("*.mp4"))
    rows = []
    for name in (names[-1], names[0]):
        for ending in ("", "_events"):
            files = [folder / f"{name}_{number}{ending}.png" for number in range(0, 8, 2)]
            rows.append(sheet([fitted(Image.open(file).convert("RGB")) for file in files], 0))
    whole = Image.new("RGB", (rows[0].width, sum(row.height for row in rows)))
    for number, row in enumerate(rows):
        whole.paste(row, (0, number * row.height))
    whole.save(out, quality=QUALITY)


def fitted(image: Image.Image) -> Image.Image:
    """As wide as the pictures of a strip."""
    return image.resize((STRIP_PX, round(image.height * STRIP_PX / image.width)), Image.Resampling.LANCZOS)


def sheet(images: list[Image.Image], gap: int) -> Image.Image:
    """Images of one height side by side, on white."""
    whole = Image.new("RGB", (sum(i.width for i in images) + gap * (len(images) - 1), images[0].height), "white")
    left = 0
    for image in images:
        whole.paste(image, (left, 0))
        left += image.width + gap
    return whole


def beside(files: list[Path], out: Path) -> None:
    """Pictures of narrow windows side by side; they themselves are removed."""
    sheet([Image.open(file).convert("RGB") for file in files], GAP).save(out, quality=QUALITY)
    for file in files:
        file.unlink()


@contextmanager
def opened(
    browser: Browser, address: str, ready: str, size: tuple[int, int] = WIDE, scheme: str = "light"
) -> Iterator[Page]:
    """A page, once what is waited for is there."""
    page = browser.new_page(viewport={"width": size[0], "height": size[1]}, color_scheme=scheme)
    page.goto(address)
    page.wait_for_selector(ready, timeout=120_000)
    yield page
    page.close()


def settled(page: Page, file: Path) -> Path:
    """A picture of the window, after what moves in it has come to rest."""
    page.wait_for_timeout(1500)
    page.screenshot(path=file)
    return file


def explorer(browser: Browser, shown: Path, model: Path, slip: Record, out: Path) -> list[Path]:
    """The list, and the sample that slips shortly after its onset; returns the same in a narrow window."""
    place = [one.name for one in open_dataset(shown).listing].index(slip.name)
    narrow = []
    with serving("view", str(shown), "--model", str(model)) as address:
        pages = {"list": (address, "body[data-complete]", 0), "sample": (f"{address}sample/{place}", DRAWN, STEPS)}
        for name, (page_address, ready, steps) in pages.items():
            for size, kind in ((WIDE, "seeing"), (NARROW, "narrow")):
                with opened(browser, page_address, ready, size) as page:
                    for _ in range(steps):
                        page.keyboard.press("ArrowRight")
                    file = settled(page, out / f"{kind}_{name}.png")
                narrow += [file] if size is NARROW else []
    return narrow


def labels(browser: Browser, recording: Path, slip_edge: int, out: Path) -> Path:
    """The page to label on, in the middle of a slip; the same in a narrow window, whose picture is returned. And what
    a detector says of the recording, with these labels behind it."""
    with serving("label", str(recording)) as address:
        for size, name in ((WIDE, "seeing_label.png"), (NARROW, "narrow_label.png")):
            with opened(browser, address, DRAWN, size) as page:
                page.wait_for_selector("#intervals tr")
                for key in (*("]",) * slip_edge, *("ArrowRight",) * STEPS):
                    page.keyboard.press(key)
                settled(page, out / name)
    labelled = recording.with_name("labelled.h5")
    labelled.unlink(missing_ok=True)
    evslip("import", recording, labelled, "--labels", recording.with_name("plain-labels.csv"))
    answers = recording.with_name("answers")
    evslip("detect", "default", labelled, "--out", answers)
    shutil.copyfile(answers.with_suffix(".png"), out / "seeing_detect.png")
    return out / "narrow_label.png"


def report(browser: Browser, page_file: Path, out: Path) -> None:
    """Four sections of the report, and it in a narrow, dark window."""
    address = page_file.resolve().as_uri()
    with opened(browser, address, "h2") as page:
        for name, heading in SECTIONS.items():
            picture(page, heading, out / f"seeing_report_{name}.jpg")
    with opened(browser, address, "h2", NARROW, "dark") as page:
        shown = ("gallery", "rates", "worst")
        narrow = [picture(page, SECTIONS[name], out / f"narrow_{name}.png") for name in shown]
    beside(narrow, out / "seeing_report_phone.jpg")


def picture(page: Page, heading: str, file: Path) -> Path:
    """A picture of the window with a section at its top."""
    page.get_by_role("heading", name=heading, exact=True).first.evaluate("one => one.scrollIntoView({block: 'start'})")
    page.wait_for_timeout(1500)
    page.screenshot(path=file, **({"type": "jpeg", "quality": QUALITY} if file.suffix == ".jpg" else {}))
    return file


if __name__ == "__main__":
    main()
