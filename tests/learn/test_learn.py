import json
from dataclasses import replace

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from evslip.learn import Detector, TrainSettings, build_model, detect, evaluate, load_model, train
from evslip.learn.layers.occupancy import Binner, dense
from evslip.learn.layers.sparse_conv import sparse_conv3d
from evslip.learn.networks.network import Geometry
from evslip.learn.scores.metrics import auroc, balanced_accuracy, best_threshold
from evslip.utils.errors import ConfigError, DataError, EvslipError
from evslip.windows.cutting import windows_of
from evslip.windows.label import Label
from evslip.windows.window_set import WindowEvents, WindowSettings
from slip_records import slip_record, slip_records, turning


def random_window(seed: int, count: int, width: int = 200, height: int = 250) -> WindowEvents:
    rng = np.random.default_rng(seed)
    return WindowEvents(
        np.sort(rng.integers(0, 160_000, count)).astype(np.uint32),
        rng.integers(0, width, count).astype(np.uint8),
        rng.integers(0, height, count).astype(np.uint8),
        rng.random(count) < 0.5,
    )


@given(st.integers(0, 10**6), st.integers(0, 3000), st.sampled_from([150, 350]))
@settings(max_examples=15)
def test_binning_is_binary_occupancy_averaged_over_four_by_four(seed, count, bins):
    events = random_window(seed, count)
    full = torch.zeros(2, bins, 250, 200)
    time_bin = events.t_us.astype(np.int64) * bins // 160_000
    full[np.where(events.p, 0, 1), time_bin, events.y.astype(int), events.x.astype(int)] = 1
    expected = torch.nn.functional.avg_pool2d(full, 4, 4, padding=1)
    binner = Binner(200, 250, 160_000, bins)
    grid = dense([binner(*events.columns)], (bins, binner.rows, binner.columns))[0]
    assert grid.shape == expected.shape == (2, bins, 63, 50)
    assert (grid - expected).abs().max() < 1e-6


def test_binning_leaves_no_trace_for_the_next_window():
    binner = Binner(200, 250, 160_000, 350)
    events = random_window(1, 500)
    first = binner(*events.columns)
    binner(*random_window(2, 5000).columns)
    assert np.array_equal(binner(*events.columns).cells, first.cells)


def test_the_sparse_convolution_and_its_gradient_equal_the_dense_ones():
    torch.manual_seed(0)
    network = build_model("cnn3d")
    batch = [network.prepare(random_window(seed, count)) for seed, count in enumerate((0, 1, 700, 20_000))]
    weight, bias = network.conv1.weight, network.conv1.bias
    sparse = sparse_conv3d(batch, weight, bias, network.grid, (5, 2, 2))
    full = torch.nn.functional.conv3d(dense(batch, network.grid), weight, bias, stride=(5, 2, 2))
    assert (sparse - full).abs().max() < 1e-5
    towards = torch.randn_like(full)
    gradients = [torch.autograd.grad((out * towards).sum(), (weight, bias)) for out in (sparse, full)]
    for one, other in zip(*gradients, strict=True):
        assert torch.allclose(one, other, rtol=1e-4, atol=1e-4)


def test_time_lies_on_the_time_axis():
    """The public code reshaped where it had to permute, which scrambles time: an event must move along axis 2 alone."""
    network = build_model("cnn3d")
    for t_us in (0, 80_000, 159_999):
        one = WindowEvents(
            np.array([t_us], np.uint32), *(np.array([v], np.uint8) for v in (100, 125)), np.array([True])
        )
        where = dense([network.prepare(one)], network.grid).nonzero()
        assert where.tolist() == [[0, 0, t_us * 350 // 160_000, 126 // 4, 101 // 4]]


@pytest.mark.parametrize("name", ["cnn3d", "cnn3d_bn"])
def test_networks_give_two_logits_a_window(name):
    network = build_model(name).eval()
    batch = [network.prepare(random_window(seed, 1000)) for seed in range(3)]
    together = network(batch)
    assert together.shape == (3, 2)
    apart = torch.cat([network([one]) for one in batch])
    assert torch.allclose(together, apart, atol=1e-5)


def test_an_unknown_network_lists_the_known_ones():
    with pytest.raises(ConfigError, match="cnn3d_bn"):
        build_model("transformer")


@given(st.lists(st.tuples(st.booleans(), st.floats(0, 1)), min_size=2, max_size=30))
def test_auroc_is_the_share_of_ordered_pairs(pairs):
    labels = np.array([Label.SLIP if slip else Label.HOLD for slip, _ in pairs])
    scores = np.array([score for _, score in pairs])
    slips, holds = scores[labels == Label.SLIP], scores[labels == Label.HOLD]
    if len(slips) and len(holds):
        differences = np.sign(slips[:, None] - holds[None])
        assert auroc(labels, scores) == pytest.approx(((differences + 1) / 2).mean())
    else:
        assert np.isnan(auroc(labels, scores))


def test_the_best_threshold_separates_what_can_be_separated():
    labels = np.array([Label.HOLD, Label.HOLD, Label.SLIP, Label.SLIP])
    scores = np.array([0.1, 0.8, 0.9, 0.95])
    threshold = best_threshold(labels, scores, np.arange(4))
    assert balanced_accuracy(labels, scores >= threshold) == 1
    assert best_threshold(labels, np.array([0.1, 0.2, 0.8, 0.9]), np.arange(4)) == 0.5


def test_few_trajectories_do_not_move_the_threshold_far_and_many_do():
    rng = np.random.default_rng(0)
    labels = rng.integers(0, 2, 400)
    scores = np.clip(np.where(labels == Label.SLIP, 0.8, 0.4) + 0.15 * rng.standard_normal(400), 0, 1)
    few, many = (best_threshold(labels, scores, np.arange(400) % n) for n in (2, 400))
    assert few == 0.5
    assert 0.53 < many < 0.65


QUICK = TrainSettings(epochs=5, batch=8, patience=5, val_fraction=0.25)


@pytest.fixture(scope="module")
def windows():
    return windows_of(slip_records(12), WindowSettings())


@pytest.fixture(scope="module")
def model(windows, tmp_path_factory):
    folder = tmp_path_factory.mktemp("model")
    train(windows, folder, QUICK, quiet=True)
    return folder


def unseen():
    return windows_of([slip_record(f"test/{i}", turning(500, 1800, 12.0 * (i % 2)), seed=100 + i) for i in range(6)])


def test_a_trained_detector_recognises_unseen_trajectories(model):
    metrics = evaluate(model, unseen())
    assert metrics.balanced_accuracy > 0.9
    assert metrics.auroc > 0.95
    assert np.sum(metrics.confusion) == metrics.windows == len(metrics.probabilities)


def test_equal_seeds_give_equal_weights_and_others_do_not(windows, model, tmp_path):
    before = torch.random.get_rng_state()
    train(windows, tmp_path / "again", QUICK, quiet=True)
    assert torch.equal(torch.random.get_rng_state(), before), "the caller's random numbers have changed"
    assert (tmp_path / "again" / "model.safetensors").read_bytes() == (model / "model.safetensors").read_bytes()
    train(windows, tmp_path / "other", TrainSettings(epochs=1, batch=8, val_fraction=0.25, seed=1), quiet=True)
    assert (tmp_path / "other" / "model.safetensors").read_bytes() != (model / "model.safetensors").read_bytes()


def test_what_is_saved_says_where_it_comes_from(model):
    description = json.loads((model / "model.json").read_text())
    assert description["training"]["settings"]["batch"] == 8
    history = json.loads((model / "history.json").read_text())
    assert [row["epoch"] for row in history] == list(range(1, len(history) + 1))
    assert history[-1]["loss"] < history[0]["loss"]


def test_a_loss_that_is_not_finite_stops_with_a_clear_line(windows, tmp_path):
    with pytest.raises(DataError, match=r"loss is (nan|inf) at batch \d+ of epoch \d+"):
        train(windows, tmp_path, TrainSettings(lr=1e30, optimiser="rmsprop", batch=8, epochs=3), quiet=True)


def test_one_label_alone_cannot_be_trained_on(tmp_path):
    holds = windows_of([slip_record(f"a{i}", np.zeros(2400), seed=i) for i in range(4)], WindowSettings(balance=False))
    with pytest.raises(DataError, match="are of the label hold"):
        train(holds, tmp_path, QUICK, quiet=True)
    assert not list(tmp_path.iterdir())


def test_windows_of_another_size_are_refused(model):
    other = windows_of(slip_records(2), WindowSettings(width=100))
    with pytest.raises(DataError, match="100x250"):
        evaluate(model, other)


def test_a_damaged_model_is_one_clear_line(model, tmp_path):
    for name in ("model.safetensors", "model.json"):
        broken = tmp_path / name.replace(".", "-")
        broken.mkdir()
        for file in ("model.safetensors", "model.json"):
            data = (model / file).read_bytes()
            (broken / file).write_bytes(data[: len(data) // 2] if file == name else data)
        with pytest.raises(DataError, match=name):
            load_model(broken)
    with pytest.raises(DataError, match="no such file"):
        load_model(tmp_path / "absent")


def test_streaming_in_any_pieces_equals_the_whole(model):
    events = slip_record("a", turning(800, 1500, 10.0)).events
    whole = detect(model, events, (346, 260), hop_s=0.05)
    detector = Detector(model, hop_s=0.05)
    parts = [detector.follow(events.select(slice(i, i + 997))) for i in range(0, events.count, 997)]
    assert np.array_equal(np.concatenate([p.t_us for p in parts]), whole.t_us)
    assert np.allclose(np.concatenate([p.p_slip for p in parts]), whole.p_slip, atol=1e-5)


def test_probability_rises_when_the_object_slips(model):
    found = detect(model, slip_record("a", turning(800, 1500, 10.0)).events, (346, 260), hop_s=0.05)
    slipping = (found.t_us > 960_000) & (found.t_us < 1_500_000)
    assert found.p_slip[slipping].mean() > found.p_slip[found.t_us < 780_000].mean() + 0.5


def test_another_sensor_is_aligned_at_its_centre(model):
    events = slip_record("a", turning(800, 1500, 10.0)).events
    inside = events.select((events.x >= 13) & (events.x < 333) & (events.y >= 10) & (events.y < 250))
    small = inside.replace(x=inside.x - np.uint16(13), y=inside.y - np.uint16(10))
    same = detect(model, inside, (346, 260), hop_s=0.1)
    assert np.allclose(detect(model, small, (320, 240), align="centre", hop_s=0.1).p_slip, same.p_slip, atol=1e-5)


def test_too_short_a_recording_is_refused(model):
    events = slip_record("a", np.zeros(2400)).events.select(slice(0, 10))
    with pytest.raises(DataError, match="at least one window"):
        detect(model, events, (346, 260))


def test_the_network_fits_any_geometry():
    network = build_model("cnn3d_bn", Geometry(120, 160, 100_000)).eval()
    window = random_window(0, 500, 120, 160)
    assert network([network.prepare(window.replace(t_us=window.t_us // 2))]).shape == (1, 2)


def test_silence_is_answered_and_time_may_not_go_back(model):
    events = slip_record("a", turning(800, 1500, 10.0)).events
    detector = Detector(model, hop_s=0.05)
    detector.follow(events)
    until = int(events.t_us[-1]) + 2_000_000
    quiet = detector.follow(events.select(slice(0, 0)), until_us=until)
    assert quiet.t_us[-1] > until - 50_000
    assert (quiet.events[5:] == 0).all()
    assert len(set(quiet.p_slip[5:])) == 1
    with pytest.raises(DataError, match="time order"):
        detector.follow(events)
    far = events.select(slice(0, 1)).replace(t_us=np.array([10**15]))
    with pytest.raises(DataError, match="an hour"):
        detector.follow(far)


@pytest.mark.parametrize(
    "wrong",
    [
        {"optimiser": "sgd"},
        {"weight_decay": -1},
        {"seed": -1},
        {"epochs": 0},
        {"batch": 1},
        {"lr": 0},
        {"val_fraction": 1},
    ],
)
def test_impossible_training_settings_are_refused(wrong):
    with pytest.raises(ConfigError, match=next(iter(wrong))):
        TrainSettings(**wrong)


def test_a_crop_too_small_for_the_network_is_refused():
    with pytest.raises(ConfigError, match="too small"):
        build_model("cnn3d", Geometry(40, 40, 160_000))


def test_training_into_a_file_is_refused(windows, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(EvslipError, match="cannot write"):
        train(windows, tmp_path / "file", QUICK, quiet=True)


def test_push_gives_the_newest_probability(model):
    events = slip_record("a", turning(800, 1500, 10.0)).events
    detector, follower = Detector(model, hop_s=0.05), Detector(model, hop_s=0.05)
    assert np.isnan(detector.push(events.between(0, 100_000)))
    follower.follow(events.between(0, 100_000))
    rest = events.between(100_000, 3_000_000)
    assert detector.push(rest) == pytest.approx(follower.follow(rest).p_slip[-1])
    assert detector.push(rest.select(slice(0, 0))) == detector.push(rest.select(slice(0, 0)))


def test_another_sensor_is_refused_unless_somebody_says_how_it_lies(model):
    events = slip_record("a", turning(800, 1500, 10.0)).events
    with pytest.raises(DataError, match=r"sensor of 640x480 pixels.* trained on 346x260"):
        detect(model, events, (640, 480))
    same = detect(model, events, (346, 260), hop_s=0.1)
    assert np.array_equal(detect(model, events, (500, 300), align="corner", hop_s=0.1).p_slip, same.p_slip)
    other = windows_of([replace(record, size=(640, 480)) for record in slip_records(2)])
    with pytest.raises(DataError, match="the windows: from a sensor of 640x480"):
        evaluate(model, other)
    assert evaluate(model, other, align="centre").windows == len(other)
