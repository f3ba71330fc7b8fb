"""The documentation against the repository: links, pages, commands, paths."""

import importlib
import re
import subprocess
import sys
import tomllib
from functools import cache
from pathlib import Path

import pytest

from evslip.cli import VERBS

ROOT = Path(__file__).resolve().parents[1]
PAGES = sorted((ROOT / "docs").rglob("*.md"))
FILES = [ROOT / "README.md", ROOT / "CHANGELOG.md", ROOT / "CONTRIBUTING.md", *PAGES]
ROOMS = sorted(path.parent.name for path in (ROOT / "src" / "evslip").glob("*/__init__.py"))
LOCK = ROOT / "constraints.txt"
CHECK_DOCS = ROOT / "benchmarks" / "check_docs.py"
ARCHITECTURE = ROOT / "docs" / "explanation" / "architecture.md"
LINK = re.compile(r"\]\((?!\w+:)([^)\s#]*)(?:#([^)\s]+))?\)")
CODE = re.compile(r"^```.*?^```$|`[^`\n]+`", re.MULTILINE | re.DOTALL)
CODE_BLOCK = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)
TOPS = ("src/evslip", "tests", "benchmarks", "examples", "experiments", "docs")
IN_ROOMS = rf"(?:{'|'.join(ROOMS)})/[\w/]*(?:\.py|(?<=/)(?=`))"
PATH = re.compile(rf"(?<![\w/.-])(?:(?:{'|'.join(TOPS)})/[\w/.-]*\w|{IN_ROOMS})")


def name_of(path: Path) -> str:
    return str(path.relative_to(ROOT))


@cache
def anchors(path: Path) -> set[str]:
    """Anchors that the site gives to the headings of a page."""
    headings = re.findall(r"^#+ (.+)$", CODE_BLOCK.sub("", path.read_text()), re.MULTILINE)
    words = [re.sub(r"[^\w\s-]", "", heading.lower()).strip() for heading in headings]
    return {re.sub(r"[-\s]+", "-", heading) for heading in words}


@pytest.mark.parametrize("path", FILES, ids=name_of)
def test_links_lead_somewhere(path):
    for target, anchor in LINK.findall(CODE_BLOCK.sub("", path.read_text())):
        file = (path.parent / target).resolve() if target else path
        assert file.exists(), f"{target} is not there"
        assert not anchor or anchor in anchors(file), f"{target or path.name} has no heading #{anchor}"


@pytest.mark.parametrize("path", FILES, ids=name_of)
def test_commands_are_verbs(path):
    for code in CODE.findall(path.read_text()):
        for line in code.strip("`").splitlines():
            said = re.match(r"(?:\s*- )?evslip ([a-z][a-z-]*)\b(?![.:/])", line)
            assert not said or said[1] in VERBS, f"evslip {said[1]} is no verb"


@pytest.mark.parametrize("path", [file for file in FILES if file.name != "CHANGELOG.md"], ids=name_of)
def test_files_that_are_named_are_there(path):
    for code in CODE.findall(path.read_text()):
        for file in PATH.findall(code):
            assert any((top / file).exists() for top in (ROOT, ROOT / "src" / "evslip")), f"{file} is not there"


def test_every_page_is_in_the_navigation_once():
    nav = (ROOT / "mkdocs.yml").read_text().split("\nnav:\n")[1]
    named = re.findall(r": (\S+\.md)$", nav, re.MULTILINE)
    assert sorted(named) == sorted(str(page.relative_to(ROOT / "docs")) for page in PAGES)


def test_the_architecture_names_every_room_in_the_order_of_the_contract():
    rows = re.findall(r"^\| `(\w+)` \|", ARCHITECTURE.read_text(), re.MULTILINE)
    contract = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"][0]
    assert sorted(rows) == ROOMS
    assert rows == [room for room in reversed(contract["layers"]) if room in ROOMS]


def test_every_room_has_a_page_of_the_api():
    pages = "".join(page.read_text() for page in (ROOT / "docs" / "reference" / "api").glob("*.md"))
    for module in re.findall(r"^::: (\S+)$", pages, re.MULTILINE):
        path = ROOT / "src" / module.replace(".", "/")
        assert path.is_dir() or path.with_suffix(".py").exists(), f"{module} is not there"
    for room in set(ROOMS) - {"cli"}:
        assert re.search(rf"^::: evslip\.{room}\b", pages, re.MULTILINE), f"no page of the API has evslip.{room}"


def test_the_repository_has_one_address():
    address = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["urls"]["Repository"]
    assert f'repository-code: "{address}"' in (ROOT / "CITATION.cff").read_text()


def test_tables_of_figures_say_which_command_prints_them():
    done = subprocess.run([sys.executable, CHECK_DOCS], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize(
    ("said", "code"),
    [
        ("`python benchmarks/render.py simple 8`:", 0),
        ("Nobody knows how:", 1),
        ("`evslip train` was used:", 1),
        ("<!-- figures: the data sheet -->", 0),
    ],
)
def test_a_table_without_its_command_is_found(tmp_path, said, code):
    page = tmp_path / "page.md"
    table = "| | a | b |\n|---|---|---|\n| x | 1.5 | 20 % |\n| y | 2.5 | 1,000 |\n"
    page.write_text(f"# Title\n\n`python benchmarks/events.py` is another's.\n\n## Speed\n\n{said}\n\n{table}")
    done = subprocess.run([sys.executable, CHECK_DOCS, page], capture_output=True, text=True, check=False)
    assert done.returncode == code, done.stdout
    assert ("page.md:9: no command" in done.stdout) == bool(code)


@pytest.mark.parametrize(
    ("said", "lacks"),
    [
        ("`python benchmarks/render.py` (commit COMMIT): 3.4 CPU-ms a frame.", ""),
        ("<!-- figures: the data sheet -->\nIt reads 12 Mpixel/s.", ""),
        ("It waits for 20 ms, a setting.", ""),
        ("A frame takes 3.4 CPU-ms.", "no command and no commit: 3.4 CPU-ms"),
        ("`python benchmarks/render.py`: 3.4 to 4.2 CPU-ms.", "no commit: 3.4 to 4.2 CPU-ms"),
        ("`python benchmarks/render.py` (commit 0123abc): 90 ns an event.", "no commit 0123abc here: 90 ns an event"),
    ],
)
def test_costs_in_the_text_name_command_and_commit(tmp_path, said, lacks):
    asked = ["git", "-C", ROOT, "rev-parse", "--short=7", "HEAD"]
    commit = subprocess.run(asked, capture_output=True, text=True, check=False).stdout.strip() or "0123abc"
    if "0123abc" in lacks and commit == "0123abc":
        pytest.skip("no git repository whose commits could be asked for")
    page = tmp_path / "page.md"
    page.write_text(
        f"# Title\n\n`python benchmarks/events.py` is another's.\n\n## Speed\n\n{said.replace('COMMIT', commit)}\n"
    )
    done = subprocess.run([sys.executable, CHECK_DOCS, "--commits", page], capture_output=True, text=True, check=False)
    assert done.returncode == bool(lacks), done.stdout
    assert not lacks or f"page.md:7: {lacks}" in done.stdout, done.stdout


BY_HAND = {"detectors.py", "interop.py", "noise_levels.py", "figures.py"}
"""Benchmarks whose tables need a data set that is made first, and the one that runs all others."""


def test_make_figures_prints_every_table_that_names_a_benchmark(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "benchmarks")
    check, figures = importlib.import_module("check_docs"), importlib.import_module("figures")
    told = " ".join(" ".join(check.CODE.findall(table.said)) for page in PAGES for table in check.tables(page))
    named = set(re.findall(r"benchmarks/(\w+\.py)", told))
    printed = {command.split()[0] for command in figures.TABLES.values()}
    assert len(named) > 15 and named - BY_HAND - {"figures.py"} <= printed
    assert all((ROOT / "benchmarks" / script).is_file() for script in printed)


def test_a_table_is_printed_once_and_its_commit_told(tmp_path, monkeypatch, capsys):
    monkeypatch.syspath_prepend(ROOT / "benchmarks")
    figures = importlib.import_module("figures")
    monkeypatch.setattr(figures, "TABLES", {"some": "check_docs.py README.md", "bad": "check_docs.py absent.md"})
    monkeypatch.setattr(sys, "argv", ["figures.py", str(tmp_path), "--only", "some", "bad"])
    assert figures.main() == 1
    printed = (tmp_path / "some.md").read_text()
    assert printed.startswith("`python benchmarks/check_docs.py README.md`: ") and "; commit " in printed
    assert printed.rstrip().endswith("0 of them with something missing") and not (tmp_path / "bad.md").exists()
    assert "FileNotFoundError" in (tmp_path / "bad.log").read_text()
    capsys.readouterr()
    figures.main()
    assert "some: there" in capsys.readouterr().out


def test_the_lock_file_pins_every_dependency():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = {name: needs for name, needs in project["optional-dependencies"].items() if name != "cuda"}  # not tested
    named = [*project["dependencies"], *(need for needs in extras.values() for need in needs)]
    pinned = {name.replace("_", "-").lower() for name in re.findall(r"^([\w.-]+)==", LOCK.read_text(), re.MULTILINE)}
    assert sorted(name for need in named if (name := re.match(r"[\w.-]+", need)[0].lower()) not in pinned) == []
