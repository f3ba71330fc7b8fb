import sys
from pathlib import Path

import numpy as np
import pytest

from evslip.data.record import Record
from evslip.events.stream import empty_events
from evslip.utils.errors import ConfigError, DataError
from evslip.view.rerun_log import write_rerun
from sample_records import random_events

rerun = pytest.importorskip("rerun", reason="needs the extra rerun")
RERUN = Path(sys.executable).with_name("rerun")


def recording(count: int) -> Record:
    events = random_events(np.random.default_rng(0), count, labelled=False)
    return Record(kind="recording", name="r", size=(40, 30), events=events)


def test_a_file_is_whole(tmp_path: Path):
    import subprocess

    write_rerun(tmp_path / "o.rrd", [recording(500)])
    checked = subprocess.run(
        [str(RERUN), "rrd", "verify", str(tmp_path / "o.rrd")], capture_output=True, text=True, check=True
    )
    assert "verified without error" in checked.stdout + checked.stderr
    printed = subprocess.run(
        [str(RERUN), "rrd", "print", "-v", str(tmp_path / "o.rrd")], capture_output=True, text=True, check=True
    )
    assert "/r/camera/events" in printed.stdout


def test_what_cannot_be_written_is_named(tmp_path: Path):
    with pytest.raises(ConfigError, match=r"\.rrd"):
        write_rerun(tmp_path / "o.txt", [recording(5)])
    nothing = Record(kind="recording", name="r", size=(40, 30), events=empty_events())
    with pytest.raises(DataError, match="neither"):
        write_rerun(tmp_path / "o.rrd", [nothing])
    assert list(tmp_path.iterdir()) == []
