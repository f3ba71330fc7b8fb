"""Detectors on sensors of another size than they were trained on."""

from dataclasses import replace

import numpy as np
import pytest

from evslip.events.stream import Events
from evslip.utils.errors import ConfigError, DataError
from evslip.windows.alignment import laid_on, require_sensor
from evslip.windows.cutting import crop, windows_of
from evslip.windows.window_set import WindowSettings
from slip_records import slip_records

SETTINGS = WindowSettings()


def points(*at: tuple[int, int]) -> Events:
    x, y = np.array(at, np.uint16).T
    return Events(np.arange(len(at), dtype=np.int64), x, y, np.ones(len(at), bool))


def test_the_middle_of_a_sensor_lies_in_the_middle_of_the_crop():
    for width, height in ((346, 260), (640, 480), (87, 65), (1280, 720)):
        inside = crop(points((width // 2, height // 2)), laid_on(SETTINGS, (width, height)))
        assert abs(inside.x[0] - 99.5) <= 0.5 and abs(inside.y[0] - 119.5) <= 0.5


def test_from_the_corner_pixels_keep_their_numbers():
    at = points((73, 10), (100, 100), (72, 10))
    assert np.array_equal(crop(at, laid_on(SETTINGS, (340, 250), "corner")).x, crop(at, SETTINGS).x)


def test_another_sensor_is_refused_until_somebody_says_how_it_lies():
    assert require_sensor(SETTINGS, (346, 260), None) is SETTINGS
    with pytest.raises(DataError, match=r"rec\.h5: from a sensor of 640x480 .* trained on 346x260.*centre or\s+corner"):
        require_sensor(SETTINGS, (640, 480), None, "rec.h5")
    assert require_sensor(SETTINGS, (640, 480), "centre").sensor == (640, 480)
    with pytest.raises(ConfigError, match="align: 'left' is unknown"):
        require_sensor(SETTINGS, (346, 260), "left")  # type: ignore[arg-type]


def test_windows_of_a_small_sensor_lie_in_the_middle_and_say_so():
    records = slip_records(4)
    small = [replace(r, size=(246, 200), events=_shifted(r.events, 50, 30, (246, 200))) for r in records]
    cut, whole = windows_of(small), windows_of(records)
    assert cut.settings.sensor == (246, 200) and cut.settings.left == 23 and cut.settings.top == -20
    seen = [i for i in range(len(whole)) if whole.name[i] == cut.name[i]]
    assert len(seen) == len(whole) == len(cut)
    for i in seen[:4]:
        ours, theirs = cut[i], whole[i]
        kept = (theirs.y >= 20) & (theirs.y < 220)
        assert np.array_equal(ours.x, theirs.x[kept]) and np.array_equal(ours.y, theirs.y[kept])


def test_records_of_two_sensors_make_no_windows():
    first, second = slip_records(2)
    with pytest.raises(DataError, match=r"from a sensor of 640x480 pixels, and .* from one of 346x260"):
        windows_of([first, replace(second, size=(640, 480))])


def _shifted(events: Events, dx: int, dy: int, size: tuple[int, int]) -> Events:
    x, y = events.x.astype(int) - dx, events.y.astype(int) - dy
    inside = np.flatnonzero((x >= 0) & (x < size[0]) & (y >= 0) & (y < size[1]))
    return events.select(inside).replace(x=x[inside].astype(np.uint16), y=y[inside].astype(np.uint16))
