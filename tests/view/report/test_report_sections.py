"""What the report counts, and how it shows it."""

import dataclasses
import json
import math
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

from evslip.cli import main
from evslip.cli.look import report
from evslip.config.loading import dump_config
from evslip.data import building
from evslip.data.dataset import Dataset, open_dataset
from evslip.data.record import Record
from evslip.data.record_file import encode
from evslip.events.stream import SIGNAL, Events
from evslip.learn.checkpoint import Description, save_model
from evslip.learn.evaluation.stored import plain, read_evaluation, restored
from evslip.learn.networks import build_model
from evslip.learn.scores.metrics import measured
from evslip.utils.errors import ConfigError, DataError
from evslip.view.evaluation import failures
from evslip.view.evaluation.failures import Failure, of_events, of_record, worst
from evslip.view.pictures.frame_source import FrameSource
from evslip.view.report.facts import doubt_of
from evslip.view.report.report import write_model_report, write_report
from evslip.view.report.sections.activity import Activity, activity, rates
from evslip.view.report.sections.gallery import gallery
from evslip.view.report.sections.parameters import parameters
from evslip.view.report.signature import RATE_EDGES, signature
from evslip.view.report.survey import spread, survey
from evslip.windows.window_set import WindowSettings
from sample_records import CONFIG, random_events, simulated


def recording(t_us: list[int], x: list[int], p: list[int], size: tuple[int, int] = (4, 3)) -> Record:
    events = Events(np.array(t_us, np.int64), np.array(x, np.uint16), np.zeros(len(x), np.uint16), np.array(p, bool))
    return Record(kind="recording", name="r", size=size, events=events)


def pictures(trajectory, times_us: np.ndarray) -> list[np.ndarray]:
    return [np.full((30, 40, 3), t_us % 251, np.uint8) for t_us in times_us]


@pytest.fixture
def samples(tmp_path: Path) -> Dataset:
    root = tmp_path / "data"
    building.create(root, dump_config(CONFIG))
    for split, count in (("train", 4), ("test", 2)):
        for index in range(count):
            sample = simulated(index, split, steps=60)
            building.add(root, sample, encode(sample))
    return open_dataset(root)


@pytest.mark.parametrize(
    ("label", "turned", "slid", "doubtful"),
    [
        ("slip", 5, 0, False),
        ("slip", 0, 3, False),
        ("slip", 0.9, 1.9, True),
        ("hold", 0, 0, False),
        ("hold", 0, 2, True),
    ],
)
def test_a_label_is_doubtful_where_the_movement_contradicts_it(label: str, turned: float, slid: float, doubtful: bool):
    assert bool(doubt_of(label, {"turned_deg": turned, "slid_mm": slid})) == doubtful


def test_the_survey_knows_every_sample(samples: Dataset):
    found = survey(samples)
    assert [s.name for s in found] == [record.name for record in samples]
    assert [s.events for s in found] == [record.events.count for record in samples]
    assert [s.label for s in found] == samples.labels()
    for sample, record in zip(found, samples, strict=True):
        assert record.params is not None and sample.facts["mass_kg"] == record.params.object.mass_kg


@pytest.mark.parametrize("most", [0, 1, 3, 6, 100])
def test_a_choice_of_samples_is_spread_over_both_labels(samples: Dataset, most: int):
    found = survey(samples)
    chosen = spread(found, most)
    assert len(chosen) == min(most, 6) == len({s.position for s in chosen})
    assert [s.position for s in chosen] == sorted(s.position for s in chosen)
    if most == 3:
        assert {s.label for s in chosen} == {"slip", "hold"}
    assert spread([], most) == []


def test_activity_counts_every_event_once():
    records = [simulated(index, events=500) for index in range(3)]
    records = [
        dataclasses.replace(record, truth=record.truth._replace(span_us=(0, 100_000)))  # type: ignore[union-attr]
        for record in records
    ]
    found = Activity()
    for record in records:
        found.add(record)
    events = [record.events for record in records]
    assert found.causes.sum() == found.bodies.sum() == found.all_map.sum() == 1500
    assert found.noise_map.sum() == sum(int((e.cause != SIGNAL).sum()) for e in events if e.cause is not None)
    x, y = (np.concatenate([getattr(e, axis) for e in events]) for axis in "xy")
    assert found.all_map[7, 5] == ((y == 7) & (x == 5)).sum()
    assert found.seconds == pytest.approx(0.3)
    for course, record in zip(found.courses, records, strict=True):
        # Rates times the length of a step give back the counts.
        assert course.on_per_s.sum() * 0.02 == pytest.approx(record.events.p.sum())
        assert (course.on_per_s + course.off_per_s).sum() * 0.02 == pytest.approx(500)


def test_a_steady_stream_has_its_rate_at_all_times():
    found = Activity()
    found.add(recording(list(range(0, 1_000_000, 100)), [0] * 10_000, [1, 0] * 5000))
    course = found.courses[0]
    np.testing.assert_allclose(course.on_per_s, 5000)
    np.testing.assert_allclose(course.off_per_s, 5000)
    figure = rates(found.courses)
    json.dumps(figure, allow_nan=False)
    assert [trace["name"] for trace in figure["data"] if "name" in trace] == ["unlabelled"]
    page = activity(found, 3)
    assert "1 of the 3 samples" in page and "noise-map" not in page  # nobody knows the causes


def test_a_signature_says_what_is_in_the_stream():
    # Pixel 0 fires every 10 ms, its polarity alternates; pixel 1 every 20 ms, always ON; ten pixels are silent.
    rows = [(t, 0, t // 10_000 % 2) for t in range(0, 1_000_000, 10_000)]
    rows = sorted(rows + [(t + 1, 1, 1) for t in range(0, 1_000_000, 20_000)])
    found = signature("x", [recording(*map(list, zip(*rows, strict=True)))])  # type: ignore[arg-type]
    assert found is not None and found.events == 150
    assert found.silent_share == pytest.approx(10 / 12)
    assert found.on_share == pytest.approx(100 / 150)
    assert found.turn_share == pytest.approx(99 / (99 + 49))
    assert found.interval_us == 10_000
    assert found.intervals.sum() == 148
    assert found.rate_hz == pytest.approx(150 / found.seconds / 12)
    assert found.hot_share == pytest.approx(100 / 150)
    assert found.pixels.sum() == 2  # the others are below all edges
    counted = RATE_EDGES[np.flatnonzero(found.pixels)]
    assert ((counted > 35) & (counted < 105)).all()


def test_two_equal_records_have_the_signature_of_one():
    rng = np.random.default_rng(0)
    record = Record(kind="recording", name="r", size=(40, 30), events=random_events(rng, 3000, labelled=False))
    one, two = signature("a", [record]), signature("a", [record, record])
    assert one is not None and two is not None
    for name in ("rate_hz", "on_share", "silent_share", "hot_share", "turn_share"):
        assert getattr(two, name) == pytest.approx(getattr(one, name)), name
    np.testing.assert_array_equal(two.intervals, 2 * one.intervals)


def test_a_long_record_is_seen_in_its_middle(monkeypatch):
    record = recording(list(range(0, 1000, 10)), [0] * 100, [0] * 40 + [1] * 20 + [0] * 40)
    whole = signature("r", [record])
    monkeypatch.setattr("evslip.view.report.signature.MOST_EVENTS", 20)
    part = signature("r", [record])
    assert whole is not None and (whole.events, whole.seconds) == (100, 991e-6)
    assert part is not None and (part.events, part.seconds, part.on_share) == (20, 200e-6, 1)
    assert signature("none", [recording([], [], [])]) is None


def test_the_worst_windows_are_those_farthest_from_the_truth():
    names, labels, p_slip = np.array(["a", "b", "c", "d"]), np.array([1, 1, 0, 0]), np.array([0.85, 0.2, 0.7, 0.1])
    scores = measured(labels, names, np.arange(4), np.zeros(4, bool), p_slip, 0.5, 0)
    found = worst(scores, 3)
    assert [failure.name for failure in found] == ["b", "c", "a"]
    assert [round(abs(failure.p_slip - failure.slips), 6) for failure in found] == [0.8, 0.7, 0.15]
    page = failures.failures([("m", 0.5, found)], lambda failure: None)
    assert page.index("missed") < page.index("false alarm") < page.index("right")
    assert worst(dataclasses.replace(scores, names=[])) == []
    assert failures.failures([("m", 0.5, [])], lambda failure: None) == ""


def test_the_pictures_of_a_window_show_its_events(tmp_path: Path):
    settings = WindowSettings(left=0, top=0, width=4, height=3, sensor_width=4, sensor_height=3)
    # One event just before each of the three moments, in a column of its own, and one that is shown nowhere.
    times = [1_000_000 + (2 * k + 1) * 160_000 // 6 - 100 for k in range(3)] + [1_155_000]
    record = recording(times, [0, 1, 2, 3], [1, 1, 1, 1])
    strip = of_record(FrameSource(record), 1_000_000, settings)
    assert strip.shape == (3, 3 * 4 + 2 * 3, 3)
    coloured = np.argwhere(np.ptp(strip.astype(int), axis=2) > 100).tolist()
    assert coloured == [[0, 0], [0, 7 + 1], [0, 14 + 2]]
    cut = record.events.replace(t_us=record.events.t_us - 1_000_000)
    np.testing.assert_array_equal(of_events(cut, settings), strip)
    failure = Failure("train/0000003", 1_000_000, True, 0.1)
    failures.save_pictures(tmp_path, [(failure, strip)])
    assert [path.name for path in tmp_path.iterdir()] == ["slip_train-0000003_001000ms.jpg"]
    assert str(failures.from_folder(tmp_path)(failure)).startswith("data:image/jpeg;base64,")
    assert failures.from_folder(tmp_path)(failure._replace(slips=False)) is None


def test_what_is_stored_comes_back():
    @dataclasses.dataclass(frozen=True)
    class Inner:
        late: np.ndarray
        pair: tuple[float, float] | None
        counts: dict[str, int]

    @dataclasses.dataclass(frozen=True)
    class Outer:
        name: str
        share: float
        inner: Inner | None
        parts: tuple[Inner, ...]
        curve: list[tuple[float, float]]

    inner = Inner(np.array([0.5, np.inf]), (0.1, 0.2), {"a": 1})
    outer = Outer("x", math.nan, inner, (inner, dataclasses.replace(inner, pair=None)), [(0.0, 1.0)])
    back = restored(Outer, json.loads(json.dumps(plain(outer), allow_nan=False)))
    assert math.isnan(back.share) and back.name == "x" and back.curve == [(0.0, 1.0)]
    assert back.parts[1].pair is None and back.parts[0].pair == (0.1, 0.2)
    np.testing.assert_array_equal(back.inner.late, inner.late)
    assert restored(list[int], [1]) == [1]


def test_scores_come_back_as_they_were():
    labels, p = np.array([0, 1, 1, 0]), np.array([0.2, 0.9, 0.4, 0.6])
    names, recent = np.array(["a", "a", "b", "b"]), np.zeros(4, bool)
    scores = measured(labels, names, np.arange(4), recent, p, 0.5, 20)
    assert restored(type(scores), json.loads(json.dumps(plain(scores)))) == scores


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("{", "cannot be read as JSON"),
        ('{"accuracy": 1}', "not an evaluation"),
        ('{"format": "evslip evaluation", "version": 9}', "version 9"),
        ('{"format": "evslip evaluation", "version": 1, "models": [{"model": "x"}]}', "damaged"),
        ('{"format": "evslip evaluation", "version": 1, "models": []}', "no model"),
        ('{"format": "evslip scores", "version": 1, "accuracy": 1}', "not an evaluation .*, but 'evslip scores'"),
    ],
)
def test_a_damaged_evaluation_is_named(tmp_path: Path, content: str, message: str):
    (tmp_path / "evaluation.json").write_text(content)
    with pytest.raises(DataError, match=message):
        read_evaluation(tmp_path / "evaluation.json")
    with pytest.raises(DataError, match="no such file"):
        read_evaluation(tmp_path / "none.json")


def test_recordings_have_a_report_of_their_own(tmp_path: Path, samples: Dataset):
    real = recording(list(range(0, 300_000, 30)), [k % 4 for k in range(10_000)], [1, 0, 0, 0] * 2500)
    page = write_report(tmp_path / "r.html", samples, compare=[real], pictures=pictures).read_text()
    assert "Beside real recordings" in page and "25.0%" in page
    with pytest.raises(DataError, match="holds no events"):
        write_report(tmp_path / "s.html", samples, compare=[recording([], [], [])], pictures=pictures)
    assert not (tmp_path / "s.html").exists()


def test_only_so_many_pictures_are_drawn(samples: Dataset):
    asked = []

    def counting(trajectory, times_us: np.ndarray) -> list[np.ndarray]:
        asked.extend(times_us)
        return pictures(trajectory, times_us)

    found = survey(samples)
    page = gallery(samples, found, counting, 2)
    assert len(asked) == 2 == page.count("<img")
    assert page.count("<figure") == 6 and "Pictures of 2 of the 6" in page
    assert gallery(samples, [], counting, 2) == ""


def test_shares_of_a_parameter_add_up(samples: Dataset):
    page = parameters(survey(samples))
    assert "object.mass_kg" in page and "mass / onset" in page
    for text in page.split('<script type="application/json"')[1:]:
        figure = json.loads(text[text.index(">") + 1 : text.index("</script>")])
        for trace in figure["data"]:
            assert sum(trace["y"]) == pytest.approx(1)


@pytest.fixture
def model(tmp_path: Path) -> Path:
    folder = tmp_path / "model"
    save_model(folder, build_model("mlp"), Description("mlp", 0.4, WindowSettings(), {"settings": {"lr": 0.125}}))
    (folder / "history.json").write_text(json.dumps([{"epoch": 1, "loss": 1.0}]))
    return folder


def test_a_folder_of_a_model_has_a_page(tmp_path: Path, model: Path):
    page = write_model_report(tmp_path / "report.html", model).read_text()
    assert "mlp" in page and "training-loss" in page and "0.4" in page and "0.125" in page


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("model.json", {}),
        ("model.json", {"format": "another's", "version": 1}),
        ("model.json", {"format": "evslip model", "version": 2}),
        ("model.json", {"format": "evslip model", "version": 1}),
        ("evaluation.json", {"accuracy": 0.9}),
        ("evaluation.json", {"format": "evslip evaluation", "version": 2, "models": []}),
        ("history.json", {"loss": [1, 2]}),
    ],
)
def test_what_another_program_wrote_is_refused_and_nothing_is_written(
    name: str,
    content: dict,
    samples: Dataset,
    model: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
):
    (model / name).write_text(json.dumps(content))
    for arguments in ([model], [samples.root, "--model", model]):
        monkeypatch.setattr(sys, "argv", ["evslip", "report", *map(str, arguments)])
        with pytest.raises(SystemExit) as stopped:
            main()
        lines = capsys.readouterr().err.splitlines()
        assert stopped.value.code == 2 and len(lines) == 1 and str(model / name) in lines[0]
        assert not (arguments[0] / "report.html").exists()


def test_a_data_set_of_another_version_is_refused(samples: Dataset):
    (samples.root / "config.toml").write_text("future = 1\n" + samples.config_toml)
    with pytest.raises(ConfigError, match=r"config\.toml.*future"):
        report(samples.root)
    (samples.root / "config.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(DataError, match=r"config\.toml: cannot be read"):
        report(samples.root)
    assert not (samples.root / "report.html").exists()


def test_wrong_uses_of_the_command_are_told(tmp_path: Path, samples: Dataset, model: Path):
    with pytest.raises(ConfigError, match="windows"):
        report(model, windows=tmp_path / "w.h5")
    with pytest.raises(ConfigError, match="pictures"):
        report(samples.root, pictures=-1)
    with pytest.raises(DataError, match=r"none\.aedat4"):
        report(samples.root, compare=(tmp_path / "none.aedat4",))
    with pytest.raises(DataError, match="is a file"):
        write_report(tmp_path / "r.html", samples, model_dir=model / "model.json", pictures=pictures)
    assert not (samples.root / "report.html").exists()


@pytest.mark.slow
def test_the_gallery_sorts_and_filters(tmp_path: Path, samples: Dataset):
    api = pytest.importorskip("playwright.sync_api", reason="needs the package playwright")
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if chromium is None:
        pytest.skip("needs a Chromium browser on the path")
    path = write_report(tmp_path / "r.html", samples, pictures=pictures)
    found = survey(samples)
    with api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1280, "height": 800})
        page.goto(path.as_uri())

        def names() -> list[str]:
            return page.eval_on_selector_all(".gallery figure b", "all => all.map((one) => one.textContent)")

        assert names() == [sample.name for sample in found]
        page.select_option("[name=order]", "mass")
        page.check("[name=down]")
        heaviest = sorted(found, key=lambda sample: -sample.facts["mass_kg"])
        assert names() == [sample.name for sample in heaviest]
        page.select_option("[name=label]", "slip")
        assert names() == [sample.name for sample in heaviest if sample.label == "slip"]
        page.select_option("[name=label]", "")
        page.select_option("[name=split]", "test")
        assert len(names()) == 2 and page.inner_text(".controls output") == "2 of 6"
        page.fill("[name=words]", "no such thing")
        assert names() == []
        page.fill("[name=words]", "")
        page.select_option("[name=split]", "")
        page.check("[name=doubt]")
        assert set(names()) == {sample.name for sample in found if sample.doubt}
        browser.close()
