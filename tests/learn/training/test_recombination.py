"""Windows put together from two: every event from one of them, none of the other where the object is."""

from dataclasses import replace

import numpy as np
import pytest

from evslip.learn import TrainSettings, train
from evslip.learn.training.recombination import Recombination
from evslip.utils.errors import ConfigError, DataError
from slip_records import slip_windows


def rows(events) -> set[tuple[int, ...]]:
    return {tuple(int(value) for value in row) for row in zip(*events.columns, strict=True)}


def test_a_window_has_its_own_object_and_the_rest_of_another() -> None:
    windows = slip_windows(6, balance=False)
    objects = windows.object_events
    assert objects is not None
    recombine, rng = Recombination(windows, 1.0), np.random.default_rng(0)
    every = [windows[i] for i in range(len(windows))]
    flags = [objects.is_object(i, len(events)) for i, events in enumerate(every)]
    others = set()
    for i in range(0, len(windows), 3):
        found = recombine(i, rng)
        assert (np.diff(found.t_us.astype(np.int64)) >= 0).all()
        own = rows(every[i][flags[i]])
        assert own <= rows(found)
        more = rows(found) - own
        sources = [j for j in range(len(windows)) if more <= rows(every[j][~flags[j]])]
        assert sources
        others.add(sources[0])
        seen = found[np.array([row not in own for row in zip(*map(np.ndarray.tolist, found.columns), strict=True)])]
        assert not objects.covers(i, seen, windows.settings.width).any()
    assert len(others) > 1


def test_no_share_and_unknown_bodies_leave_windows_as_they_are() -> None:
    windows = slip_windows(4, balance=False)
    assert all(Recombination(windows, 0.0)(i, np.random.default_rng(0)) == windows[i] for i in range(5))
    assert windows.object_events is not None
    unknown = replace(windows, object_events=replace(windows.object_events, view=np.full(len(windows), "")))
    assert all(Recombination(unknown, 1.0)(i, np.random.default_rng(0)) == windows[i] for i in range(5))
    with pytest.raises(DataError, match="recombine: the windows do not say which events"):
        Recombination(replace(windows, object_events=None), 0.5)
    with pytest.raises(ConfigError, match="recombine 2"):
        TrainSettings(recombine=2.0)


def test_a_training_that_recombines_is_deterministic(tmp_path) -> None:
    windows = slip_windows(6)
    settings = TrainSettings.of("slipnet", epochs=1, batch=8, val_fraction=0.3, recombine=0.7)
    for name in ("a", "b"):
        train(windows, tmp_path / name, settings, quiet=True)
    assert (tmp_path / "a/model.safetensors").read_bytes() == (tmp_path / "b/model.safetensors").read_bytes()
