import math
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Event

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evslip.cli.recordings import label_agreement
from evslip.data.intervals import Interval, read_intervals, write_intervals
from evslip.utils.errors import DataError
from evslip.view.explorer import labels as labels_module
from evslip.view.explorer.agreement import agreement
from evslip.view.explorer.labels import ABSENT, Labels, Outdated


@st.composite
def intervals(draw: st.DrawFn) -> tuple[Interval, ...]:
    edges = sorted(draw(st.sets(st.integers(0, 10**6), min_size=2, max_size=12)))
    pairs = zip(edges[::2], edges[1::2], strict=False)
    return tuple(Interval(1000 * a, 1000 * b, draw(st.sampled_from(["slip", "hold"]))) for a, b in pairs)


@given(intervals())
def test_intervals_survive_their_file(tmp_path_factory: pytest.TempPathFactory, given_intervals: tuple[Interval, ...]):
    path = tmp_path_factory.mktemp("labels") / "l.csv"
    write_intervals(path, given_intervals)
    assert read_intervals(path) == given_intervals == Labels(path).intervals()


@pytest.mark.parametrize("rows", [[None], [[0, 1]], [[0, None, "slip"]], [[0, 1, ["slip"]]], [[{}, 1, "slip"]]])
def test_wrong_rows_are_refused(tmp_path: Path, rows: list):
    labels = Labels(tmp_path / "labels.csv")
    with pytest.raises(DataError, match="interval 1"):
        labels.replace(rows, ABSENT)
    assert not labels.path.exists()


def test_a_file_that_was_changed_elsewhere_is_not_replaced(tmp_path: Path):
    """By another program on the same file, or by hand; and then the reader gets what is there now."""
    labels, other = Labels(tmp_path / "labels.csv"), Labels(tmp_path / "labels.csv")
    version = labels.replace([[0, 1, "slip"]], ABSENT)
    with pytest.raises(Outdated, match=r"labels\.csv were changed elsewhere"):
        other.replace([], ABSENT)
    assert other.as_json() == {"file": "labels.csv", "version": version, "intervals": [[0.0, 1.0, "slip"]]}
    labels.path.write_text("start_s,end_s,label\n0,2,hold\n")
    for outdated in (version, ABSENT, None, 3):
        with pytest.raises(Outdated):
            labels.replace([], outdated)
    assert labels.intervals() == (Interval(0, 2_000_000, "hold"),)
    labels.path.unlink()
    labels.replace([[0, 1, "slip"]], labels.as_json()["version"])
    assert labels.intervals() == (Interval(0, 1_000_000, "slip"),)


def test_of_two_servers_that_save_at_the_same_moment_one_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    first, second = Labels(tmp_path / "labels.csv"), Labels(tmp_path / "labels.csv")
    is_writing, may_go_on = Event(), Event()

    def slowly(path: Path, found: list[Interval]) -> None:
        is_writing.set()
        assert may_go_on.wait(30)
        write_intervals(path, found)

    monkeypatch.setattr(labels_module, "write_intervals", slowly)
    with ThreadPoolExecutor(2) as pool:
        saved = pool.submit(first.replace, [[0, 1, "slip"]], ABSENT)
        assert is_writing.wait(30)
        refused = pool.submit(second.replace, [[0, 2, "hold"]], ABSENT)
        with pytest.raises(TimeoutError):
            refused.result(0.2)
        may_go_on.set()
        assert saved.result(30) == first.as_json()["version"]
        with pytest.raises(Outdated):
            refused.result(30)
    assert first.intervals() == (Interval(0, 1_000_000, "slip"),)


@given(intervals(), intervals())
def test_agreement_is_that_of_fine_samples(a: tuple[Interval, ...], b: tuple[Interval, ...]):
    """Against a table filled by looking at the middle of each millisecond."""
    first, last = (t // 1000 for t in (min(a[0].start_us, b[0].start_us), max(a[-1].end_us, b[-1].end_us)))
    times = 1000 * np.arange(first, last) + 500

    def classes(labels: tuple[Interval, ...]) -> np.ndarray:
        found = np.full(len(times), 2)
        for start, end, kind in labels:
            found[(times > start) & (times < end)] = ("slip", "hold").index(kind)
        return found

    table = np.zeros((3, 3))
    np.add.at(table, (classes(a), classes(b)), 0.001)
    result = agreement(a, b)
    np.testing.assert_allclose(result.seconds, table, atol=1e-6)
    observed, chance = np.trace(table) / table.sum(), float(table.sum(0) @ table.sum(1)) / table.sum() ** 2
    if chance < 1 - 1e-9:
        assert result.kappa == pytest.approx((observed - chance) / (1 - chance), abs=1e-6)
    swapped = agreement(b, a)
    assert swapped.iou == pytest.approx(result.iou, nan_ok=True)


def test_agreement_of_known_labels():
    a = [Interval(0, 1_000_000, "slip"), Interval(1_000_000, 2_000_000, "hold")]
    same = agreement(a, a)
    assert (same.kappa, same.iou) == (1.0, {"slip": 1.0, "hold": 1.0})
    other = agreement(a, [Interval(0, 500_000, "slip"), Interval(500_000, 2_000_000, "hold")])
    assert other.iou == {"slip": 0.5, "hold": pytest.approx(2 / 3)}
    assert other.kappa == pytest.approx(0.5)
    alone = agreement([Interval(0, 1_000_000, "slip")], [Interval(0, 1_000_000, "slip")])
    assert math.isnan(alone.kappa)
    assert math.isnan(alone.iou["hold"])
    assert "kappa" in other.table()


def test_a_file_without_labels_is_named(tmp_path: Path):
    (tmp_path / "a.csv").write_text("start_s,end_s,label\n0,1,slip\n")
    (tmp_path / "b.csv").write_text("start_s,end_s,label\n")
    with pytest.raises(DataError, match=r"b\.csv: holds no interval"):
        label_agreement(tmp_path / "a.csv", tmp_path / "b.csv")
