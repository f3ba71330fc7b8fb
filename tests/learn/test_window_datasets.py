"""Windows in PyTorch's DataLoader, with workers; and networks on a crop as large as the sensor."""

from pathlib import Path

import numpy as np
import pytest
import torch
from torch.utils.data import DataLoader, Dataset, IterableDataset

import evslip
from evslip.learn import Detector, TrainSettings, WindowDataset, WindowStream, train
from evslip.learn.layers.grids import counts_in
from evslip.windows.cutting import windows_of
from evslip.windows.window_events import WindowEvents
from slip_records import SIZE, slip_record, slip_records, slip_windows, turning


@pytest.fixture(scope="module")
def path(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("windows") / "train.h5"
    slip_windows().save(path)
    return path


def number_of(events: WindowEvents) -> int:
    return len(events)


def first_row(events: WindowEvents) -> np.ndarray:
    return np.bincount(events.x, minlength=200)


def test_the_items_are_counts_and_labels(path):
    windows = evslip.open_windows(path)
    dataset = WindowDataset(windows)
    assert isinstance(dataset, Dataset) and len(dataset) == len(windows)
    grid, label = dataset[3]
    assert label == windows.label[3] and grid.dtype == torch.float32
    np.testing.assert_array_equal(grid.numpy(), counts_in(windows[3], (200, 250), 160_000, range(5), 4))


@pytest.mark.parametrize("start", ["fork", pytest.param("spawn", marks=pytest.mark.slow)])
def test_workers_give_what_one_process_gives(path, start):
    windows = evslip.open_windows(path)
    dataset = WindowDataset(windows, first_row)
    alone = list(DataLoader(dataset, batch_size=8))
    loader = DataLoader(dataset, batch_size=8, num_workers=2, multiprocessing_context=start)
    for (mine, labels), (theirs, their_labels) in zip(alone, loader, strict=True):
        assert torch.equal(mine, theirs) and torch.equal(labels, their_labels)


@pytest.mark.parametrize("workers", [0, 2])
def test_a_stream_gives_each_window_once(path, workers):
    windows = evslip.open_windows(path)
    stream = WindowStream(windows, number_of, shuffle=True, seed=3)
    assert isinstance(stream, IterableDataset)
    epochs = []
    for epoch in (0, 0, 1):
        stream.set_epoch(epoch)
        numbers = torch.cat([numbers for numbers, _ in DataLoader(stream, batch_size=7, num_workers=workers)])
        epochs.append(numbers.tolist())
        assert sorted(numbers.tolist()) == sorted(windows.events.tolist())
    assert epochs[0] == epochs[1] != epochs[2]
    in_order = [int(number) for number, _ in DataLoader(WindowStream(windows, number_of), batch_size=None)]
    assert in_order == windows.events.tolist()


@pytest.mark.parametrize("model", ["countnet", "snn", "cnn3d", "mlp", "flow", "evgru"])
def test_a_detector_learns_from_the_whole_sensor(model, tmp_path):
    windows = windows_of(slip_records(8), whole_sensor=True)
    windows.save(tmp_path / "wide.h5")
    settings = TrainSettings(model=model, epochs=1, batch=16, flip=True, shift_px=100, noise_hz=0.5)
    train(evslip.open_windows(tmp_path / "wide.h5"), tmp_path / "model", settings, quiet=True)
    detector = Detector(tmp_path / "model", size=SIZE, hop_s=0.05)
    found = detector.follow(slip_record("new", turning(600, 1400, 12.0), seed=9).events)
    assert len(found.p_slip) > 30 and np.isfinite(found.p_slip).all()
    events = slip_record("new", turning(600, 1400, 12.0), seed=9).events
    assert found.events[3] == events.between(int(found.t_us[3]) - 160_000, int(found.t_us[3])).count
