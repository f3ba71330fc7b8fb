"""The whole examination of a detector, on records of known truth."""

import json
from dataclasses import replace

import numpy as np
import pytest
import torch

from command_line import evslip
from evslip.data.record import Record
from evslip.data.record_file import write as write_record
from evslip.learn import build_model, evaluate
from evslip.learn.checkpoint import Description, load_model, save_model
from evslip.learn.evaluation.comparison import compare
from evslip.learn.evaluation.cost import measure_cost
from evslip.learn.evaluation.evaluation import evaluate_model
from evslip.learn.evaluation.evaluation_data import EvaluationData, open_evaluation_data
from evslip.learn.evaluation.predictions import on_records
from evslip.learn.evaluation.stored import plain, read_evaluation, save_evaluation
from evslip.utils.errors import ConfigError, DataError
from evslip.view.evaluation.page import evaluation_parts, write_evaluation
from evslip.view.evaluation.tables import comparison_table
from evslip.windows.cutting import windows_of
from evslip.windows.label import Label
from evslip.windows.window_set import WindowSettings
from slip_records import slip_record, slip_records, turning


class Records(EvaluationData):
    """Records in memory."""

    def __init__(self, records: list[Record]):
        super().__init__("made up")
        object.__setattr__(self, "records", records)

    def __iter__(self):
        return iter(self.records)  # type: ignore[attr-defined]

    def __len__(self) -> int:
        return len(self.records)  # type: ignore[attr-defined]


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    """Counting events tells the made-up slips from the made-up holds."""
    folder = tmp_path_factory.mktemp("models") / "rate"
    network = build_model("event_rate")
    network.fit(windows_of([slip_record(f"a{i}", turning(700, 1700, 20.0 * (i % 2)), i) for i in range(4)]))
    settings = {"model": "event_rate", "seed": 0, "lr": 0.1}
    save_model(folder, network, Description("event_rate", 0.5, WindowSettings(), {"settings": settings}))
    return folder


@pytest.fixture(scope="module")
def found(model):
    return evaluate_model(model, Records(slip_records(6)), hop_s=0.02, resamples=100)


def test_a_perfect_detector_is_found_to_be_one(found) -> None:
    assert found.scores.auroc > 0.99
    assert found.scores.balanced_accuracy > 0.9
    low, high = found.scores.intervals["balanced_accuracy"]
    assert low <= found.scores.balanced_accuracy <= high
    assert found.allowed is not None and found.own is not None
    assert (found.allowed.slips, found.allowed.detected, found.allowed.false_alarms) == (3, 3, 0)
    assert found.allowed.holding_min > 0.1
    # The onset is where 0.1 degrees are reached, 8 ms after the events begin; then some must fill the window.
    assert (np.abs(found.allowed.latency_s) < 0.12).all()
    assert (found.allowed.slipped_deg < 2).all()


def test_scores_are_those_of_windows_cut_by_themselves(model, found) -> None:
    records = slip_records(6)
    cut = windows_of(records, WindowSettings(balance=False))
    assert evaluate(model, cut).confusion == found.scores.confusion
    steps: list[int] = []
    data = EvaluationData("cut", windows=cut)
    same = evaluate_model(model, data, resamples=0, progress=steps.append)
    assert sum(steps) == data.steps == len(cut)
    assert same.scores.confusion == found.scores.confusion
    assert same.own is None and any("need records" in note for note in same.notes)
    assert same.scores.probabilities == pytest.approx(found.scores.probabilities, abs=1e-6)


def test_every_window_is_in_a_group_and_the_zone_between_is_counted(found) -> None:
    slow = evaluate_model(found.model, Records([slip_record("slow", turning(600, 1900, 4.0))]), resamples=0)
    turning_groups = next(g for g in slow.groupings if g.name == "turning_deg_s").groups
    assert sum(group.between for group in turning_groups) > 5
    assert all(np.isnan(group.accuracy) for group in turning_groups if group.windows == group.between)


def test_cost_is_measured_and_spiking_networks_count_their_operations(model) -> None:
    network, _ = load_model(model)
    cut = windows_of(slip_records(2), WindowSettings())
    windows = [cut[i] for i in range(4)]
    cost = measure_cost(network, windows)
    assert cost.windows == 4 and 0 < cost.prepare_ms < cost.median_ms <= cost.p95_ms
    assert cost.synaptic_operations is None
    network.synaptic_operations = lambda batch: np.full(len(batch), 7.0)  # type: ignore[method-assign]
    assert measure_cost(network, windows).synaptic_operations == 7


def test_models_that_differ_in_the_seed_alone_are_one_row(found) -> None:
    others = [
        replace(found, settings={**found.settings, "seed": 1}, scores=replace(found.scores, accuracy=0.5)),
        replace(found, settings={**found.settings, "lr": 0.2}, model="models/other"),
    ]
    first, second = compare([found, *others])
    assert len(first.models) == 2 and second.models == ["models/other"]
    accuracy = [found.scores.accuracy, 0.5]
    assert first.cells["accuracy"].mean == pytest.approx(np.mean(accuracy))
    assert first.cells["accuracy"].spread == pytest.approx(np.std(accuracy, ddof=1))
    assert second.cells["accuracy"].interval == found.scores.intervals["accuracy"]


def test_models_of_other_training_data_are_rows_of_their_own_under_names_of_their_own(model, found, tmp_path) -> None:
    network, description = load_model(model)
    facts = description.training | {"windows": {"training": 16, "validation": 4}}
    other_seed, narrow = facts["settings"] | {"seed": 1}, replace(WindowSettings(), slip_deg=2.0)
    trained = {
        "a-0": (WindowSettings(), facts),
        "a-1": (WindowSettings(), facts | {"windows": {"training": 15, "validation": 5}, "settings": other_seed}),
        "more": (WindowSettings(), facts | {"windows": {"training": 160, "validation": 40}}),
        "narrow": (narrow, facts),
        "x/m": (WindowSettings(), facts | {"data": "0x1", "slips": {"training": 8, "validation": 2}}),
        "y/m": (WindowSettings(), facts | {"data": "0x2", "slips": {"training": 8, "validation": 2}}),
    }
    evaluations = []
    for name, (windows, said) in trained.items():
        save_model(tmp_path / name, network, Description("event_rate", 0.5, windows, said))
        evaluations.append(evaluate_model(tmp_path / name, Records(slip_records(2)), hop_s=0.08, resamples=0))
    rows = compare(evaluations)
    assert [len(row.models) for row in rows] == [2, 1, 1, 1, 1]
    assert len({row.name for row in rows}) == len(rows)
    save_evaluation(tmp_path / "evaluation.json", evaluations)
    assert [row.models for row in compare(read_evaluation(tmp_path / "evaluation.json"))] == [r.models for r in rows]


def test_the_error_of_calibration_at_the_true_share_knows_the_share_in_training(tmp_path) -> None:
    """Of a detector that was trained on windows a third of which slip, p is left as it is on such windows."""
    network = build_model("event_rate")  # says 0.5 of all
    cut = windows_of(slip_records(6), WindowSettings(ratio=2.0))
    share = float((cut.label == Label.SLIP).mean())
    assert share == pytest.approx(1 / 3, abs=0.02)
    counts = {"training": 90, "validation": 30}
    for name, windows, facts, known in (
        ("counted", WindowSettings(), {"windows": counts, "slips": {"training": 30, "validation": 10}}, True),
        ("ratio", WindowSettings(ratio=2.0), {"windows": counts}, True),
        ("not reached", WindowSettings(ratio=2.0), {"windows": counts | {"training": 91}}, False),
        ("unbalanced", WindowSettings(balance=False), {"windows": counts}, False),
    ):
        save_model(tmp_path / name, network, Description("event_rate", 0.5, windows, facts))
        scores = evaluate(tmp_path / name, cut)
        found = evaluate_model(tmp_path / name, EvaluationData("cut", windows=cut), resamples=20)
        assert scores.ece_at_share == pytest.approx(found.scores.ece_at_share, abs=1e-6, nan_ok=True)
        assert any("nobody knows what share" in note for note in found.notes) != known
        if known:
            assert scores.ece_at_share == pytest.approx(scores.ece, abs=0.01) and scores.ece > 0.1
        else:
            assert np.isnan(scores.ece_at_share) and found.scores.intervals["ece_at_share"] is None


def test_records_without_truth_may_come_first(model, found) -> None:
    """Windows to time a detector on are then taken from later ones."""
    events = slip_record("a", np.zeros(2400)).events
    silent = [Record(kind="recording", name=f"real-{i}", size=(346, 260), events=events) for i in range(3)]
    later = evaluate_model(model, Records([*silent, *slip_records(6)]), hop_s=0.02, resamples=0)
    assert later.scores.confusion == found.scores.confusion
    assert (later.cost.windows, later.cost.events) == (found.cost.windows, found.cost.events)


def test_windows_to_time_a_detector_on_are_those_that_would_be_cut() -> None:
    data, settings = Records(slip_records(2)), WindowSettings(hop_s=0.05, balance=False)
    cut = windows_of(data, settings)
    timed = data.some_windows(settings, most=1000)
    assert len(timed) == len(cut)
    for i, events in enumerate(timed):
        for one, other in zip(events.columns, cut[i].columns, strict=True):
            assert one.dtype == other.dtype
            np.testing.assert_array_equal(one, other)


def test_all_files_are_written_and_the_json_has_no_nan(found, tmp_path) -> None:
    write_evaluation(tmp_path, [found, found])
    stored = json.loads((tmp_path / "evaluation.json").read_text(), parse_constant=pytest.fail)
    assert stored["models"][0]["scores"]["confusion"] == found.scores.confusion
    assert stored["models"][0]["allowed"]["detection_rate"] == 1
    page = (tmp_path / "evaluation.html").read_text()
    assert "false alarms" in page and 'src="http' not in page and "Plotly" in page
    assert "false alarm a minute of holding, exact to 20 ms; a missed" in page
    for name in ("scores.png", "circumstances.png"):
        assert (tmp_path / name).read_bytes().startswith(b"\x89PNG")


def test_an_evaluation_of_windows_is_stored_and_shown(model, tmp_path) -> None:
    windows_of(slip_records(4), WindowSettings()).save(tmp_path / "w.h5")
    found = evaluate_model(model, open_evaluation_data(tmp_path / "w.h5"), resamples=20)
    save_evaluation(tmp_path / "evaluation.json", [found])
    (back,) = read_evaluation(tmp_path / "evaluation.json")
    assert back.scores == found.scores
    shown = "".join(evaluation_parts([back], lambda failure: None))
    assert "called hold" in shown and "exact to" not in shown


def test_speeds_are_scored_and_a_detector_without_them_is_not(found, tmp_path) -> None:
    torch.manual_seed(0)
    save_model(tmp_path / "net", build_model("slipnet"), Description("slipnet", 0.5, WindowSettings(), {}))
    known = evaluate_model(tmp_path / "net", Records(slip_records(2)), hop_s=0.08, resamples=0)
    assert known.rotation_speed is not None and known.rotation_speed.windows > 5
    assert known.slide_speed is not None and known.slide_speed.windows == 0
    assert found.rotation_speed is None and found.slide_speed is None
    save_evaluation(tmp_path / "evaluation.json", [known, found])
    back, other = read_evaluation(tmp_path / "evaluation.json")
    assert back.rotation_speed == known.rotation_speed and other.rotation_speed is None
    titles = [line[0] for line in comparison_table(compare([known]))]
    assert "rotation speed, median error" in titles and "slide speed, median error" not in titles
    assert "rotation speed, median error" not in [line[0] for line in comparison_table(compare([found]))]


def test_an_evaluation_from_before_the_speeds_opens(found, tmp_path) -> None:
    save_evaluation(tmp_path / "evaluation.json", [found])
    stored = json.loads((tmp_path / "evaluation.json").read_text())
    for one in stored["models"]:
        del one["rotation_speed"], one["slide_speed"], one["scores"]["ece_at_share"]
    (tmp_path / "evaluation.json").write_text(json.dumps(stored))
    (back,) = read_evaluation(tmp_path / "evaluation.json")
    assert back.rotation_speed is None and np.isnan(back.scores.ece_at_share)
    assert back.scores.confusion == found.scores.confusion


def test_what_json_does_not_know_becomes_null() -> None:
    assert plain({"a": [float("nan"), np.float32(1), np.inf], "b": np.arange(2)}) == {
        "a": [None, 1.0, None],
        "b": [0, 1],
    }


def test_a_record_without_truth_is_left_out_and_said(model) -> None:
    silent = Record(kind="recording", name="real", size=(346, 260), events=slip_record("a", np.zeros(2400)).events)
    notes = evaluate_model(model, Records([silent, *slip_records(2)]), resamples=0).notes
    assert any("1 of 3 records" in note for note in notes)
    with pytest.raises(DataError, match="no record with a truth or labels"):
        evaluate_model(model, Records([silent]), resamples=0)


def test_wrong_data_are_refused_in_one_line(model, tmp_path) -> None:
    with pytest.raises(DataError, match="no such file"):
        open_evaluation_data(tmp_path / "absent")
    with pytest.raises(DataError, match="neither a data set"):
        open_evaluation_data(tmp_path)
    (tmp_path / "text.h5").write_text("no")
    with pytest.raises(DataError, match="not an HDF5 file"):
        open_evaluation_data(tmp_path / "text.h5")
    with pytest.raises(DataError, match="has no split"):
        open_evaluation_data(tmp_path / "text.h5", "test")
    with pytest.raises(ConfigError, match="hop_s"):
        evaluate_model(model, Records(slip_records(1)), hop_s=0)
    with pytest.raises(ConfigError, match=r"^hop_s 0\.0015: no multiple of 0\.001; .* such as 0\.002$"):
        evaluate_model(model, Records(slip_records(1)), hop_s=0.0015)


@pytest.mark.slow
def test_the_command_line_evaluates_a_file_of_windows(model, tmp_path) -> None:
    windows_of(slip_records(4), WindowSettings()).save(tmp_path / "w.h5")
    done = evslip("evaluate", model, tmp_path / "w.h5", "--out", tmp_path / "out", "--resamples", 50)
    assert done.returncode == 0, done.stderr
    assert "AUROC" in done.stdout and (tmp_path / "out" / "evaluation.html").exists()
    alone = evslip("evaluate", model)
    assert alone.returncode == 2 and "expected one or more models" in alone.stderr
    missing = evslip("evaluate", model, "nothing", tmp_path / "w.h5")
    assert missing.returncode == 2 and "nothing" in missing.stderr and not missing.stdout


@pytest.mark.slow
def test_detectors_whose_labels_differ_are_not_compared_without_a_word(model, tmp_path) -> None:
    fine, records = tmp_path / "fine", tmp_path / "records"
    network, description = load_model(model)
    save_model(fine, network, replace(description, windows=replace(description.windows, slip_deg=0.5)))
    records.mkdir()
    for number, record in enumerate(slip_records(2)):
        write_record(records / f"{number}.h5", replace(record, kind="recording"))
    windows_of(slip_records(2), WindowSettings()).save(tmp_path / "w.h5")
    words = "labelled as those it was trained on, which differ"
    both = model, fine
    for models, data, is_said in ((both, "records", True), ((model,), "records", False), (both, "w.h5", False)):
        done = evslip("evaluate", *models, tmp_path / data, "--out", tmp_path / "out", "--resamples", 0)
        assert done.returncode == 0, done.stderr
        assert (words in " ".join(done.stdout.split())) == is_said
        assert (words in (tmp_path / "out" / "evaluation.html").read_text()) == is_said
    alike = "--labelled-as", fine
    done = evslip("evaluate", *both, records, "--out", tmp_path / "out", "--resamples", 0, *alike)
    assert done.returncode == 0 and words not in " ".join(done.stdout.split())
    assert f"records, labelled as for {fine}" in " ".join(done.stdout.split())
    one, other = (found.scores for found in read_evaluation(tmp_path / "out" / "evaluation.json"))
    assert one.windows == other.windows and one.confusion == other.confusion
    save_model(fine, network, replace(description, windows=replace(description.windows, length_s=0.4, label_s=0.4)))
    done = evslip("evaluate", fine, model, records, "--out", tmp_path / "out", "--resamples", 0)
    assert done.returncode == 0 and words in " ".join(done.stdout.split()), done.stderr
    done = evslip("evaluate", model, records, *alike)
    assert done.returncode == 2 and "label_s 0.4: expected 0.001 to length_s, 0.16" in done.stderr
    done = evslip("evaluate", *both, tmp_path / "w.h5", *alike)
    assert done.returncode == 2 and "labelled already" in done.stderr


def test_windows_of_records_may_be_labelled_as_those_of_another_detector(model) -> None:
    """Of a slip of 2 degrees in a second a window of .16 s has a third of a degree: hold, slip, or neither."""
    records = Records([slip_record("slow", turning(700, 1700, 2.0))])
    for slip_deg, slips in ((0.3, True), (1.0, False)):
        labels = replace(WindowSettings(), slip_deg=slip_deg)
        found = evaluate_model(model, records, resamples=0, labelled_as=labels).scores
        assert bool(found.confusion[1][0] + found.confusion[1][1]) == slips


def test_answers_begin_with_the_hold_though_their_windows_begin_before(model) -> None:
    record = slip_record("early", turning(100, 1500, 42.0))
    assert record.truth is not None
    held_us = int(record.truth.t_us[np.flatnonzero(record.truth.held)[0]])
    found = on_records(load_model(model)[0], WindowSettings(), [record], 0.02)
    since_ms = (found.end_us - held_us) / 1e3
    # Held from 100 ms on: windows of 160 ms that begin at 0, 20, 40, 60 and 80 ms.
    assert since_ms[0] == 60 and np.allclose(np.diff(since_ms), 20)
    entering = found.start_us < held_us
    assert entering.sum() == 5 and found.start_us[0] == 0
    assert np.allclose(found.rotation_deg[entering], 0.03 * since_ms[entering], atol=1e-3)
    assert not found.counted[entering].any() and found.counted[~entering].any()


def test_records_of_two_sensors_are_examined_once_they_are_aligned(model) -> None:
    small, wide = slip_records(2)
    mixed = Records([small, replace(wide, size=(500, 300))])
    with pytest.raises(DataError, match="from a sensor of 500x300 pixels"):
        evaluate_model(model, mixed, resamples=0)
    found = evaluate_model(model, mixed, resamples=0, align="corner")
    assert found.scores.confusion == evaluate_model(model, Records([small, wide]), resamples=0).scores.confusion
