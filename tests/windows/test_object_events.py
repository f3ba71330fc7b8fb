"""Which events are the object's: kept with windows, in files, and through every choice of windows."""

from dataclasses import replace

import numpy as np
import pytest

from evslip import open_windows
from evslip.events.frame import OBJECT
from evslip.events.stream import Events
from evslip.utils.errors import DataError
from evslip.windows.cutting import crop, windows_of
from evslip.windows.object_events import ObjectEvents, extent_of
from evslip.windows.window_set import Windows, WindowSettings
from slip_records import slip_records, slip_windows


def known(windows: Windows) -> ObjectEvents:
    assert windows.object_events is not None
    return windows.object_events


def test_flags_are_those_of_the_record_s_events_also_in_a_file_and_of_some_windows(tmp_path) -> None:
    records = {record.name: record for record in slip_records(3)}
    windows = windows_of(list(records.values()), WindowSettings(balance=False))
    windows.save(tmp_path / "w.h5")
    for some in (windows, open_windows(tmp_path / "w.h5"), windows[::-2]):
        objects = known(some)
        for i in range(len(some)):
            inside = crop(records[some.name[i]].events, some.settings)
            own = inside.between(int(some.start_us[i]), int(some.start_us[i]) + 160_000)
            assert own.body is not None and own.count == len(some[i])
            np.testing.assert_array_equal(objects.is_object(i, own.count), own.body == OBJECT)
            assert objects.is_object(i, own.count).sum() == some.by_body[i, OBJECT]


def test_the_extent_is_where_most_events_are_the_object_s() -> None:
    """Events of the object in columns 80 to 119 of rows 100 to 139, others everywhere, more of them from row 120 on."""
    rng, n = np.random.default_rng(0), 200_000
    x, y = rng.integers(0, 200, n), rng.integers(0, 250, n)
    inside = (x >= 80) & (x < 120) & (y >= 100) & (y < 140)
    body = np.where(inside & (rng.random(n) < np.where(y < 120, 0.8, 0.2)), OBJECT, 0)
    events = Events(np.arange(n), x, y, rng.random(n) < 0.5, body.astype(np.uint8))
    settings = WindowSettings()
    objects = ObjectEvents(
        np.zeros(0, np.uint8), np.zeros(1, np.int64), extent_of(events, settings)[None], np.array([""])
    )
    expected = (x >= 80) & (x < 120) & (y >= 100) & (y < 120)
    np.testing.assert_array_equal(objects.covers(0, events, settings.width), expected)


def test_recordings_without_bodies_have_none_and_a_damaged_file_is_refused(tmp_path) -> None:
    blind = [replace(one, events=one.events.replace(body=None)) for one in slip_records(2)]
    assert windows_of(blind, WindowSettings(balance=False)).object_events is None
    windows = slip_windows(2, balance=False)
    objects = known(windows)
    short = replace(windows, object_events=replace(objects, extent=objects.extent[:, 1:]))
    short.save(tmp_path / "short.h5")
    with pytest.raises(DataError, match="extent"):
        open_windows(tmp_path / "short.h5")
