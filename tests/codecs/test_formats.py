"""The register of formats: evslip's own as the documentation lists them, and those of other packages."""

import re
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from evslip import codecs
from evslip.codecs import formats, read_events, write_events
from evslip.codecs.writers import writing
from evslip.data.record_file import read_recording
from evslip.exchange.format_to_format import convert_format
from evslip.utils.errors import ConfigError, DataError
from sample_records import assert_equal, random_events

DOCS = Path(__file__).parents[2] / "docs"
TABLE = (DOCS / "reference" / "formats.md").read_text()
HOW_TO = (DOCS / "how-to" / "own-format.md").read_text()


@pytest.fixture(autouse=True)
def nothing_registered(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(formats, "_others", {})


@pytest.fixture
def events():
    return random_events(np.random.default_rng(0), 300, labelled=False)


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of installed packages."""
    folder = tmp_path / "site"
    folder.mkdir()
    monkeypatch.syspath_prepend(folder)
    yield folder
    for name in [name for name, module in sys.modules.items() if str(folder) in str(getattr(module, "__file__", ""))]:
        del sys.modules[name]


def install(site: Path, package: str, code: str, entry: str) -> None:
    (site / f"{package}.py").write_text(code)
    info = site / f"{package}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[evslip.codecs]\n{entry}\n")


def test_the_page_lists_the_formats():
    rows = re.findall(r"^\| (\.[^|]+) \| [^|]+ \| yes[^|]* \| ([^|]+) \| ([^|]+) \|$", TABLE, re.MULTILINE)
    told = [(suffix, row) for row in rows for suffix in row[0].split(", ")]
    assert {suffix for suffix, _ in told} == set(codecs.known_suffixes())
    for form in codecs.FORMATS:
        mine = [row for suffix, row in told if suffix in form.suffixes]
        written = [holds for _, writes, holds in mine if writes != "no"]
        assert form.writes == bool(written), form.name
        if written:
            assert form.keeps_size == any("size" in holds or "everything" in holds for holds in written), form.name
            assert form.keeps_labels == any("labels included" in holds for holds in written), form.name


def test_the_page_shows_a_format_that_works(site: Path, tmp_path: Path, events):
    code = re.search(r"```python\n(\"\"\"lab_format.*?)```", HOW_TO, re.DOTALL)
    toml = re.search(r"\[project.entry-points.\"evslip.codecs\"\]\n(.*?)\n", HOW_TO)
    assert code and toml
    name, _, value = toml[1].replace('"', "").partition(" = ")
    install(site, "lab_format", code[1], f"{name} = {value}")
    path = tmp_path / "a.LAB"
    write_events(path, events, (40, 30))
    assert_equal(read_events(path), events)
    assert read_recording(path).size == (40, 30)
    with writing(tmp_path / "b.lab", (40, 30)) as push:
        push(events.select(slice(0, 100)))
        push(events.select(slice(100, 300)))
    assert path.read_bytes() == (tmp_path / "b.lab").read_bytes()
    assert convert_format(path, tmp_path / "c.h5").lost == ()
    assert codecs.format_of(path).name == name
    assert ".lab" in codecs.known_suffixes(writing=True)
    for text in ("40 30\n1 2 x 1\n", "40 30\n1 2 3\n", "40 30\n1 65541 3 1\n", "40\n", ""):
        (tmp_path / "wrong.lab").write_text(text)
        with pytest.raises(DataError, match=r"wrong\.lab: "):
            read_events(tmp_path / "wrong.lab")
    with pytest.raises(DataError, match=r"no\.lab: "):
        read_events(tmp_path / "no.lab")


def test_the_recordings_of_a_folder_are_its_files_of_events_and_its_bags(tmp_path: Path):
    for name in ("b.h5", "a.aedat4", "notes.md"):
        (tmp_path / name).touch()
    for name in ("bag", "c.h5", "others"):
        (tmp_path / name).mkdir()
    (tmp_path / "bag" / "metadata.yaml").touch()
    assert [path.name for path in formats.recordings_in(tmp_path)] == ["a.aedat4", "b.h5", "bag"]


def test_suffixes_in_capitals_are_those_of_recordings(tmp_path: Path):
    (tmp_path / "A.RAW").touch()
    assert [path.name for path in formats.recordings_in(tmp_path)] == ["A.RAW"]


def test_dots_in_the_name_of_a_recording_stay(tmp_path: Path):
    (tmp_path / "grip_0.5N").mkdir()
    (tmp_path / "grip_0.5N" / "metadata.yaml").touch()
    assert [formats.stem_of(tmp_path / name) for name in ("grip_0.5N.raw", "grip_0.5N")] == ["grip_0.5N"] * 2


def test_known_suffixes_ask_no_package(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(formats.plugins, "installed", lambda group: pytest.fail("asked"))
    for suffix in codecs.known_suffixes():
        codecs.format_of(f"a{suffix}")


@pytest.mark.parametrize(
    ("code", "entry", "reason"),
    [
        ("import nowhere_to_be_found", "mine = broken_format", "cannot be loaded: ModuleNotFoundError"),
        ("x = 1", "mine = broken_format", "not a codec of events; expected suffixes"),
        ("x = 1", "mine = broken_format:Codec", "broken_format:Codec cannot be loaded: AttributeError"),
        ("suffixes = ['h5']\nstream = len", "mine = broken_format", "expected suffixes such as"),
        ("suffixes = ['.h5']\nstream = len", "mine = broken_format", "suffix .h5 is that of hdf5"),
        ("suffixes = ['.new']\nstream = len", "hdf5 = broken_format", "hdf5 is a format of evslip"),
    ],
)
def test_a_broken_format_is_named_in_one_line(site: Path, tmp_path: Path, code: str, entry: str, reason: str):
    install(site, "broken_format", code, entry)
    with pytest.raises(DataError, match=r"known are \.h5") as caught:
        read_events(tmp_path / "a.abc")
    assert reason in str(caught.value)
    assert f"entry point {entry.split()[0]}" in str(caught.value)
    assert "\n" not in str(caught.value)
    install(site, "good_format", "suffixes = ('.abc',)\nstream = len", "good = good_format")
    assert codecs.format_of("a.abc").name == "good"


def test_a_format_is_registered_by_itself_or_by_name(tmp_path: Path, events):
    npz = codecs.format_of("a.npz").codec
    lab = SimpleNamespace(suffixes=[".Lab"], stream=npz.stream, write=npz.write, keeps_labels=True)
    registered = codecs.register(lab, "lab")
    assert (registered.writes, registered.keeps_labels, registered.keeps_size) == (True, True, True)
    write_events(tmp_path / "a.lab", events, (40, 30))
    assert_equal(read_events(tmp_path / "a.lab"), events)
    assert codecs.register(lab, "lab") is codecs.format_of("b.lab")
    with pytest.raises(ConfigError, match=r"suffix \.lab is that of lab; expected others"):
        codecs.register(lab, "other")
    with pytest.raises(ConfigError, match="no_such_module:Codec cannot be loaded: ModuleNotFoundError"):
        codecs.register("no_such_module:Codec")
    codecs.register(SimpleNamespace(suffixes=(".ro",), stream=npz.stream), "read_only")
    with pytest.raises(DataError, match=r"can be written; known are .*\.lab$"):
        write_events(tmp_path / "a.ro", events)
