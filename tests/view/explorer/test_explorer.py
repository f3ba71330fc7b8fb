import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest
from starlette.testclient import TestClient

from evslip.config.loading import dump_config
from evslip.data import building, dataset, layout, record_file
from evslip.data.footage import Footage
from evslip.data.intervals import Interval
from evslip.data.record import Record
from evslip.events.stream import Events, empty_events
from evslip.learn.streaming.stream import Detection
from evslip.utils.errors import ConfigError, DataError
from evslip.view.explorer.app import MOST_EVENTS, Explorer, make_app
from evslip.view.explorer.labels import ABSENT, Labels
from evslip.view.explorer.sample import EVENT, LONGEST_US, Sample, pack, thinned
from evslip.view.explorer.serve import explore
from evslip.view.explorer.shelf import open_recording, open_shelf
from evslip.view.pictures.detection import MOST_POINTS
from evslip.view.report.facts import facts_of
from evslip.view.web.guard import MOST_BYTES
from evslip.view.web.pages import KINDS, files
from sample_records import CONFIG, random_events, simulated

HOST = "127.0.0.1:8899"


@pytest.fixture
def samples(tmp_path: Path) -> Path:
    root = tmp_path / "data"
    building.create(root, dump_config(CONFIG))
    for split, count in (("train", 3), ("test", 2)):
        for index in range(count):
            sample = simulated(index, split, steps=60)
            building.add(root, sample, record_file.encode(sample))
    return root


@pytest.fixture
def client(samples: Path) -> TestClient:
    return TestClient(make_app(Explorer(open_shelf(samples)), [HOST]), base_url=f"http://{HOST}")


@pytest.fixture
def labeller(tmp_path: Path) -> TestClient:
    path = tmp_path / "still.h5"
    record_file.write(
        path,
        Record(kind="recording", name="still", size=(40, 30), events=random_events(np.random.default_rng(0), 50)),
    )
    app = make_app(Explorer(open_recording(path), labels=Labels(tmp_path / "still-labels.csv")), [HOST])
    return TestClient(app, base_url=f"http://{HOST}")


def test_the_list_is_that_of_the_data_set(client: TestClient, samples: Path):
    answer = client.get("/api/items").json()
    assert answer["title"] == "data"
    assert [row[:3] for row in answer["items"]] == [
        ["train/0000000", "train", "slip"],
        ["train/0000001", "train", "hold"],
        ["train/0000002", "train", "hold"],
        ["test/0000000", "test", "slip"],
        ["test/0000001", "test", "hold"],
    ]


def test_facts_are_those_of_the_records(client: TestClient, samples: Path):
    facts = client.get("/api/facts?first=1").json()
    assert [fact["position"] for fact in facts] == [1, 2, 3, 4]
    opened = dataset.open_dataset(samples)[3]
    assert opened.params is not None
    assert opened.truth is not None
    assert facts[2]["mass_kg"] == opened.params.object.mass_kg
    held = opened.truth.theta_deg[opened.truth.held]
    assert facts[2]["turned_deg"] == pytest.approx(np.abs(held - held[0]).max())
    assert facts[2]["onset_s"] == 0.001


def test_a_damaged_record_says_so_in_the_list(client: TestClient, samples: Path):
    path = layout.sample_path(samples, "train", 1)
    path.write_bytes(path.read_bytes()[:1000])
    facts = client.get("/api/facts?first=0").json()
    assert "0000001.h5" in facts[1]["doubt"]
    assert "mass_kg" in facts[0] and "mass_kg" not in facts[1]
    answer = client.get("/api/samples/1")
    assert answer.status_code == 422
    assert "0000001.h5" in answer.text
    assert client.get("/api/samples/0").status_code == 200


def test_a_frame_arrives_as_it_is():
    images = np.random.default_rng(0).integers(0, 256, (2, 3, 4, 3), np.uint8)
    footage = Footage(np.array([0, 1000]), images)
    shown = Sample(Record(kind="recording", name="r", size=(4, 3), events=empty_events(), footage=footage))
    np.testing.assert_array_equal(shown.pixels(0), np.dstack([images[0], np.full((3, 4), 255, np.uint8)]))


@pytest.mark.parametrize("most", [0, 7, 1000])
def test_events_arrive_as_they_are(client: TestClient, samples: Path, most: int):
    answer = client.get(f"/api/samples/0/events?start_us=10000&end_us=40000&most={most}")
    expected = dataset.open_dataset(samples)[0].events.between(10_000, 40_000)
    assert int(answer.headers["x-events"]) == expected.count > 10
    packed = np.frombuffer(answer.content, EVENT)
    assert len(packed) == min(most, expected.count)
    shown = thinned(expected, most)
    np.testing.assert_array_equal(packed["t_us"] + 10_000, shown.t_us)
    np.testing.assert_array_equal(packed["x"], shown.x)
    np.testing.assert_array_equal(packed["flags"] & 1, shown.p)
    assert shown.body is not None
    assert shown.cause is not None
    np.testing.assert_array_equal((packed["flags"] >> 1) & 7, np.minimum(shown.body, 7))
    np.testing.assert_array_equal(packed["flags"] >> 4, shown.cause)


def test_events_without_labels_are_of_an_unknown_body():
    assert set(pack(random_events(np.random.default_rng(0), 9, labelled=False), 0)["flags"] >> 1) == {7}
    assert len(pack(empty_events(), 0)) == 0


def test_a_span_of_hours_is_cut():
    hours = Events(np.array([0, 10**10]), np.zeros(2, np.uint16), np.zeros(2, np.uint16), np.ones(2, bool))
    sample = Sample(Record(kind="recording", name="r", size=(4, 3), events=hours))
    packed, count = sample.packed(0, 2**40, 10)
    assert (len(packed), count) == (1, 1)
    assert int(packed["t_us"].max()) < LONGEST_US


def test_about_holds_what_the_page_draws(client: TestClient):
    about = client.get("/api/samples/0").json()
    assert (about["width"], about["height"], about["frames"]) == (40, 30, True)
    assert about["slips"] == [[1000, 3000, "mixed"]]
    assert [curve["name"] for curve in about["curves"]] == ["turned", "slid", "pad force", "friction", "events"]
    for curve in about["curves"]:
        assert {len(line) for line in curve["lines"].values()} == {len(curve["t_us"])}
    rate = about["curves"][-1]
    seconds = (about["end_us"] - about["start_us"]) / 1e6
    total = sum(sum(line) for line in rate["lines"].values()) * 1e3 * seconds / len(rate["t_us"])
    assert total == pytest.approx(200, rel=0.01)  # all events lie within the span


def test_the_page_gets_as_many_answers_as_it_can_draw(samples: Path, monkeypatch: pytest.MonkeyPatch):
    count = 7 * MOST_POINTS
    p_slip = np.zeros(count, np.float32)
    p_slip[123_456] = 0.9
    many = Detection(np.arange(count) * 10_000, p_slip, np.ones(count, np.int64), 0.5)
    monkeypatch.setattr("evslip.learn.detect", lambda *_: many)
    app = make_app(Explorer(open_shelf(samples), Path("default")), [HOST])
    found = TestClient(app, base_url=f"http://{HOST}").get("/api/samples/0/detection").json()
    assert len(found["t_us"]) == len(found["p_slip"]) == MOST_POINTS and max(found["p_slip"]) == 0.9


def test_of_a_detector_of_another_sensor_the_page_names_a_command_that_helps(samples: Path):
    """These pages have no option that aligns the two."""
    app = make_app(Explorer(open_shelf(samples), Path("default")), [HOST])
    answer = TestClient(app, base_url=f"http://{HOST}").get("/api/samples/0/detection")
    assert answer.status_code == 422
    assert "the sensor has 40 x 30 pixels" in answer.text and "`evslip detect --align centre`" in answer.text
    assert "option" not in answer.text


def test_a_recording_has_no_frames(labeller: TestClient):
    about = labeller.get("/api/samples/0").json()
    assert not about["frames"]
    assert about["phases"] == []
    answer = labeller.get("/api/samples/0/frame?t_us=5")
    assert answer.status_code == 422
    assert "neither poses" in answer.text
    assert labeller.get("/api/facts?first=0").json() == []


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:8899", "127.0.0.1", "127.0.0.1:80", "", "127.0.0.1:8899.evil.example"]
)
def test_foreign_hosts_are_refused(client: TestClient, host: str):
    for path in ("/", "/api/items", "/api/samples/0"):
        assert client.get(path, headers={"host": host}).status_code == 403


@pytest.mark.parametrize(
    "path",
    [
        "/static/../app.py",
        "/static/%2e%2e/app.py",
        "/static/..%2fapp.py",
        "/static/app.py",
        "/static/index.html",
        "/static/",
        "/etc/passwd",
        "//etc/passwd",
        "/api/samples/5",
        "/api/samples/-1",
        "/api/samples/../../etc",
        "/api/samples/99999999999999999999",
        "/api/samples/0/../../x",
        "/api/samples/a",
        "/sample/x",
        "/api/labels",
        "/api/samples/0/detection",
    ],
)
def test_what_is_not_there_is_not_found(client: TestClient, path: str):
    assert client.get(path).status_code == 404


@pytest.mark.parametrize(
    "query",
    [
        "",
        "start_us=0",
        "start_us=0&end_us=x&most=3",
        "start_us=0&end_us=1&most=-1",
        f"start_us=0&end_us=1&most={MOST_EVENTS + 1}",
        "start_us=1e3&end_us=1&most=1",
        "start_us=٣&end_us=1&most=1",
        "start_us=99999999999999999999&end_us=1&most=1",
    ],
)
def test_malformed_queries_are_refused(client: TestClient, query: str):
    answer = client.get(f"/api/samples/0/events?{query}")
    assert answer.status_code == 400
    assert "expected" in answer.text


def test_large_and_wrong_requests_are_refused(client: TestClient, labeller: TestClient):
    assert client.get("/api/items?" + "x" * 2000).status_code == 414
    for method in ("POST", "DELETE", "OPTIONS", "TRACE"):
        assert client.request(method, "/api/items").status_code == 405
    large = b"[" + b" " * MOST_BYTES + b"]"
    json_type = {"content-type": "application/json"}
    assert labeller.put("/api/labels", content=large, headers=json_type).status_code == 413
    assert labeller.put("/api/labels", content=b"[]", headers={"content-type": "text/plain"}).status_code == 415
    from_elsewhere = json_type | {"origin": "http://evil.example"}
    assert labeller.put("/api/labels", content=b"[]", headers=from_elsewhere).status_code == 403
    for text in (b"", b"{", b"[" * 100_000, b"\xff"):
        assert labeller.put("/api/labels", content=text, headers=json_type).status_code == 400
    assert labeller.get("/api/labels").json()["intervals"] == []


def test_answers_may_not_be_embedded_or_load_from_elsewhere(client: TestClient):
    for path in ("/", "/sample/0", "/api/items", "/static/style.css", "/nothing"):
        headers = client.get(path).headers
        assert "default-src 'self'" in headers["content-security-policy"]
        assert headers["x-content-type-options"] == "nosniff"
        assert "access-control-allow-origin" not in headers


def test_pages_load_only_what_is_given_out(client: TestClient):
    import re

    names = set()
    for page in ("/", "/sample/0"):
        names |= set(re.findall(r'(?:src|href)="/static/([^"]+)"', client.get(page).text))
    static = files(*KINDS)
    for name in static:
        names |= set(re.findall(r'from "\./([^"]+)"', client.get(f"/static/{name}").text))
    assert names <= set(static)
    for name in static:
        assert client.get(f"/static/{name}").headers["content-type"].startswith(KINDS[name.rpartition(".")[2]])


def test_labels_are_on_disk_when_the_answer_comes(labeller: TestClient, tmp_path: Path):
    intervals = [[0.03, 0.04, "hold"], [0.01, 0.02, "slip"]]
    known = labeller.get("/api/labels").json()
    answer = labeller.put("/api/labels", json=known | {"intervals": intervals})
    after = labeller.get("/api/labels").json()
    assert answer.json() == {"file": "still-labels.csv", "version": after["version"]}
    assert after["intervals"] == sorted(intervals)
    lines = (tmp_path / "still-labels.csv").read_text().splitlines()
    assert lines == ["start_s,end_s,label", "0.010000,0.020000,slip", "0.030000,0.040000,hold"]
    refused = labeller.put("/api/labels", json=after | {"intervals": [[0.3, 0.2, "slip"]]})
    assert refused.status_code == 422
    for outdated in (known, {"recording": known["recording"]}):
        refused = labeller.put("/api/labels", json=outdated | {"intervals": []})
        assert refused.status_code == 409
        assert "changed elsewhere" in refused.text and "load the page anew" in refused.text
    assert (tmp_path / "still-labels.csv").read_text().splitlines() == lines


def test_a_page_of_another_recording_saves_nothing(labeller: TestClient, tmp_path: Path):
    """A tab that was left open, while the server at its address was started anew."""
    open_now = labeller.get("/api/labels").json()["recording"]
    others = {}
    for name, out in (("still.h5", "other.csv"), ("other.h5", "still-labels.csv")):
        record_file.write(
            tmp_path / name,
            Record(kind="recording", name="still", size=(40, 30), events=random_events(np.random.default_rng(0), 50)),
        )
        app = make_app(Explorer(open_recording(tmp_path / name), labels=Labels(tmp_path / out)), [HOST])
        others[out] = TestClient(app, base_url=f"http://{HOST}")
    for left_over in ({"recording": open_now, "intervals": []}, {"intervals": []}, [], "x", 3):
        for out, other in others.items():
            refused = other.put("/api/labels", json=left_over)
            assert refused.status_code == 409
            assert f"{out}; nothing was saved, load the page anew" in refused.text
    assert not list(tmp_path.glob("*.csv"))
    again = make_app(
        Explorer(open_recording(tmp_path / "still.h5"), labels=Labels(tmp_path / "still-labels.csv")), [HOST]
    )
    same = TestClient(again, base_url=f"http://{HOST}").put(
        "/api/labels", json={"recording": open_now, "version": ABSENT, "intervals": []}
    )
    assert same.status_code == 200  # the same recording, opened again


def test_the_slips_of_another_simulators_sample_are_shown():
    """As those of evslip's own; but a person's labels go before them."""
    sample = simulated(0)
    assert sample.truth is not None
    nobody = {"kind": "recording", "split": None, "index": None, "params": None, "trajectory": None}
    foreign = dataclasses.replace(sample, **nobody)
    about = Sample(foreign).about()
    assert (about["slips"], about["onset_us"], about["phases"]) == ([[1000, 3000, "mixed"]], 1000, [])
    assert about["held"] == Sample(sample).about()["held"] != []
    labelled = Sample(dataclasses.replace(foreign, intervals=(Interval(5, 9, "slip"),))).about()
    assert labelled["slips"] == [[5, 9, "slip"]]


def test_labels_count_from_the_first_event():
    """Also where other things are known of an earlier time."""
    sample = simulated(0)
    assert sample.truth is not None
    late = dataclasses.replace(sample, events=sample.events.replace(t_us=sample.events.t_us + 1200))
    about = Sample(late).about()
    assert about["first_event_us"] == late.events.t_us[0] > about["start_us"]
    assert Sample(dataclasses.replace(late, events=empty_events())).about()["first_event_us"] == about["start_us"]


def test_a_shelf_names_what_cannot_be_opened(tmp_path: Path):
    with pytest.raises(DataError, match="no such folder"):
        open_shelf(tmp_path / "none")
    building.create(tmp_path / "empty", dump_config(CONFIG))
    with pytest.raises(DataError, match="no sample yet"):
        open_shelf(tmp_path / "empty")
    with pytest.raises(DataError, match="no such file"):
        open_recording(tmp_path / "none.h5")
    with pytest.raises(DataError, match="no format"):
        open_recording(tmp_path)


def test_a_port_in_use_is_named(samples: Path):
    import socket

    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with pytest.raises(ConfigError, match="give another one"):
            explore(open_shelf(samples), port=taken.getsockname()[1], browser=False)
    with pytest.raises(ConfigError, match="0 to 65535"):
        explore(open_shelf(samples), port=70_000, browser=False)
    with pytest.raises(DataError, match=r"model\.json: no such file"):
        explore(open_shelf(samples), port=0, model=samples / "none")


def test_a_sample_says_the_label_of_the_data_set_and_doubts_it():
    sample = simulated(0)  # it slips, and its made-up poses move
    for label, doubts in (("slip", 0), ("hold", 1), ("", 0)):
        facts = dict(Sample(sample, label).about()["facts"])
        assert facts["label"] == (label or "slip")
        assert len([name for name in facts if name == "doubt"]) == doubts


def test_facts_of_a_still_object_are_zero():
    sample = simulated(1)
    assert sample.truth is not None
    truth = sample.truth._replace(
        theta_deg=np.full(5, 0.25), position_m=np.ones((5, 3)), held=np.array([False, True, True, True, False])
    )
    facts = facts_of(dataclasses.replace(sample, truth=truth))
    assert (facts["turned_deg"], facts["slid_mm"]) == (0, 0)
    json.dumps(facts, allow_nan=False)
