"""`evslip calibrate` on recordings that tell nothing, or claim what cannot be."""

from dataclasses import replace

import numpy as np
import pytest

from evslip.codecs import write_events
from evslip.data import record_file
from evslip.data.footage import Footage
from evslip.data.record import Record
from evslip.events.stream import Events
from evslip.exchange.calibrating import calibrate_recordings
from evslip.utils.errors import EvslipError
from sample_records import random_events

SIZE = (40, 30)
EVENTS = random_events(np.random.default_rng(0), 2000, labelled=False)


@pytest.fixture
def recording(tmp_path):
    """A function that writes a recording with frames of one value, and of changed events; its path."""
    frames = Footage(np.arange(20) * 10_000, np.full((20, SIZE[1], SIZE[0]), 100, np.uint8))
    whole = Record(kind="recording", name="a", size=SIZE, events=EVENTS, footage=frames)

    def write(value: int = 100, **changed):
        path = tmp_path / "rec.h5"
        record_file.write(path, replace(whole, footage=frames._replace(images=frames.images * 0 + value), **changed))
        return path

    return write


def refused(paths, out, **options) -> str:
    with pytest.raises(EvslipError) as caught:
        calibrate_recordings(paths, out, **options)
    assert not out.exists()
    return str(caught.value)


def test_events_at_one_time_tell_nothing(recording, tmp_path):
    path = recording(events=EVENTS.replace(t_us=np.full(len(EVENTS), 5)))
    assert "at one time" in refused([path], tmp_path / "out.toml")


def test_frames_that_are_clipped_throughout_tell_nothing(recording, tmp_path):
    pytest.importorskip("cv2")
    assert "recordings: neither still pixels" in refused([recording(255)], tmp_path / "out.toml")


def test_recordings_without_frames_beside_one_with_are_left_out_by_name(recording, tmp_path):
    pytest.importorskip("cv2")
    write_events(tmp_path / "blind.h5", EVENTS, SIZE)
    found = calibrate_recordings([recording(), tmp_path / "blind.h5"], tmp_path / "out.toml")
    assert any("blind.h5 tell: fewer than 3 frames" in line for line in found.unknown)
    assert "# Fitted by evslip calibrate to rec.h5;" in (tmp_path / "out.toml").read_text()


def test_hot_pixels_are_named(tmp_path):
    seconds, hot_us = 20, np.arange(1000) * 20_000
    rng = np.random.default_rng(1)
    quiet_us = rng.integers(0, seconds * 1_000_000, 2400)  # each pixel twice
    order = np.argsort(np.concatenate([hot_us, quiet_us]), kind="stable")
    x, y = (np.concatenate([np.full(1000, at), rng.integers(0, most, 2400)]) for at, most in ((7, 40), (9, 30)))
    on = np.arange(3400) % 2 == 0
    events = Events(np.concatenate([hot_us, quiet_us]), x.astype(np.uint16), y.astype(np.uint16), on).select(order)
    write_events(tmp_path / "hot.h5", events, SIZE)
    found = calibrate_recordings([tmp_path / "hot.h5"], tmp_path / "out.toml")
    assert any("1 of hot.h5 have 29.4% of the events" in line for line in found.unknown)


def test_a_recording_counts_once(recording, tmp_path):
    path = recording()
    assert "rec.h5 is named more than once" in refused([path, tmp_path / "." / "rec.h5"], tmp_path / "out.toml")


@pytest.mark.parametrize("upsample", [0, 1, -1, 65, 10**9])
def test_steps_between_frames_have_bounds(upsample, recording, tmp_path):
    assert "upsample" in refused([recording()], tmp_path / "out.toml", upsample=upsample)


def test_a_sensor_whose_pixels_are_too_many_is_refused(tmp_path):
    path = tmp_path / "claimed.dat"
    write_events(path, EVENTS, (16384, 16384))
    assert "16384x16384 pixels" in refused([path], tmp_path / "out.toml")
