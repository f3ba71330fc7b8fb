import base64
import dataclasses
import html.parser
import io
import json
import math
import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from evslip.config.loading import dump_config, load_config
from evslip.data import building
from evslip.data.dataset import Dataset, open_dataset
from evslip.data.record_file import encode
from evslip.events.overlay import OFF_COLOR, ON_COLOR, overlay
from evslip.events.stream import Events, empty_events
from evslip.learn.evaluation.cost import Cost
from evslip.learn.evaluation.evaluation import Curves, Evaluation
from evslip.learn.evaluation.stored import read_evaluation, save_evaluation
from evslip.learn.scores.metrics import Metrics
from evslip.physics.trajectory import Trajectory
from evslip.physics.truth import Truth
from evslip.utils.errors import DataError
from evslip.view.pictures import figures
from evslip.view.pictures.images import data_uri
from evslip.view.report.report import write_report
from evslip.windows.cutting import windows_of
from evslip.windows.window_set import Windows, WindowSettings
from sample_records import CONFIG, random_events, simulated

SCORES = Metrics(
    windows=120,
    trajectories=8,
    threshold=0.5,
    accuracy=0.9417,
    balanced_accuracy=0.94,
    f1=0.938,
    auroc=0.987,
    auprc=0.99,
    ece=0.02,
    brier=0.05,
    confusion=[[57, 3], [4, 56]],
    without_recent=math.nan,
)
COST = Cost(48, 900.0, 1.5, 2.0, 0.5, 0.2, 6e5, None, "cpu")
EVALUATION = Evaluation(
    "models/a", "mlp", 1234, {}, "made up", SCORES, Curves([], [], []), None, None, None, [], COST, 0.0, None, []
)
HISTORY = [
    {"epoch": i, "train_loss": 1 / i, "val_loss": 1.1 / i, "train_accuracy": 0.9, "val_accuracy": math.nan}
    for i in range(1, 6)
]


class Page(html.parser.HTMLParser):
    """Elements with their attributes, and the text inside them."""

    def __init__(self, path: Path):
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.scripts: list[tuple[dict[str, str | None], str]] = []
        self.text = ""
        self.source = path.read_text(encoding="utf-8")
        self._script: dict[str, str | None] | None = None
        self.feed(self.source)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        self._script = dict(attrs) if tag == "script" else None

    def handle_data(self, data: str) -> None:
        if self._script is not None:
            self.scripts.append((self._script, data))
            self._script = None
        else:
            self.text += data

    @property
    def figures(self) -> dict[str, dict]:
        return {str(a["id"]): json.loads(data) for a, data in self.scripts if a.get("type") == "application/json"}


def pictures(trajectory: Trajectory, times_us: np.ndarray) -> list[np.ndarray]:
    shade = np.linspace(30, 220, 40, dtype=np.uint8)
    return [np.broadcast_to(shade[None, :, None], (30, 40, 3)).copy() for _ in times_us]


def long_sample(index: int, split: str):
    """A made-up sample that lasts the 7.5 s of the motion; every third one turns by 5 degrees."""
    sample = simulated(index, split)
    assert sample.params is not None
    rng = np.random.default_rng(index)
    t_us = np.arange(0, 7_500_000, 5_000, dtype=np.int64)
    n, slips = len(t_us), index % 3 == 0
    angle = np.interp(t_us, [2_000_000, 3_500_000], [0.01, 5.0 if slips else 0.012])
    half = np.radians(angle) / 2
    rotation = np.stack([np.cos(half), np.sin(half), 0 * half, 0 * half], -1)
    held = (t_us > 1_000_000) & (t_us < 6_500_000)
    truth = Truth(t_us, angle, rotation, np.zeros((n, 3)), held, (800_000, 6_700_000), 2_000_000 if slips else None)
    arrays = [np.ones((n, 7)), np.ones((n, 7)), np.zeros((n, 9)), np.zeros((n, 2)), np.zeros(n)]
    events = random_events(rng, 4000)
    events = events.replace(t_us=np.sort(rng.integers(800_000, 6_700_000, 4000)))
    return dataclasses.replace(sample, truth=truth, trajectory=Trajectory(sample.params, t_us, *arrays), events=events)


def make(root: Path, indices: dict[str, range]) -> Dataset:
    building.create(root, dump_config(CONFIG))
    for split, which in indices.items():
        for index in which:
            sample = long_sample(index, split)
            building.add(root, sample, encode(sample))
    return open_dataset(root)


@pytest.fixture
def samples(tmp_path: Path) -> Dataset:
    return make(tmp_path / "<data> & more", {"train": range(4), "test": range(2)})


@pytest.fixture
def cut(samples: Dataset) -> Windows:
    return windows_of(samples, WindowSettings(left=0, top=0, width=40, height=30, sensor_width=40, sensor_height=30))


@pytest.fixture
def model_dir(tmp_path: Path) -> Path:
    folder = tmp_path / "model"
    folder.mkdir()
    (folder / "history.json").write_text(json.dumps(HISTORY))
    save_evaluation(folder / "evaluation.json", [EVALUATION])
    return folder


def test_the_page_shows_everything(tmp_path: Path, samples: Dataset, cut: Windows, model_dir: Path):
    cut.save(tmp_path / "w.h5")
    path = write_report(tmp_path / "out" / "r.html", samples, tmp_path / "w.h5", model_dir, pictures=pictures)
    page = Page(path)
    parameters = {name for name in page.figures if name.startswith("parameter-")}
    assert len(parameters) > 10
    assert set(page.figures) - parameters == {
        "cloud-slip",
        "cloud-hold",
        "theta",
        "samples",
        "windows",
        "rates",
        "polarity",
        "map",
        "noise-map",
        "training-loss",
        "training-accuracy",
    }
    places = [a["data-figure"] for _, a in page.elements if "data-figure" in a]
    assert sorted(map(str, places)) == sorted(page.figures)
    drawn = [a for tag, a in page.elements if tag == "img"]
    images = [a for a in drawn if "loading" not in a]
    assert len(images) == 2 * 2 * 5  # two samples, with and without events, five phases
    assert len(drawn) - len(images) == 6  # a thumbnail of every sample
    for image in images:
        data = base64.b64decode(str(image["src"]).removeprefix("data:image/png;base64,"))
        assert Image.open(io.BytesIO(data)).size == (40, 30)
        assert image["alt"]
    for text in ("94.2 %", "AUROC", "0.987", "57", "93.3 %", "slips from 2.00 s", "never slips"):
        assert text in page.text
    for phase in ("initial", "lift", "tilt", "back", "placement"):
        assert phase in page.text
    assert "mass_kg" in page.text  # the configuration


def test_the_page_needs_no_network(tmp_path: Path, samples: Dataset):
    page = Page(write_report(tmp_path / "r.html", samples, pictures=pictures))
    policy = next(str(a["content"]) for tag, a in page.elements if tag == "meta" and "http-equiv" in a)
    assert policy.startswith("default-src 'none'")
    assert "http" not in policy
    for tag, attributes in page.elements:
        for name in ("src", "href", "data", "action"):
            assert str(attributes.get(name, "data:")).startswith("data:"), (tag, attributes)


def test_names_cannot_become_markup(tmp_path: Path, samples: Dataset):
    page = Page(write_report(tmp_path / "r.html", samples, pictures=pictures))
    assert "<data>" not in page.source
    assert "<data> & more" in page.text or "&lt;data&gt; &amp; more" in page.source
    (samples.root / "config.toml").write_text(samples.config_toml + "\n# </pre><script>alert(1)</script>\n")
    page = Page(write_report(tmp_path / "r.html", open_dataset(samples.root), pictures=pictures))
    assert "<script>alert" not in page.source


def test_a_name_that_is_no_utf_8_is_told_by_its_bytes(tmp_path: Path):
    root = tmp_path / "held\udcff"
    page = Page(write_report(tmp_path / "r.html", make(root, {"train": range(1, 2)}), pictures=pictures))
    assert "held\\udcff" in page.source


def test_parts_without_data_are_left_out(tmp_path: Path):
    held = make(tmp_path / "held", {"train": range(1, 3)})
    page = Page(write_report(tmp_path / "r.html", held, pictures=pictures))
    names = {name for name in page.figures if not name.startswith("parameter-")}
    assert names == {"cloud-hold", "theta", "samples", "rates", "polarity", "map", "noise-map"}
    assert "Training" not in page.text
    building.create(tmp_path / "empty", dump_config(CONFIG))
    page = Page(write_report(tmp_path / "r.html", open_dataset(tmp_path / "empty"), pictures=pictures))
    assert page.figures == {}


def test_a_model_without_an_evaluation_shows_its_training(tmp_path: Path, samples: Dataset, model_dir: Path):
    (model_dir / "evaluation.json").unlink()
    page = Page(write_report(tmp_path / "r.html", samples, model_dir=model_dir, pictures=pictures))
    assert "training-loss" in page.figures
    assert "AUROC" not in page.text


def test_damaged_and_missing_parts_of_a_model_are_named(tmp_path: Path, samples: Dataset, model_dir: Path):
    (model_dir / "history.json").write_text("{")
    with pytest.raises(DataError, match=r"history\.json"):
        write_report(tmp_path / "r.html", samples, model_dir=model_dir, pictures=pictures)
    (model_dir / "history.json").write_text('{"epoch": 1}')
    with pytest.raises(DataError, match="list of tables"):
        write_report(tmp_path / "r.html", samples, model_dir=model_dir, pictures=pictures)
    with pytest.raises(DataError, match="no such folder"):
        write_report(tmp_path / "r.html", samples, model_dir=tmp_path / "none", pictures=pictures)
    with pytest.raises(DataError, match=r"neither model\.json nor evaluation\.json"):
        write_report(tmp_path / "r.html", samples, model_dir=samples.root, pictures=pictures)
    assert not (tmp_path / "r.html").exists()


def test_a_stored_confusion_of_another_shape_is_refused(tmp_path: Path):
    scores = dataclasses.replace(SCORES, confusion=[[1]])
    save_evaluation(tmp_path / "evaluation.json", [dataclasses.replace(EVALUATION, scores=scores)])
    with pytest.raises(DataError, match="confusion"):
        read_evaluation(tmp_path / "evaluation.json")


def decoded(values: dict[str, str]) -> np.ndarray:
    return np.frombuffer(base64.b64decode(values["bdata"]), np.dtype(values["dtype"]))


@pytest.mark.parametrize("count", [0, 1, 300, 5000])
def test_a_cloud_shows_events_of_the_stream(count: int):
    events = random_events(np.random.default_rng(0), count)
    figure = figures.space_time(events, (40, 30), most=1000)
    points = sum(len(decoded(trace["x"])) for trace in figure["data"])
    assert points == min(count, 1000)
    known = set(zip((events.t_us / 1e6).astype(np.float32), events.x, events.y, strict=True))
    for trace in figure["data"]:
        assert set(zip(*(decoded(trace[axis]) for axis in "xyz"), strict=True)) <= known
    json.dumps(figure, allow_nan=False)


def test_a_cloud_without_labels_has_two_colours():
    events = random_events(np.random.default_rng(0), 100, labelled=False)
    assert [trace["name"] for trace in figures.space_time(events, (40, 30))["data"]] == ["ON", "OFF"]


def test_angles_and_thresholds_are_where_they_belong():
    truth = long_sample(0, "train").truth
    figure = figures.theta(
        truth, None, [], {"lift": (1_000_000, 2_000_000), "late": (7_000_000, 8_000_000)}, (0.1, 1.0)
    )
    (line,) = figure["data"]
    assert truth is not None
    np.testing.assert_allclose(
        decoded(line["y"]), np.interp(decoded(line["x"]), truth.t_us / 1e6, truth.theta_deg), rtol=1e-5
    )
    assert [s["y0"] for s in figure["layout"]["shapes"] if s.get("xref") == "paper"] == [0.1, 1.0]
    texts = [note["text"] for note in figure["layout"]["annotations"]]
    assert "lift" in texts
    assert "late" not in texts  # outside what is recorded


@pytest.mark.parametrize(("thresholds", "drawn"), [((0.0, 1.0), [1.0]), ((0.0, 0.0), [])])
def test_a_threshold_of_nothing_has_no_line_on_a_logarithmic_axis(thresholds: tuple[float, float], drawn: list[float]):
    truth = long_sample(0, "train").truth
    assert truth is not None
    still = truth._replace(theta_deg=0 * truth.theta_deg)
    layout = figures.theta(still, None, [], {}, thresholds)["layout"]
    assert [s["y0"] for s in layout["shapes"] if s.get("xref") == "paper"] == drawn
    assert all(math.isfinite(note["y"]) for note in layout["annotations"])
    assert layout["yaxis"]["range"][0] < layout["yaxis"]["range"][1] < math.inf


def test_the_overlay_paints_the_last_event_of_a_pixel():
    grey = np.full((3, 4, 3), 100, np.uint8)
    x, y = np.array([1, 1, 3], np.uint16), np.array([2, 2, 0], np.uint16)
    events = Events(np.arange(3), x, y, np.array([True, False, True]))
    drawn = overlay(grey, events)
    assert tuple(drawn[2, 1]) == OFF_COLOR
    assert tuple(drawn[0, 3]) == ON_COLOR
    untouched = np.ones((3, 4), bool)
    untouched[y, x] = False
    assert len(np.unique(drawn[untouched], axis=0)) == 1
    np.testing.assert_array_equal(overlay(grey, empty_events())[untouched], drawn[untouched])


def test_a_picture_survives_its_uri():
    original = np.random.default_rng(0).integers(0, 256, (5, 7, 3)).astype(np.uint8)
    data = base64.b64decode(data_uri(original).partition(",")[2])
    np.testing.assert_array_equal(np.asarray(Image.open(io.BytesIO(data))), original)


def test_the_configuration_is_shown_as_it_is(tmp_path: Path, samples: Dataset):
    page = Page(write_report(tmp_path / "r.html", samples, pictures=pictures))
    (tmp_path / "shown.toml").write_text(page.text[page.text.index("seed = ") :].partition("Two samples")[0])
    assert load_config(tmp_path / "shown.toml") == CONFIG


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("size", [(1280, 800), (390, 844)])
def test_a_browser_draws_the_page(
    tmp_path: Path, samples: Dataset, cut: Windows, model_dir: Path, scheme: str, size: tuple[int, int]
):
    api = pytest.importorskip("playwright.sync_api", reason="needs the package playwright")
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if chromium is None:
        pytest.skip("needs a Chromium browser on the path")
    path = write_report(tmp_path / "r.html", samples, cut, model_dir, pictures=pictures)
    messages, requests = [], []
    with api.sync_playwright() as playwright:
        software_gl = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
        browser = playwright.chromium.launch(executable_path=chromium, args=software_gl)
        page = browser.new_page(viewport={"width": size[0], "height": size[1]}, color_scheme=scheme)
        page.set_default_timeout(120_000)  # drawing in software waits for the processors
        page.on("console", lambda m: messages.append(m.text) if m.type == "error" else None)
        page.on("pageerror", lambda error: messages.append(str(error)))
        page.on("request", lambda request: requests.append(request.url))
        page.goto(path.as_uri())
        for place in page.query_selector_all("[data-figure]"):
            place.scroll_into_view_if_needed()
            page.wait_for_function("place => place.dataset.drawn && place.querySelector('.main-svg')", arg=place)
        page.wait_for_timeout(500)
        width = page.evaluate("document.documentElement.scrollWidth")
        kind = page.evaluate(THETA_AXIS)
        page.click("[data-scale]")
        linear = page.evaluate(THETA_AXIS)
        stuck = page.evaluate(STUCK)
        ground = page.evaluate("getComputedStyle(document.body).backgroundColor")
        browser.close()
    assert messages == []
    assert [url for url in requests if not url.startswith(("data:", "blob:", path.as_uri()))] == []
    assert width <= size[0]  # nothing sticks out to the side
    assert stuck == []  # the keyboard scrolls what scrolls, and screen readers tell what it is
    assert (kind, linear) == ("log", "linear")
    assert (ground == "rgb(255, 255, 255)") == (scheme == "light")


STUCK = """() => [...document.querySelectorAll("main *")]
    .filter(one => ["auto", "scroll"].includes(getComputedStyle(one).overflowX) && one.scrollWidth > one.clientWidth)
    .filter(one => one.tabIndex < 0 || !one.getAttribute("aria-label")).map(one => one.outerHTML.slice(0, 80))"""
INK = "document.querySelector('[data-figure=theta]').layout.font.color"
THETA_AXIS = "document.querySelector('[data-figure=theta]').layout.yaxis.type"


@pytest.mark.slow
def test_a_page_is_printed_whole_and_in_light_colours(tmp_path: Path, samples: Dataset, cut: Windows, model_dir: Path):
    api = pytest.importorskip("playwright.sync_api", reason="needs the package playwright")
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if chromium is None:
        pytest.skip("needs a Chromium browser on the path")
    path = write_report(tmp_path / "r.html", samples, cut, model_dir, pictures=pictures)
    with api.sync_playwright() as playwright:
        software_gl = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
        page = playwright.chromium.launch(executable_path=chromium, args=software_gl).new_page(color_scheme="dark")
        page.set_default_timeout(120_000)  # drawing in software waits for the processors
        page.goto(path.as_uri())
        undrawn = "document.querySelectorAll('[data-figure]:not(:has(.main-svg))').length"
        before = page.evaluate(undrawn)
        page.evaluate("dispatchEvent(new Event('beforeprint'))")
        inks = [page.evaluate(INK)]
        page.evaluate("dispatchEvent(new Event('afterprint'))")
        inks.append(page.evaluate(INK))
        page.pdf(path=tmp_path / "r.pdf")
        after = page.evaluate(undrawn)
        page.emulate_media(media="print")
        ground = page.evaluate("getComputedStyle(document.body).backgroundColor")
        height = page.evaluate("getComputedStyle(document.querySelector('.gallery')).maxHeight")
        page.context.browser.close()
    assert before > 10 and after == 0
    assert height == "none" and ground == "rgb(255, 255, 255)"
    assert inks == ["#1c2128", "#e4e8ec"]
