import collections
import dataclasses
import json
import os
import shutil
import signal
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

from evslip.config.loading import dump_config, load_config
from evslip.data import building, dataset, journal, layout, requested
from evslip.data.dataset import open_dataset
from evslip.data.record import Record
from evslip.data.record_file import encode
from evslip.data.recordings import open_samples
from evslip.events.stream import empty_events
from evslip.utils import atomic
from evslip.utils.errors import ConfigError, DataError, StorageError
from sample_records import CONFIG, assert_equal, simulated

TOML = dump_config(CONFIG)


def add(root: Path, sample: Record) -> journal.Entry:
    return building.add(root, sample, encode(sample))


def rejected(index: int) -> Record:
    reason = ("tipped", "the object tipped over at 1.2 s")
    parts = {"kind": "rejected", "trajectory": None, "truth": None, "events": empty_events(), "rejection": reason}
    return dataclasses.replace(simulated(index), **parts)


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """A data set of five samples for training, one of them rejected, and two for test; six and two were asked for."""
    root = tmp_path / "data"
    building.create(root, TOML)
    requested.request(root, "train", 6)
    requested.request(root, "test", 2)
    for index in (3, 0, 1, 4):
        add(root, simulated(index))
    add(root, rejected(2))
    for index in (0, 1):
        add(root, simulated(index, "test"))
    return root


def test_a_split_may_be_a_link_to_another_disk(root: Path, tmp_path: Path):
    before = open_dataset(root).verify()
    shutil.move(root / "samples" / "train", tmp_path / "train")
    (root / "samples" / "train").symlink_to(tmp_path / "train")
    assert open_dataset(root).verify() == open_dataset(root).split("train").verify() == before == []
    (tmp_path / "train" / "stray").touch()
    assert len(open_dataset(root).verify()) == 1


def test_a_slice_is_the_same_samples_of_fewer(root: Path):
    samples = open_dataset(root)
    some = samples[1:3]
    assert len(some) == 2 and len(samples[:0]) == 0 and len(samples) == 6
    assert [one.name for one in samples[::-2]] == [one.name for one in samples][::-2]
    assert_equal(some[0], samples[np.int64(1)])


def test_records_come_back_in_order(root: Path):
    data = open_dataset(root)
    assert [r.name for r in data] == [f"train/000000{i}" for i in (0, 1, 3, 4)] + ["test/0000000", "test/0000001"]
    assert len(data) == 6
    assert_equal(data[2], simulated(3))
    assert_equal(data[-1], simulated(1, "test"))
    assert data.read(0, events=False).events.count == 0
    assert data.labels() == ["slip", "hold", "slip", "hold", "slip", "hold"]
    assert data.config == CONFIG
    with pytest.raises(IndexError):
        data[6]


def test_a_split_is_a_data_set_of_its_own(root: Path):
    test = open_dataset(root).split("test")
    assert [r.split for r in test] == ["test", "test"]
    assert test.status()["requested"] == 2
    with pytest.raises(DataError, match="expected one of train, test"):
        open_dataset(root).split("validation")


def test_rejections_say_why(root: Path):
    (entry,) = open_dataset(root).rejections
    assert (entry["index"], entry.get("rejection")) == (2, ["tipped", "the object tipped over at 1.2 s"])


def test_status_counts(root: Path):
    status = open_dataset(root).status()
    files = list((root / "samples").rglob("*.h5"))
    assert status == {
        "requested": 8,
        "done": 7,
        "missing": 1,
        "rejected": 1,
        "slip": 3,
        "hold": 3,
        "events": 6 * 200,
        "bytes": sum(file.stat().st_size for file in files),
    }
    assert len(files) == 7


def test_without_a_plan_what_is_done_was_requested(root: Path):
    for file in root.glob("plan-*.json"):
        file.unlink()
    status = open_dataset(root).status()
    assert (status["requested"], status["missing"]) == (7, 0)


def test_a_smaller_plan_changes_nothing(root: Path):
    requested.request(root, "train", 1)
    assert open_dataset(root).status()["requested"] == 8


def test_of_two_requests_at_the_same_time_the_larger_stays(root: Path, monkeypatch: pytest.MonkeyPatch):
    sum_of = requested.sha256_of
    larger = threading.Thread(target=requested.request, args=(root, "train", 20))

    def while_the_smaller_is_made(path: Path) -> str | None:
        if larger.ident is None:
            larger.start()
            larger.join(0.1)
        return sum_of(path)

    monkeypatch.setattr(requested, "sha256_of", while_the_smaller_is_made)
    requested.request(root, "train", 10)
    larger.join()
    assert requested.requested_count(root, "train") == 20
    assert open_dataset(root).verify() == []


def test_an_undamaged_data_set_verifies(root: Path):
    seen = []
    assert open_dataset(root).verify(lambda done, of: seen.append((done, of))) == []
    assert seen == [(i, 7) for i in range(1, 8)]


@pytest.mark.slow
def test_a_flipped_bit_in_any_byte_is_found(root: Path):
    shutil.rmtree(root / "samples")
    shutil.rmtree(root / "journal")
    add(root, dataclasses.replace(simulated(0, events=1, steps=1), provenance={}, stats={}))
    data, path = open_dataset(root), layout.sample_path(root, "train", 0)
    whole = path.read_bytes()
    assert data.verify() == []
    with path.open("r+b", buffering=0) as file:
        for position in range(len(whole)):
            bit = position * 5 % 8
            os.pwrite(file.fileno(), bytes([whole[position] ^ 1 << bit]), position)
            assert len(data.verify()) == 1, f"bit {bit} of byte {position}"
            os.pwrite(file.fileno(), whole[position : position + 1], position)
    assert data.verify() == []


def test_flipped_bits_in_records_are_found(root: Path):
    data, rng = open_dataset(root), np.random.default_rng(0)
    for path in sorted((root / "samples").rglob("*.h5")):
        whole = path.read_bytes()
        for position in rng.integers(0, len(whole), 20):
            flipped = bytearray(whole)
            flipped[position] ^= 1 << int(rng.integers(8))
            path.write_bytes(flipped)
            assert data.verify() == [f"{path}: damaged, its sha256 is not the one it was written with"]
        path.write_bytes(whole)
    assert data.verify() == []


def test_every_flipped_bit_in_a_journal_is_found(root: Path):
    (path,) = (root / "journal").rglob("*.jsonl")
    whole = path.read_bytes()
    first = whole.index(b"\n") + 1
    # The first line and the end of the last one, where a flip may look like a line torn by a kill.
    for position in [*range(first), *range(len(whole) - 3, len(whole))]:
        for bit in range(8):
            flipped = bytearray(whole)
            flipped[position] ^= 1 << bit
            path.write_bytes(flipped)
            assert open_dataset(root).verify(), f"bit {bit} of byte {position}"


def test_every_flipped_bit_in_the_configuration_and_the_plan_is_found(root: Path):
    data = open_dataset(root)
    for path in (root / "plan-train.json", root / "config.toml"):
        whole = path.read_bytes()
        for position in range(len(whole)):
            for bit in range(8) if path.suffix == ".json" else [position * 5 % 8]:
                path.write_bytes(whole[:position] + bytes([whole[position] ^ 1 << bit]) + whole[position + 1 :])
                assert any(path.name in problem for problem in data.verify()), f"bit {bit} of byte {position}"
        path.write_bytes(whole)
    assert data.verify() == []


def test_a_plan_of_the_first_versions_still_counts(root: Path):
    (root / "plan-train.json").write_text('{"count": 9}\n')
    data = open_dataset(root)
    assert data.verify() == []
    assert data.status()["requested"] == 11
    (root / "plan-train.json").unlink()
    assert data.verify() == [f"{root / 'plan-train.json'}: missing"]


def test_journals_of_the_first_versions_still_count(root: Path):
    for path in (root / "journal").rglob("*.jsonl"):
        path.rename(root / "journal" / path.name)
    for folder in [path for path in (root / "journal").iterdir() if path.is_dir()]:
        folder.rmdir()
    add(root, simulated(5))
    assert len(dataset.finished(root)) == 8
    assert open_dataset(root).verify() == []


def test_no_folder_of_a_million_samples_holds_more_than_ten_thousand_files(tmp_path: Path):
    folders = collections.Counter(layout.sample_path(tmp_path, "train", i).parent for i in range(0, 1_000_000, 50))
    assert len(folders) <= 10_000
    assert max(folders.values()) * 50 <= 10_000
    # A worker lives for 200 samples and writes one journal.
    journals = collections.Counter(journal.Journal(tmp_path).path.parent for _ in range(5000))
    assert len(journals) <= 256
    assert max(journals.values()) < 100


def test_only_the_samples_asked_for_are_looked_at(root: Path):
    assert set(dataset.finished(root, "train", range(1, 3))) == {("train", 1), ("train", 2)}


def test_a_sample_made_again_has_the_entry_of_its_file(root: Path):
    """Other content of the same size, such as by another version of a library, whatever the journals' random names."""
    path, seen = layout.sample_path(root, "train", 0), set()
    for number in range(8):
        path.unlink()
        made = dataclasses.replace(simulated(0), provenance={"evslip": f"0.1.{number + 1}"})
        building._journal.cache_clear()
        add(root, made)
        entry = dataset.finished(root, "train", [0])["train", 0]
        assert entry["sha256"] == layout.sha256_of(path)
        seen.add((entry["sha256"], entry["bytes"]))
    assert len({sha256 for sha256, _ in seen}) == 8 and len({size for _, size in seen}) == 1


def test_a_folder_of_records_in_capitals_is_read(tmp_path: Path):
    for index, name in enumerate(("A.H5", "b.h5")):
        (tmp_path / name).write_bytes(encode(simulated(index)))
    assert [one.name for one in open_samples(tmp_path).listing] == ["A", "b"]


def test_a_run_notices_that_its_folder_was_taken_away(root: Path):
    building.require_config(root, TOML)
    shutil.rmtree(root)
    with pytest.raises(DataError, match=r"config\.toml: is not there on .*expected a folder that all nodes share"):
        building.require_config(root, TOML)


def test_truncated_missing_surplus_and_temporary_files_are_found(root: Path):
    data = open_dataset(root)
    path = layout.sample_path(root, "train", 0)
    whole = path.read_bytes()
    path.write_bytes(whole[:-1])
    assert data.verify() == [f"{path}: damaged, its sha256 is not the one it was written with"]
    path.unlink()
    assert data.verify() == [f"{path}: missing"]
    path.write_bytes(whole)
    for name, problem in {
        "samples/train/000/notes.txt": "surplus, no journal knows it",
        "samples/test/000/0000009.h5": "surplus, no journal knows it",
        "samples/train/000/.0000000.h5.0123abcd.tmp": "a temporary file left behind",
        "journal/.a.jsonl.0123abcd.tmp": "a temporary file left behind",
        "journal/notes.txt": "surplus, not a journal",
        ".config.toml.0123abcd.tmp": "a temporary file left behind",
    }.items():
        (root / name).write_text("x")
        assert data.verify() == [f"{root / name}: {problem}"]
        (root / name).unlink()
    (root / "report.html").write_text("a page of the user's")
    assert data.verify() == []


def test_what_is_truncated_or_gone_is_not_finished(root: Path):
    layout.sample_path(root, "train", 0).unlink()
    path = layout.sample_path(root, "train", 1)
    path.write_bytes(path.read_bytes()[:-1])
    assert {("train", 0), ("train", 1)}.isdisjoint(dataset.finished(root))
    assert len(dataset.finished(root)) == 5


def test_killed_between_rename_and_journal_the_sample_is_made_again(root: Path):
    path = layout.sample_path(root, "train", 5)
    atomic.write_bytes(path, encode(simulated(5)))
    assert ("train", 5) not in dataset.finished(root)
    assert open_dataset(root).verify() == [f"{path}: surplus, no journal knows it"]
    add(root, simulated(5))
    assert open_dataset(root).verify() == []
    assert open_dataset(root).status()["missing"] == 0


def test_a_torn_last_line_costs_one_sample_and_no_more(root: Path):
    (path,) = (root / "journal").rglob("*.jsonl")
    whole = path.read_bytes()
    last = whole[:-1].rindex(b"\n") + 1
    for end in (last + 1, (last + len(whole)) // 2, len(whole) - 2):
        path.write_bytes(whole[:end])
        assert set(dataset.finished(root)) == {("train", i) for i in range(5)} | {("test", 0)}
    building._journal.cache_clear()  # as in another process
    add(root, simulated(1, "test"))
    assert open_dataset(root).verify() == []
    assert len(dataset.finished(root)) == 7


def test_the_newline_alone_may_be_missing(root: Path):
    (path,) = (root / "journal").rglob("*.jsonl")
    path.write_bytes(path.read_bytes()[:-1])
    assert len(dataset.finished(root)) == 7
    assert open_dataset(root).verify() == []


def test_several_journals_are_read_as_one(root: Path):
    entry = add(root, simulated(0))
    for _ in range(2):
        journal.Journal(root / "journal").append(entry)
    assert len(list((root / "journal").rglob("*.jsonl"))) == 3
    assert len(dataset.finished(root)) == 7
    assert open_dataset(root).verify() == []


def test_an_older_record_of_a_sample_may_be_journaled_too(root: Path):
    changed = dataclasses.replace(simulated(0), provenance={"evslip": "99"})
    entry = add(root, changed)
    assert dataset.finished(root)["train", 0] == entry
    assert open_dataset(root).verify() == []


def test_a_sample_removes_what_a_killed_writer_of_it_left(root: Path):
    left = layout.sample_path(root, "train", 0).with_name(".0000000.h5.0123abcd.tmp")
    other = left.with_name(".0000001.h5.0123abcd.tmp")
    for path in (left, other):
        path.write_bytes(b"half")
    add(root, simulated(0))
    assert not left.exists()
    assert other.exists()


def test_many_writers_of_one_sample_agree(root: Path):
    failures = []

    def write():
        try:
            for _ in range(20):
                add(root, simulated(0))
        except Exception as error:
            failures.append(error)

    threads = [threading.Thread(target=write) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert failures == []
    assert open_dataset(root).verify() == []


WRITER = """
import sys
from pathlib import Path
sys.path.insert(0, {tests!r})
from sample_records import simulated
from evslip.data import building, dataset, layout, requested
from evslip.data.record_file import encode
from evslip.data.recordings import open_samples
root = Path(sys.argv[1])
print("ready", flush=True)
for index in range(10_000):
    sample = simulated(index)
    building.add(root, sample, encode(sample))
"""


@pytest.mark.slow
def test_killed_at_any_moment_nothing_is_corrupt(tmp_path: Path):
    root = tmp_path / "data"
    building.create(root, TOML)
    requested.request(root, "train", 1)
    script = WRITER.format(tests=str(Path(__file__).parents[1] / "helpers"))
    rng = np.random.default_rng(0)
    for _ in range(5):
        process = subprocess.Popen([sys.executable, "-c", script, str(root)], stdout=subprocess.PIPE)
        assert process.stdout is not None
        process.stdout.readline()
        try:
            process.wait(0.05 + 0.4 * rng.random())
        except subprocess.TimeoutExpired:
            process.send_signal(signal.SIGKILL)
        process.wait()
        process.stdout.close()
        finished = dataset.finished(root)
        assert finished
        problems = [p for p in open_dataset(root).verify() if "temporary" not in p]
        assert len(problems) <= 1  # the one that was written but not yet journaled
        assert all("surplus" in p for p in problems)
    building.create(root, TOML)  # as generating again does
    for index in range(len(finished) + 1):
        if ("train", index) not in finished:
            add(root, simulated(index))
    assert open_dataset(root).verify() == []


def test_another_configuration_is_refused_and_the_difference_shown(root: Path):
    other = dump_config(
        load_config("demo", {"camera.width": 41, "camera.height": 30, "object.mass_kg": 0.5, "seed": 1})
    )
    with pytest.raises(ConfigError) as caught:
        building.create(root, other)
    message = str(caught.value)
    assert "camera.width is 40 there and 41 now" in message
    assert "seed is 0 there and 1 now" in message
    assert "object.mass_kg" in message
    assert "camera.height" not in message
    assert "\n" not in message
    assert (root / "config.toml").read_text() == TOML


def test_many_differences_are_counted(root: Path):
    with pytest.raises(ConfigError, match=r"; and \d+ more"):
        building.create(root, dump_config(load_config("simple")))


def test_the_same_configuration_is_accepted_again(root: Path):
    (root / ".config.toml.0123abcd.tmp").write_text("left by a kill")
    building.create(root, TOML)
    assert open_dataset(root).verify() == []
    assert (root / "config.toml").read_text() == TOML


def test_a_damaged_configuration_is_named(root: Path):
    for plan in root.glob("plan-*.json"):  # which would vouch for the right one
        plan.unlink()
    (root / "config.toml").write_bytes(b"\xff = [")
    with pytest.raises(DataError, match=r"config\.toml"):
        building.create(root, TOML)


def test_a_folder_of_something_else_is_left_alone(tmp_path: Path):
    (tmp_path / "thesis.tex").write_text("mine")
    with pytest.raises(DataError, match=r"thesis\.tex"):
        building.create(tmp_path, TOML)
    assert [p.name for p in tmp_path.iterdir()] == ["thesis.tex"]


def test_a_file_in_the_way_is_named(tmp_path: Path):
    (tmp_path / "data").write_text("mine")
    with pytest.raises(StorageError, match="data"):
        building.create(tmp_path / "data", TOML)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda path: None, "no such folder"),
        (lambda path: path.mkdir(), "the folder is empty"),
        (lambda path: (path / "pictures").mkdir(parents=True), "not a data set"),
        (lambda path: path.write_text("x"), "is a file"),
    ],
)
def test_what_is_no_data_set_cannot_be_opened(tmp_path: Path, make, message: str):
    make(tmp_path / "data")
    with pytest.raises(DataError, match=message):
        open_dataset(tmp_path / "data")


def test_a_data_set_of_no_samples_can_be_opened(tmp_path: Path):
    building.create(tmp_path, TOML)
    data = open_dataset(tmp_path)
    assert (len(data), list(data), data.verify()) == (0, [], [])
    assert data.status()["requested"] == 0


def test_a_thousand_samples_share_a_folder(tmp_path: Path):
    assert layout.sample_path(tmp_path, "train", 999).parent != layout.sample_path(tmp_path, "train", 1000).parent
    assert layout.sample_path(tmp_path, "test", 1_234_567) == tmp_path / "samples/test/1234/1234567.h5"


@pytest.mark.parametrize("line", ["[]", "{}", "null", '{"crc32": 1}', "\x00\x00", '{"name": "train/0"', "9" * 5000])
def test_damaged_lines_are_named(root: Path, line: str):
    (root / "journal" / "x.jsonl").write_text(line + "\n")
    assert open_dataset(root).verify() == [f"{root / 'journal' / 'x.jsonl'}: line 1 is damaged"]


def test_a_deleted_data_set_can_be_made_again_by_the_same_process(root: Path):
    shutil.rmtree(root)
    building.create(root, TOML)
    add(root, simulated(0))
    assert set(dataset.finished(root)) == {("train", 0)}


def test_a_failed_append_does_not_glue_two_lines(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    log = journal.Journal(tmp_path)
    entry = journal.Entry(name="train/0", split="train", index=0, kind="simulated", sha256="0", bytes=1, events=0)
    write, calls = os.write, []

    def half_then_full(descriptor: int, data: bytes) -> int:
        calls.append(data)
        if len(calls) == 1:
            return write(descriptor, data[:10])
        if len(calls) == 2:
            raise OSError(28, "No space left on device")
        return write(descriptor, data)

    monkeypatch.setattr(os, "write", half_then_full)
    with pytest.raises(StorageError, match="no space left"):
        log.append(entry)
    log.append(entry)
    assert journal.read_journals(tmp_path) == ({("train", 0): [entry]}, [])
    torn, whole = sorted((p.read_bytes() for p in tmp_path.rglob("*.jsonl")), key=len)
    assert len(torn) == 10
    assert json.loads(whole)["name"] == "train/0"


def test_generating_again_removes_what_a_killed_rewriter_of_a_finished_sample_left(tmp_path: Path):
    root = tmp_path / "data"
    building.create(root, TOML)
    requested.request(root, "train", 5)
    add(root, simulated(3))
    left = layout.sample_path(root, "train", 3).with_name(".0000003.h5.0123abcd.tmp")
    other = layout.sample_path(root, "train", 4).with_name(".0000004.h5.0123abcd.tmp")
    left.write_bytes(b"half")
    other.write_bytes(b"of a sample that another process may be writing")
    building.create(root, TOML)
    assert not left.exists()
    assert other.exists()
    add(root, simulated(4))
    assert open_dataset(root).verify() == []


def test_a_lost_or_damaged_configuration_that_the_plan_knows_is_written_again(root: Path):
    """So "delete the files named and generate again" helps, as `verify` says."""
    path = root / "config.toml"
    other = dump_config(load_config("demo", {"camera.width": 41, "camera.height": 30}))
    for harm in (path.unlink, lambda: path.write_bytes(b"\xff = ["), lambda: path.write_text(other)):
        harm()
        building.create(root, TOML)
        assert path.read_text() == TOML
        assert open_dataset(root).verify() == []
    path.unlink()
    with pytest.raises(DataError, match=r"but no config\.toml"):
        building.create(root, other)
    assert not path.exists()


def test_one_plan_of_another_configuration_is_enough_to_write_none_again(root: Path):
    path = root / "config.toml"
    path.write_text(dump_config(load_config("demo", {"seed": 1})))
    (root / "plan-test.json").unlink()
    requested.request(root, "test", 2)
    path.unlink()
    with pytest.raises(DataError, match=r"but no config\.toml"):
        building.create(root, TOML)


@pytest.mark.parametrize("count", ['"x"', "NaN", "-5", "true", "2.5", "null"])
def test_a_plan_of_no_number_of_samples_is_damaged(root: Path, count: str):
    path = root / "plan-train.json"
    path.write_text(f'{{"count": {count}}}\n')
    assert open_dataset(root).verify() == [f"{path}: damaged"]
    assert requested.requested_count(root, "train") == 0
    assert open_dataset(root).status()["requested"] == 7
    path.write_bytes(requested._encoded(json.loads(count), layout.sha256_of(root / "config.toml")))
    assert open_dataset(root).verify() == [f"{path}: damaged"]


def test_rejected_samples_are_no_recordings(tmp_path: Path):
    (tmp_path / "a.h5").write_bytes(encode(rejected(0)))
    for path in (tmp_path, tmp_path / "a.h5"):
        with pytest.raises(DataError, match="rejected samples alone"):
            open_samples(path)
    (tmp_path / "b.h5").write_bytes(encode(simulated(1)))
    assert [one.name for one in open_samples(tmp_path).listing] == ["b"]


def test_only_what_a_data_set_keeps_for_itself_is_no_place_for_other_files(root: Path):
    for name in ("samples/w.h5", "samples/train/000/w.h5", "journal/w.h5", "config.toml", "plan-test.json"):
        with pytest.raises(DataError, match="among the data set's own files"):
            layout.require_not_own(root / name, root)
    for path in (root / "w.h5", root / "pictures/w.h5", root.parent / "w.h5", root):
        layout.require_not_own(path, root)
    (root / "config.toml").unlink()
    layout.require_not_own(root / "samples/w.h5", root)  # a folder of any files
