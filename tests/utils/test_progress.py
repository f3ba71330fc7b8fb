"""Steps of long work, and what is shown of them."""

import threading

import pytest

from evslip.utils.errors import ConfigError
from evslip.utils.progress import VARIABLE, Step, over, shown


def wait_for(capsys, words: str) -> str:
    """What was written once it holds some words."""
    text = ""
    while words not in text:
        text += capsys.readouterr().err
    return text


@pytest.fixture
def quick(monkeypatch):
    monkeypatch.setenv(VARIABLE, "0.01")


def test_a_step_says_its_figures_as_far_as_there_are_any():
    assert Step("reading").line() == "reading: 0:00:00 so far"
    with Step("samples", 2000) as step:
        step(500)
        step.note = "3 rejected"
        assert step.line() == "samples: 500 of 2,000 (25.0%), 3 rejected, 0:00:00 so far, 0:00:00 left"
    with Step("events") as step:
        step(1_000_000)
        assert step.line() == "events: 1,000,000, 0:00:00 so far"


def test_what_an_earlier_run_did_says_nothing_of_the_time_left():
    step = Step("samples")
    step.begin(10, 5)
    assert step.line() == "samples: 5 of 10 (50.0%), 0:00:00 so far"


def test_a_log_has_lines_while_a_step_stands_still(quick, capsys):
    with shown("windows"), Step("records", 8) as step:
        wait_for(capsys, "records: 0 of 8")
        step(3)
        lines = wait_for(capsys, "records: 3 of 8").splitlines()
    assert all(line.partition("  ")[2].startswith("records: ") for line in lines)
    capsys.readouterr()


def test_the_command_is_named_where_no_step_is_known(quick, capsys):
    with shown("windows"):
        wait_for(capsys, "  windows: 0:00:0")


def test_items_are_counted_and_steps_end_with_their_block(quick, capsys):
    with shown("report"):
        for number in over("samples", range(3)):
            wait_for(capsys, f"samples: {number} of 3")
        with Step("pages"):
            assert "samples" not in wait_for(capsys, "pages").splitlines()[-1]


def test_one_inside_another_shows_nothing_twice(quick, capsys):
    with shown("demo"), shown("train"):
        wait_for(capsys, "demo: ")
        assert threading.active_count() == 2


def test_short_work_and_work_that_nobody_shows_say_nothing(capsys):
    with shown("verify"), Step("files", 2) as step:
        step(2)
    for _ in over("files", range(3)):
        pass
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize("value", ["0", "-1", "soon", "nan", "1e300"])
def test_a_wrong_interval_is_refused(monkeypatch, value):
    monkeypatch.setenv(VARIABLE, value)
    with pytest.raises(ConfigError, match=VARIABLE), shown("verify"):
        pass
