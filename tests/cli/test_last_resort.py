"""How commands end that nobody lets end well: errors nobody foresaw, signals, sizes beyond all bounds."""

import os
import pickle
import re
import signal
import stat
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from evslip import cli
from evslip.codecs import known_suffixes, open_events, read_events, write_events
from evslip.codecs.facts import examine
from evslip.codecs.formats import HDF5
from evslip.config.loading import dump_config
from evslip.data import building, record_file, requested
from evslip.data.dataset import open_dataset
from evslip.data.record_file import read_recording
from evslip.events.stream import Events
from evslip.exchange.format_to_format import convert_format
from evslip.utils.errors import ConfigError, DataError, EvslipError, PlanRejected
from evslip.windows.window_set import open_windows
from sample_records import CONFIG, random_events, simulated


def test_an_error_of_our_own_takes_one_line_and_a_file_to_report(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    def broken(words: list[str]) -> None:
        raise ZeroDivisionError("of all things:\nthis")

    monkeypatch.setattr(cli, "run", broken)
    monkeypatch.setattr(sys, "argv", ["evslip", "info", "my file.h5"])
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    line = capsys.readouterr().err
    (file,) = tmp_path.iterdir()
    assert stopped.value.code == 1
    shown = str(file).encode("utf-8", "backslashreplace").decode()
    assert line.count("\n") == 1 and shown in line and "ZeroDivisionError: of all things: this" in line
    report = file.read_text()
    for words in ("command: evslip info 'my file.h5'", "numpy ", "Python 3", "Traceback", "in broken", "/issues"):
        assert words in report


def test_no_line_is_endless():
    message = str(ConfigError(f"begin {'x' * 100_000} end"))
    assert message.startswith("begin xxx") and message.endswith("xxx end") and len(message) < 1600
    copy = pickle.loads(pickle.dumps(PlanRejected("grip", "y" * 100_000)))
    assert copy.kind == "grip" and len(str(copy)) < 1600


def test_too_little_memory_is_no_error_of_our_own(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    monkeypatch.setattr(cli, "run", lambda words: np.empty(2**62, np.uint8))
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    assert stopped.value.code == 2 and "memory" in capsys.readouterr().err


def test_names_of_any_bytes_are_printed(tmp_path: Path):
    name = os.fsdecode(os.fsencode(tmp_path) + b"/\xff.csv")
    write_events(name, random_events(np.random.default_rng(0), 20, labelled=False), (40, 30))
    for verb, code in (("info", 0), ("report", 2)):
        words = [sys.executable, "-m", "evslip", verb, name, *([name] if verb == "report" else [])]
        done = subprocess.run(words, capture_output=True, text=True, check=False)
        assert done.returncode == code and "Traceback" not in done.stderr
        assert code == 0 or done.stderr.count("\n") == 1


@pytest.mark.parametrize(("sign", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_signals_end_a_command_with_one_line_and_leave_nothing(tmp_path: Path, sign: signal.Signals, code: int):
    n = 3_000_000
    t_us = np.arange(n, dtype=np.int64)
    events = Events(t_us, (t_us % 100).astype(np.uint16), (t_us % 50).astype(np.uint16), t_us % 2 > 0)
    write_events(tmp_path / "long.raw", events, (100, 50))
    words = [sys.executable, "-m", "evslip", "convert", str(tmp_path / "long.raw"), str(tmp_path / "out" / "long.csv")]
    command = subprocess.Popen(words, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
    while command.poll() is None and not (tmp_path / "out").exists():
        time.sleep(0.01)
    command.send_signal(sign)
    _, said = command.communicate(timeout=60)
    assert command.returncode == code, said
    assert said == "evslip: stopped; what was finished is kept\n"
    assert [path.name for path in tmp_path.iterdir()] == ["long.raw"]


@pytest.mark.parametrize(("sign", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_that_falls_into_a_destructor_is_not_lost(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], sign: signal.Signals, code: int
):
    class Destroyed:
        def __del__(self) -> None:
            signal.raise_signal(sign)

    def work(words: list[str]) -> None:
        thing = Destroyed()
        del thing
        time.sleep(60)

    monkeypatch.setattr(cli, "run", work)
    monkeypatch.setattr(sys, "argv", ["evslip", "info"])
    handlers = signal.getsignal(signal.SIGTERM), signal.getsignal(signal.SIGALRM), sys.unraisablehook
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    assert stopped.value.code == code
    assert capsys.readouterr().err == "evslip: stopped; what was finished is kept\n"
    assert handlers == (signal.getsignal(signal.SIGTERM), signal.getsignal(signal.SIGALRM), sys.unraisablehook)


@pytest.mark.parametrize(("sign", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_of_which_c_code_makes_an_error_ends_a_command_all_the_same(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], sign: signal.Signals, code: int
):
    def work(words: list[str]) -> None:  # as h5py's lock does where a callback is interrupted
        try:
            signal.raise_signal(sign)
        except KeyboardInterrupt as stop:
            raise SystemError("returned a result with an exception set") from stop

    monkeypatch.setattr(cli, "run", work)
    monkeypatch.setattr(sys, "argv", ["evslip", "info"])
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    assert stopped.value.code == code
    assert capsys.readouterr().err == "evslip: stopped; what was finished is kept\n"


def test_what_a_signal_leaves_half_made_goes_in_silence():
    program = """
import signal, sys
from evslip import cli

class HalfMade:
    def __init__(self):
        signal.raise_signal(signal.SIGINT)
        self.handle = 1

    def __del__(self):
        del self.handle

cli.run = lambda words: HalfMade()
sys.argv = ["evslip", "info"]
cli.main()
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (130, "evslip: stopped; what was finished is kept\n")


@pytest.mark.parametrize("suffix", known_suffixes())
def test_a_pipe_is_refused_wherever_a_file_is_due(tmp_path: Path, suffix: str):
    pipe = tmp_path / f"pipe{suffix}"
    os.mkfifo(pipe)
    write_events(tmp_path / "whole.h5", random_events(np.random.default_rng(0), 20, labelled=False), (40, 30))
    readers = [read_events, open_events, read_recording, examine]
    readers += [lambda path: convert_format(path, tmp_path / "b.csv")]
    if suffix in HDF5.suffixes:
        readers += [open_windows, record_file.read]
    if suffix in known_suffixes(writing=True):
        readers += [lambda path: convert_format(tmp_path / "whole.h5", path)]
    for reader in readers:
        with pytest.raises(
            EvslipError, match=rf"pipe\{suffix}: .*is a device, a pipe or a socket, a file was expected"
        ):
            reader(pipe)
    assert stat.S_ISFIFO(pipe.stat().st_mode)


def test_pipes_in_a_data_set_are_damage(tmp_path: Path):
    root = tmp_path / "set"
    building.create(root, dump_config(CONFIG))
    sample = simulated()
    building.add(root, sample, record_file.encode(sample))
    requested.request(root, "train", 1)
    (journal,) = (root / "journal").rglob("*.jsonl")
    for path in (root / "samples/train/000/0000000.h5", root / "plan-train.json", journal, root / "config.toml"):
        path.unlink()
        os.mkfifo(path)
        if path.name != "config.toml":
            assert any(str(path) in problem for problem in open_dataset(root).verify()) or path == journal
    with pytest.raises(DataError, match="is a device, a pipe or a socket"):
        building.require_config(root, dump_config(CONFIG))


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--count", "1000000000"), "count: 1000000000 is out of range, expected 1 to 10,000,000"),
        (("--count", "1" + "0" * 30), "count: 1000.* is out of range"),
        (("--count", "1" + "0" * 5000), "--count"),
        (("--count", "5000000"), "5,000,000 samples in one run, expected at most 1,000,000; divide them by parts"),
        (("--count", "1", "--part", "1/" + "9" * 5000), "part: '1/999.* is wrong"),
        (("--count", "1", "--workers", "1000000000"), "workers: 1000000000 is out of range"),
        (("--count", "1", "--limit-s", "nan"), "limit_s: nan is out of range"),
        (("--count", "1", "--set", "seed=" + "9" * 5000), "seed: "),
    ],
)
def test_generate_refuses_what_has_no_end_before_it_makes_a_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], words, message: str
):
    monkeypatch.setattr(sys, "argv", ["evslip", "generate", "demo", str(tmp_path / "out"), *words])
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    said = capsys.readouterr().err
    assert stopped.value.code == 2 and said.count("\n") == 1
    assert re.search(message, said) and not any(tmp_path.iterdir())
