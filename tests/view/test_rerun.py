import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from evslip.config.loading import load_config
from evslip.data.record import Record
from evslip.draws.draw import draw
from evslip.events.stream import empty_events
from evslip.physics.simulation import simulate
from evslip.physics.truth import measure
from evslip.rendering.camera import hand_camera
from evslip.utils.errors import ConfigError, DataError
from evslip.view.rerun_log import write_rerun
from sample_records import random_events

rerun = pytest.importorskip("rerun", reason="needs the extra rerun")
RERUN = Path(sys.executable).with_name("rerun")


def recording(count: int) -> Record:
    events = random_events(np.random.default_rng(0), count, labelled=False)
    return Record(kind="recording", name="r", size=(40, 30), events=events)


def test_a_file_is_whole(tmp_path: Path):
    write_rerun(tmp_path / "o.rrd", [recording(500)])
    checked = subprocess.run(
        [str(RERUN), "rrd", "verify", str(tmp_path / "o.rrd")], capture_output=True, text=True, check=True
    )
    assert "verified without error" in checked.stdout + checked.stderr
    printed = subprocess.run(
        [str(RERUN), "rrd", "print", "-v", str(tmp_path / "o.rrd")], capture_output=True, text=True, check=True
    )
    assert "/r/camera/events" in printed.stdout


def test_events_are_read_again_by_reruns_reader(tmp_path: Path):
    chunk = pytest.importorskip("rerun.chunk", reason="needs a Rerun that reads its files")
    record = recording(500)
    write_rerun(tmp_path / "o.rrd", [record])
    rows = []
    for part in chunk.RrdReader(tmp_path / "o.rrd").stream():
        batch = part.to_record_batch()
        if part.entity_path == "/r/camera/events" and "Points2D:positions" in batch.schema.names:
            columns = (batch.column(f"Points2D:{name}").to_pylist() for name in ("positions", "colors"))
            rows += [row for places, colors in zip(*columns, strict=True) for row in zip(places, colors, strict=True)]
    places, colors = (np.array(column) for column in zip(*rows, strict=True))
    assert len(rows) == record.events.count
    np.testing.assert_array_equal(places, np.stack([record.events.x, record.events.y], -1) + 0.5)
    of_on, of_off = (np.unique(colors[record.events.p == p]) for p in (True, False))
    assert len(of_on) == len(of_off) == 1 and of_on != of_off


def test_what_cannot_be_written_is_named(tmp_path: Path):
    with pytest.raises(ConfigError, match=r"\.rrd"):
        write_rerun(tmp_path / "o.txt", [recording(5)])
    nothing = Record(kind="recording", name="r", size=(40, 30), events=empty_events())
    with pytest.raises(DataError, match="neither"):
        write_rerun(tmp_path / "o.rrd", [nothing])
    assert list(tmp_path.iterdir()) == []


def test_a_trembling_camera_is_where_it_was(tmp_path: Path):
    hold = {"motion.kind": "hold", "motion.duration_s": 6.0, "camera.width": 40, "camera.height": 30}
    params = draw(load_config("simple", hold | {"vibration.mount_hz": 40.0, "vibration.mount_m": 0.001}), 0)
    trajectory = simulate(params)
    assert trajectory.camera_displacement is not None
    truth = measure(trajectory)._replace(span_us=(2_000_000, 2_060_000))
    own, at_rest = {"kind": "simulated", "name": "s", "size": (40, 30)}, hand_camera(params).position
    moved = trajectory.camera_displacement[[2000, 2020, 2040], :3]
    for traj, places in ((trajectory, at_rest + moved), (trajectory._replace(camera_displacement=None), at_rest[None])):
        record = Record(**own, events=empty_events(), params=params, trajectory=traj, truth=truth)
        write_rerun(tmp_path / "o.rrd", [record])
        printed = subprocess.run(
            [str(RERUN), "rrd", "print", "-vvv", "--entity", "/s/world/hand/camera", str(tmp_path / "o.rrd")],
            capture_output=True, text=True, check=True, env=os.environ | {"RERUN_ANALYTICS_ENABLED": "0"},
        )  # fmt: skip
        triples = re.findall(r"\[\[(-?\d+\.[\de-]+), (-?\d+\.[\de-]+), (-?\d+\.[\de-]+)\]\]", printed.stdout)
        assert np.array(triples, float) == pytest.approx(places, abs=1e-6)
        (tmp_path / "o.rrd").unlink()
