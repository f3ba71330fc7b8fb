"""Samples that two cameras see at once."""

import numpy as np
import pytest

from evslip.config.loading import load_config
from evslip.control.episode import Episode
from evslip.data import record_file
from evslip.data.record import Record
from evslip.draws.draw import draw
from evslip.events.stream import FIELDS, Events
from evslip.generation.generate import Stopwatch, _filmed, make_record
from evslip.generation.warm_up import _held
from evslip.utils.errors import ConfigError

SMALL = {"camera.width": 48, "camera.height": 36, "render.max_motion_px": 2.0, "vibration.mount_hz": 40.0}
SHAKES = {"vibration.mount_m": 0.0002, "lens.spots": 4.0}
EQUAL = {"camera.left": {}, "camera.right": {}}


def made(**keys) -> Record:
    return make_record(draw(load_config("demo", SMALL | SHAKES | keys), 1))


@pytest.fixture(scope="module")
def record() -> Record:
    return made(**EQUAL)


def same(one: Events, other: Events) -> bool:
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in FIELDS)


def test_two_cameras_see_one_motion_each_with_chance_of_its_own(record):
    alone = made()
    assert record.trajectory is not None and alone.trajectory is not None and record.truth is not None
    for name in ("gripper_pose", "object_pose", "joints", "pad_force_n"):
        assert np.array_equal(getattr(record.trajectory, name), getattr(alone.trajectory, name))
    assert alone.truth is not None and record.truth.onset_us == alone.truth.onset_us
    assert record.trajectory.camera_displacement is None
    left, right = record.streams.values()
    moved = [left.camera_displacement, right.camera_displacement, alone.trajectory.camera_displacement]
    for k, one in enumerate(moved):
        assert one is not None and 1e-4 < one[:, :3].std() < 1e-3
        assert not np.array_equal(one, moved[k - 1])
    assert min(left.events.count, right.events.count) > 1000
    assert not same(left.events, right.events) and not same(left.events, alone.events)


def test_what_a_camera_saw_can_be_made_again_from_its_record(record, tmp_path):
    record_file.write(tmp_path / "two.h5", record)
    found = record_file.read(tmp_path / "two.h5", camera="right")
    assert found.trajectory is not None and found.truth is not None
    events, stats = _filmed(found.trajectory, found.truth.span_us, Stopwatch())
    assert same(events, found.events) and stats == found.stats


@pytest.mark.parametrize("own", [{"camera.right": {"z_m": 0.1}}, {"camera.right": {}, "vibration.mount_hz": 1.0}])
def test_a_sample_one_of_whose_cameras_goes_into_the_table_is_rejected(own):
    made_of = made(**{"camera.left": {"z_m": -0.1}, **own})
    assert made_of.rejection is not None and made_of.rejection[0] == "collision"
    assert "puts the right camera" in made_of.rejection[1]


def test_the_closed_loop_has_one_camera():
    with pytest.raises(ConfigError, match=r"camera\.left, camera\.right: the closed loop has one camera"):
        Episode(draw(load_config("hold", EQUAL), 0))


def test_compiling_ahead_looks_through_the_first_camera():
    held = _held(load_config("demo", SMALL | EQUAL))
    assert held is not None and held[0].params.seen_by == "left"
