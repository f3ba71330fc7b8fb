"""The report: whole without parts, self-contained, safe with any text, and without errors in a browser."""

import json
import re
import shutil
from pathlib import Path

import pytest

import evslip
from evslip.errors import DataError
from evslip.view.report import write_report
from evslip.window_set import WindowSettings

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
PARTS = (
    "Two samples through the five phases",
    "Their events in space and time",
    "Angular difference over time",
    "Labels",
)


@pytest.fixture(scope="module")
def dataset(tmp_path_factory) -> evslip.Dataset:
    root = tmp_path_factory.mktemp("data")
    overrides = {"camera.width": 64, "camera.height": 48, "render.max_motion_px": 2.0}
    evslip.generate(evslip.load_config("demo", overrides), root, 2, workers=1)
    return evslip.open_dataset(root)


@pytest.fixture(scope="module")
def model(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("model")
    history = [{"epoch": i, "loss": 1 / i, "val_loss": 1.1 / i, "accuracy": 0.5, "val_accuracy": 0.6} for i in (1, 2)]
    (folder / "history.json").write_text(json.dumps(history))
    scores = {"accuracy": 0.75, "f1": 0.7, "auroc": None, "confusion": [[30, 10], [10, 30]]}
    (folder / "evaluation.json").write_text(json.dumps(scores))
    return folder


@pytest.fixture(scope="module")
def page(dataset, model, tmp_path_factory) -> Path:
    out = tmp_path_factory.mktemp("page") / "report.html"
    settings = WindowSettings(balance=False, left=0, top=0, width=64, height=48, sensor_width=64, sensor_height=48)
    return write_report(out, dataset, windows=dataset.windows(settings), model_dir=model)


def without_library(page: Path) -> str:
    """The page without the plotting library and the pictures, which are large and not ours."""
    text = page.read_text()
    from plotly.offline import get_plotlyjs

    return re.sub(r"data:image/png;base64,[^\"]+", "", text.replace(get_plotlyjs(), ""))


def test_every_part_is_there(page):
    text = without_library(page)
    assert all(part in text for part in (*PARTS, "Training", "Test"))
    assert "75.0 %" in text
    pictures = re.findall(r'<img src="data:image/png;base64,', page.read_text())
    assert len(pictures) == 20  # two samples, five phases, with and without events


def test_it_refers_to_nothing_outside_itself(page):
    text = without_library(page)
    assert not re.findall(r"(?:src|href|url)\s*[=(]\s*[\"']?(?:https?:)?//", text)
    assert "default-src 'none'" in text


def test_missing_parts_are_left_out(dataset, tmp_path):
    text = without_library(write_report(tmp_path / "plain.html", dataset))
    assert all(part in text for part in PARTS)
    assert "<h2>Training</h2>" not in text
    assert "<h2>Test</h2>" not in text


def test_text_from_files_cannot_become_markup(dataset, tmp_path):
    wild = tmp_path / "<img src=x onerror=alert(1)>"
    shutil.copytree(dataset.root, wild)
    text = without_library(write_report(tmp_path / "wild.html", evslip.open_dataset(wild)))
    assert "<img src=x" not in text
    assert "&lt;img src=x" in text


def test_figures_are_valid_json_and_bounded(page):
    figures = re.findall(r'<script type="application/json" id="([^"]+)">(.*?)</script>', without_library(page), re.S)
    assert {"theta", "cloud-slip", "cloud-hold"} <= {name for name, _ in figures}
    for name, data in figures:
        figure = json.loads(data)
        assert sum(len(trace.get("x", ())) for trace in figure["data"]) < 500_000, name


def test_a_model_folder_that_is_none_is_one_clear_line(dataset, tmp_path):
    with pytest.raises(DataError, match="no such folder"):
        write_report(tmp_path / "r.html", dataset, model_dir=tmp_path / "absent")
    (tmp_path / "history.json").write_text("{")
    with pytest.raises(DataError, match=r"history\.json"):
        write_report(tmp_path / "r.html", dataset, model_dir=tmp_path)
    assert not (tmp_path / "r.html").exists()


@pytest.mark.slow
@pytest.mark.skipif(BROWSER is None, reason="needs Chromium on the PATH")
def test_a_browser_draws_every_figure_without_error_or_network(page):
    playwright = pytest.importorskip("playwright.sync_api")
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(
            executable_path=BROWSER, args=["--no-sandbox", "--use-gl=swiftshader", "--enable-unsafe-swiftshader"]
        )
        tab = browser.new_page(viewport={"width": 1280, "height": 800})
        problems, requests = [], []
        tab.on("pageerror", lambda error: problems.append(str(error)))
        tab.on("console", lambda message: problems.append(message.text) if message.type == "error" else None)
        tab.on("request", lambda request: requests.append(request.url))
        tab.goto(page.as_uri())
        figures = tab.locator("[data-figure]")
        for i in range(figures.count()):
            figures.nth(i).scroll_into_view_if_needed()
            figures.nth(i).locator(".main-svg, canvas").first.wait_for(state="attached", timeout=30_000)
        wide = tab.evaluate("document.documentElement.scrollWidth")
        browser.close()
    assert problems == []
    assert [url for url in requests if not url.startswith(("data:", "blob:"))] == [page.as_uri()]
    assert wide <= 1280
