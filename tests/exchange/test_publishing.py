"""Publications: what is in them, and that they are whole, equal for equal data, and honest about damage."""

import dataclasses
import hashlib
import io
import json
import os
import shutil
import tarfile
from pathlib import Path

import h5py
import numpy as np
import pytest

from command_line import evslip
from evslip.codecs import read_events, write_events
from evslip.config.loading import dump_config
from evslip.data import building, layout, record_file, requested
from evslip.data.dataset import open_dataset
from evslip.data.record import Record
from evslip.exchange.importing.recordings import import_recording
from evslip.exchange.importing.settings import Importing
from evslip.exchange.publishing.publication import Publication
from evslip.exchange.publishing.publish import publish
from evslip.exchange.publishing.shards import Shards
from evslip.exchange.publishing.table import COLUMNS
from evslip.utils.errors import ConfigError, DataError
from sample_records import CONFIG, assert_equal, random_events, simulated

COUNTS = {"train": 5, "test": 2}


@pytest.fixture
def made(tmp_path: Path) -> Path:
    root = tmp_path / "made"
    building.create(root, dump_config(CONFIG))
    for split, count in COUNTS.items():
        requested.request(root, split, count)
        for index in range(count):
            sample = simulated(index, split)
            building.add(root, sample, record_file.encode(sample))
    return root


def tree(root: Path) -> dict[str, str]:
    files = (path for path in root.rglob("*") if path.is_file())
    return {str(path.relative_to(root)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def rows(out: Path, split: str) -> list[dict]:
    return [json.loads(line) for line in (out / f"{split}.jsonl").read_text().splitlines()]


def test_records_and_their_table_are_published(made: Path, tmp_path: Path):
    assert publish(made, tmp_path / "out", Publication(name="Slips")) == 7
    for split, count in COUNTS.items():
        table = rows(tmp_path / "out", split)
        assert len(table) == count
        for index, values in enumerate(table):
            assert values.keys() == COLUMNS.keys()
            sample = simulated(index, split)
            data = (tmp_path / "out" / values["file"]).read_bytes()
            assert hashlib.sha256(data).hexdigest() == values["sha256"]
            assert_equal(record_file.read(tmp_path / "out" / values["file"]), sample)
            assert (values["events"], values["name"], values["bytes"]) == (200, sample.name, len(data))
            assert values["label"] == ("slip" if index % 3 == 0 else "hold")
            assert values["onset_s"] == (0.001 if index % 3 == 0 else None)
            assert sample.params is not None and values["mass_kg"] == sample.params.object.mass_kg
    assert (tmp_path / "out" / "config.toml").read_text() == (made / "config.toml").read_text()
    assert [path.name for path in tmp_path.iterdir() if path.name.startswith(".")] == []


def test_the_card_says_what_there_is(made: Path, tmp_path: Path):
    publish(made, tmp_path / "out", Publication(name="Slips: a set", license="mit", huggingface=True))
    card = (tmp_path / "out" / "README.md").read_text()
    _, header, text = card.split("---\n", 2)
    assert 'license: "mit"' in header
    assert 'pretty_name: "Slips: a set"' in header
    assert "path: train.jsonl" in header and "path: test.jsonl" in header
    assert "| train | 5 | 2 | 3 | 0 | 1,000 |" in text
    assert dump_config(CONFIG).strip() in text
    publish(made, tmp_path / "plain")
    assert "configs:" not in (tmp_path / "plain" / "README.md").read_text()


@pytest.mark.parametrize("webdataset", [False, True])
def test_equal_samples_give_equal_bytes(made: Path, tmp_path: Path, webdataset: bool):
    how = Publication(name="Slips", webdataset=webdataset, huggingface=True, shard_mb=0.04)
    for out in ("a", "b"):
        publish(made, tmp_path / out, how)
    assert tree(tmp_path / "a") == tree(tmp_path / "b")


def test_shards_hold_every_record_once(made: Path, tmp_path: Path):
    publish(made, tmp_path / "out", Publication(webdataset=True, shard_mb=0.04))
    for split, count in COUNTS.items():
        found = {}
        for shard in sorted((tmp_path / "out" / "data").glob(f"{split}-*.tar")):
            with tarfile.open(shard) as tar:
                names = tar.getnames()
                assert all(name.split(".")[0] == names[2 * (i // 2)].split(".")[0] for i, name in enumerate(names))
                for name in names[::2]:
                    member, values = tar.extractfile(name), tar.extractfile(name.replace(".h5", ".json"))
                    assert member is not None and values is not None
                    row = json.load(values)
                    assert row["file"] == f"data/{shard.name}/{name}"
                    with h5py.File(io.BytesIO(member.read())) as file:
                        assert len(file["events/t"]) == row["events"]  # pyright: ignore[reportArgumentType]
                    found[name] = row
        assert list(found) == [f"{index:07d}.h5" for index in range(count)]
        assert list(found.values()) == rows(tmp_path / "out", split)
    assert len(list((tmp_path / "out" / "data").glob("train-*.tar"))) > 1


def test_names_with_dots_are_samples_of_their_own_in_shards(tmp_path: Path):
    home = tmp_path / "in"
    names = ("grip_0.5N", "grip_0.7N")
    for name in names:
        events = random_events(np.random.default_rng(0), 50)
        record_file.write(home / f"{name}.h5", Record(kind="recording", name=name, size=(40, 30), events=events))
    publish(home, tmp_path / "out", Publication(webdataset=True))
    with tarfile.open(tmp_path / "out" / "data" / "recordings-00000.tar") as tar:
        # The library ends a sample's key at the first dot.
        keys = [name.split(".", 1) for name in tar.getnames()]
    assert keys == [[key, suffix] for key in ("grip_0_5N", "grip_0_7N") for suffix in ("h5", "json")]
    assert [row["name"] for row in rows(tmp_path / "out", "recordings")] == list(names)
    (home / "grip_0.5N.h5").rename(home / "grip_0_7N.h5")
    with pytest.raises(DataError, match=r"grip_0_7N\.h5: would be grip_0_7N\.h5, as grip_0\.7N\.h5"):
        publish(home, tmp_path / "again", Publication(webdataset=True))


def test_a_name_too_long_for_a_shard_is_refused_before_anything_is_written(tmp_path: Path, monkeypatch):
    record = Record(kind="recording", name="a", size=(40, 30), events=random_events(np.random.default_rng(0), 50))
    record_file.write(tmp_path / "in" / f"{'ä' * 47}b.h5", record)
    assert publish(tmp_path / "in", tmp_path / "out", Publication(webdataset=True)) == 1
    record_file.write(tmp_path / "in" / f"{'ä' * 48}.h5", record)
    monkeypatch.setattr(Shards, "add", lambda *given: pytest.fail("written"))
    with pytest.raises(DataError, match=r"ä\.h5: its name has 96 bytes without the suffix; shards hold 95 at most"):
        publish(tmp_path / "in", tmp_path / "again", Publication(webdataset=True))


@pytest.mark.parametrize("webdataset", [False, True])
def test_names_of_any_bytes_are_published_as_texts(tmp_path: Path, webdataset: bool):
    home = tmp_path / os.fsdecode(b"p\xfe")
    record = Record(kind="recording", name="a", size=(40, 30), events=random_events(np.random.default_rng(0), 50))
    record_file.write(home / os.fsdecode(b"r\xffc.h5"), record)
    publish(home, tmp_path / "out", Publication(webdataset=webdataset))
    (row,) = rows(tmp_path / "out", "recordings")
    assert row["file"].endswith("/r\\xffc.h5")
    if webdataset:
        with tarfile.open(tmp_path / "out" / "data" / "recordings-00000.tar") as tar:
            assert tar.getnames() == ["r\\xffc.h5", "r\\xffc.json"]
    else:
        assert (tmp_path / "out" / row["file"]).is_file()


def test_a_sample_that_was_made_again_is_published_as_it_is(made: Path, tmp_path: Path):
    """By another library, whose version has as many digits: whatever the order of the journals' random names."""
    path = layout.sample_path(made, "train", 1)
    for number in range(8):
        path.unlink()
        sample = dataclasses.replace(simulated(1), provenance={"evslip": f"0.1.{number + 1}"})
        building._journal.cache_clear()
        building.add(made, sample, record_file.encode(sample))
        assert open_dataset(made).verify() == []
        assert publish(made, tmp_path / f"out{number}") == 7


def test_croissant_agrees_with_the_files(made: Path, tmp_path: Path):
    out = tmp_path / "out"
    publish(made, out)
    data = json.loads((out / "croissant.json").read_text())
    assert (data["name"], data["@type"]) == ("made", "sc:Dataset")
    files = {item["@id"]: item for item in data["distribution"] if item["@type"] == "cr:FileObject"}
    for name, item in files.items():
        assert hashlib.sha256((out / name).read_bytes()).hexdigest() == item["sha256"]
    sets = [item["includes"] for item in data["distribution"] if item["@type"] == "cr:FileSet"]
    assert sorted(len(list(out.glob(pattern))) for pattern in sets) == [2, 5]
    for record_set in data["recordSet"]:
        columns = [field["source"]["extract"]["column"] for field in record_set["field"]]
        assert columns == list(rows(out, record_set["@id"])[0])


def test_date_and_citation_are_told_as_given(made: Path, tmp_path: Path):
    publish(made, tmp_path / "out", Publication(date_published="2026-11-21", cite_as="A. Person, Slips, 2026"))
    data = json.loads((tmp_path / "out" / "croissant.json").read_text())
    assert (data["datePublished"], data["citeAs"]) == ("2026-11-21", "A. Person, Slips, 2026")
    for wrong in ("20261121", "2026-02-30", "", "soon"):
        with pytest.raises(ConfigError, match=r"date_published: .* expected YYYY-MM-DD"):
            Publication(date_published=wrong)


def test_croissant_is_valid(made: Path, tmp_path: Path):
    library = pytest.importorskip("mlcroissant")
    publish(made, tmp_path / "out")
    read = library.Dataset(jsonld=str(tmp_path / "out" / "croissant.json"))
    assert len(list(read.records("train"))) == 5


def test_recordings_are_published_too(tmp_path: Path):
    write_events(tmp_path / "a.npz", random_events(np.random.default_rng(0), 50, labelled=False), (40, 30))
    (tmp_path / "l.csv").write_text("0.01,0.02,slip\n")
    import_recording(tmp_path / "a.npz", tmp_path / "in" / "a.h5", Importing(labels=tmp_path / "l.csv", mount="side"))
    assert publish(tmp_path / "in", tmp_path / "out") == 1
    (values,) = rows(tmp_path / "out", "recordings")
    assert (values["label"], values["onset_s"], values["mass_kg"]) == ("slip", 0.01, None)
    assert json.loads(values["notes"])["mount"] == "side"
    assert read_events(tmp_path / "out" / values["file"]).count == 50
    assert "Event-camera recordings" in (tmp_path / "out" / "README.md").read_text()


def test_a_damaged_record_is_not_published(made: Path, tmp_path: Path):
    path = layout.sample_path(made, "train", 2)
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(bytes(data))
    with pytest.raises(DataError, match=r"0000002\.h5: damaged"):
        publish(made, tmp_path / "out")
    assert {path.name for path in tmp_path.iterdir()} == {"made"}


@pytest.mark.parametrize("webdataset", [False, True])
def test_a_publication_is_verified_by_its_tables(made: Path, tmp_path: Path, webdataset: bool):
    out = tmp_path / "out"
    publish(made, out, Publication(webdataset=webdataset))
    whole = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
    assert evslip("verify", out).stdout.strip() == f"{out}: every record is whole"
    (record, *_) = (out / "data").rglob("*train*.tar" if webdataset else "train/*.h5")
    place = whole[record].index(b"HDF") + 600
    harms = {
        "damaged, its sha256 is not the one": (record, whole[record][:place] + b"~" + whole[record][place + 1 :]),
        "missing": (record, None),
        "surplus, no table lists it": (out / "data" / "more.h5", b"more"),
        "damaged, its sha256 is not that in croissant.json": (out / "test.jsonl", b"{}"),
        "croissant.json: damaged": (out / "croissant.json", b"{}"),
    }
    for said, (path, content) in harms.items():
        path.write_bytes(content) if content is not None else path.unlink()
        done = evslip("verify", out)
        assert done.returncode == 2 and said in done.stdout + done.stderr, done
        path.write_bytes(whole[path]) if path in whole else path.unlink()
    assert evslip("verify", out).returncode == 0


def test_what_is_there_is_not_overwritten(made: Path, tmp_path: Path):
    (tmp_path / "out").mkdir()
    publish(made, tmp_path / "out")
    before = tree(tmp_path / "out")
    with pytest.raises(DataError, match="a new folder"):
        publish(made, tmp_path / "out")
    assert tree(tmp_path / "out") == before


def test_wrong_use_is_refused(made: Path, tmp_path: Path):
    with pytest.raises(ConfigError, match="shard_mb"):
        publish(made, tmp_path / "out", Publication(shard_mb=0))
    empty = tmp_path / "empty"
    building.create(empty, dump_config(CONFIG))
    with pytest.raises(DataError, match="no finished sample"):
        publish(empty, tmp_path / "out")
    with pytest.raises(DataError, match="no such folder"):
        publish(tmp_path / "nowhere", tmp_path / "out")


@pytest.mark.parametrize("key", ["name", "license"])
@pytest.mark.parametrize("text", ["a\nb", "a\r\nb", "a\n", "\n", "a\u2028b"])
def test_what_has_line_breaks_is_no_name(key: str, text: str):
    with pytest.raises(ConfigError, match=rf"{key}: .* has line breaks"):
        Publication(**{key: text})


@pytest.mark.parametrize("webdataset", [False, True])
def test_a_publication_without_its_metadata_is_not_whole(made: Path, tmp_path: Path, webdataset: bool):
    out = tmp_path / "out"
    publish(made, out, Publication(webdataset=webdataset))
    (out / "croissant.json").unlink()
    done = evslip("verify", out)
    assert done.returncode == 2 and done.stdout.strip() == f"{out / 'croissant.json'}: missing"
    next((out / "data").rglob("*.tar" if webdataset else "*.h5")).unlink()
    assert evslip("verify", out).stdout.count(": missing") > 1


def test_samples_that_were_asked_for_and_are_not_there_are_counted(made: Path):
    assert evslip("verify", made).stdout.strip() == f"{made}: every record is whole"
    requested.request(made, "train", 9)
    for words in ("7 records are whole; 4 that", "0 records are whole; 11 that"):
        done = evslip("verify", made)
        assert (done.returncode, done.stdout.strip()) == (0, f"{made}: {words} were asked for are not there yet")
        for folder in ("samples", "journal"):
            shutil.rmtree(made / folder, ignore_errors=True)


def test_a_folder_of_any_name_gives_a_name_of_one_line():
    assert Publication().name_of(os.fsdecode(b"/data/r\xffc\nii")) == "r\\xffc ii"
    assert Publication(name="Mine").name_of("/data/other") == "Mine"
