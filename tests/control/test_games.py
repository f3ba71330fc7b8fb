"""Episodes that controllers play, and figures of them."""

import gc
import json
import math
import shutil
import sys
from dataclasses import replace
from datetime import date

import numpy as np
import pytest
from PIL import Image

from evslip.config.loading import load_config
from evslip.control.candidates import Candidates
from evslip.control.controllers import make_controller
from evslip.control.controllers.controller import Controller
from evslip.control.evaluation.episode_record import record_of
from evslip.control.evaluation.games import earlier_outcomes, games_of, play_game, play_games
from evslip.control.evaluation.outcome import Outcome
from evslip.control.evaluation.play import play
from evslip.control.evaluation.sources import source_of
from evslip.control.evaluation.summary import summarise, tables
from evslip.data import record_file
from evslip.data.recordings import open_samples
from evslip.learn.shipped import FOLDER
from evslip.utils.errors import ConfigError, DataError

SHORT = {
    "robot.kind": "cartesian",
    "motion.kind": "hold",
    "motion.duration_s": 5.0,
    "motion.lift_s": 0.3,
    "motion.hold_s": 0.5,
    "disturbance.kind": "none",
    "camera.width": 48,
    "camera.height": 36,
    "render.max_motion_px": 4.0,
}
WET = SHORT | {
    "disturbance.kind": "wet",
    "disturbance.wet_factor": 0.5,
    "disturbance.at": 0.5,
    "object.mass_kg": 0.1,
    "object.shape": "cuboid",
    "grip.force_n": 3.0,
    "grip.friction": 0.6,
    "grip.offset": 0.3,
    "motion.hold_s": 1.5,
}


def outcome(name, overrides=WET, index=0):
    candidates = Candidates("hold", overrides)
    episode = candidates.make(index, 10_000, sees=False)
    return Outcome.of(name, play(episode, make_controller(name), 10_000, candidates.forces_n, False), "wet")


@pytest.fixture(scope="module")
def found():
    return {name: outcome(name) for name in ("constant", "oracle")}


def test_the_oracle_stops_a_slip_that_a_constant_force_lets_go_on(found):
    open_loop, oracle = found["constant"], found["oracle"]
    assert open_loop.is_bad and open_loop.onset_us is not None
    assert not oracle.is_bad and oracle.largest_deg < 3 < open_loop.largest_deg
    assert oracle.onset_us == pytest.approx(open_loop.onset_us, abs=1000)
    assert 0 <= oracle.alarm_ms <= 10 and oracle.alarm_ms < oracle.rise_ms <= 30
    assert oracle.stop_ms is not None and oracle.stop_ms < 200
    assert open_loop.rise_ms is None and open_loop.alarm_ms is None
    assert oracle.mean_n > open_loop.mean_n == pytest.approx(3.0)
    assert oracle.false_alarms == open_loop.false_alarms == 0


def test_a_faster_actuator_stops_it_sooner(found):
    ideal = outcome("oracle", WET | {"grip.actuator": "ideal"})
    slow = outcome("oracle", WET | {"grip.actuator_n_s": 5.0})
    assert ideal.largest_deg < found["oracle"].largest_deg < slow.largest_deg


def test_strong_asks_for_what_the_gripper_can():
    candidates = Candidates("hold", SHORT | {"robot.gripper": "small", "grip.most_n": 70.0, "motion.duration_s": 3.0})
    controller, episode = make_controller("strong"), candidates.make(0, 10_000, sees=False)
    played = play(episode, controller, 10_000, candidates.forces_n, False)
    assert set(played.target_n) == {40.0} and controller.step(played.events, episode.senses) == 40.0


class At(Controller):
    """Asks for three times the force from a moment on, and changes what it gets."""

    sees = False

    def __init__(self, at_us: int):
        self._at_us = at_us

    def reset(self, setup):
        self.force_n = setup.force_n

    def step(self, events, senses):
        return np.array([self.force_n * (3.0 if senses.t_us >= self._at_us else 1.0)], np.float32)


def test_when_the_force_rises_does_not_depend_on_how_often_it_is_commanded(found):
    candidates, onset_us = Candidates("hold", WET), found["constant"].onset_us
    start_us = candidates.make(0, 10_000, sees=False).start_us
    at_us = start_us - (start_us - onset_us) // 50_000 * 50_000  # when all of them command
    outcomes = []
    for step_us in (1000, 10_000, 50_000):
        episode = candidates.make(0, step_us, sees=False)
        outcomes.append(Outcome.of("at", play(episode, At(at_us), step_us, candidates.forces_n, False), "wet"))
    rises = {one.rise_ms for one in outcomes}
    delay_us, least_ms = 5000, (at_us - onset_us) / 1e3
    assert len(rises) == 1 and least_ms + delay_us / 1e3 <= rises.pop() <= least_ms + 20
    assert len({one.onset_us for one in outcomes}) == 1


def test_outcomes_survive_json(found):
    for one in found.values():
        assert Outcome.from_row(json.loads(json.dumps(one.row())), "here") == one
    with pytest.raises(DataError, match="here: is no outcome"):
        Outcome.from_row({"lost": True}, "here")


def test_games_resume_and_do_not_depend_on_the_processes(tmp_path):
    config = load_config("hold", WET)

    def all_played(folder, workers, count=2):
        games = games_of(tmp_path / folder, config, {"constant": {}, "oracle": {}}, "train", range(count), 100)
        return games, play_games(games, workers, print, lambda: None)

    games, one = all_played("one", 1)
    assert all_played("two", 2)[1] == one and len(one) == 4
    games[0].path.unlink()
    stamps = {game.path: game.path.stat().st_mtime_ns for game in games[1:]}
    assert all_played("one", 1)[1] == one
    assert stamps == {path: path.stat().st_mtime_ns for path in stamps}
    with pytest.raises(ConfigError, match="another configuration, rate or parameters"):
        games_of(tmp_path / "one", config, {"constant": {"force_n": 3.0}}, "train", range(2), 100)
    games[1].path.write_text("{")
    with pytest.raises(DataError, match="cannot be read"):
        all_played("one", 1)


def test_what_cannot_be_compared_leaves_no_note_of_what_was_asked(tmp_path):
    config = load_config("hold", WET)
    games_of(tmp_path, config, {"constant": {}}, "train", range(1), 100)
    faster = load_config("hold", WET | {"grip.actuator": "ideal"})
    with pytest.raises(ConfigError, match="episodes/constant: holds episodes of another configuration"):
        games_of(tmp_path, faster, {"strong": {}, "constant": {}}, "train", range(1), 100)
    assert [path.name for path in (tmp_path / "episodes").iterdir()] == ["constant"]


def test_it_is_said_why_nothing_can_be_played(tmp_path):
    config = load_config("hold", SHORT | {"robot.kind": "panda", "motion.move_y_m": -0.2, "object.x_m": 0.95})
    games = games_of(tmp_path, config, {"constant": {}}, "train", range(2), 100)
    for _ in range(2):  # played, and read
        with pytest.raises(
            ConfigError, match=r"none of 2 games can be played; the first, constant on train/0: object.x_m"
        ):
            play_games(games, 1, print, lambda: None)


def test_figures_are_over_the_episodes_that_all_have_played(found):
    constant, oracle = found["constant"], found["oracle"]
    many = [replace(constant, index=k, lost=k < 3, largest_deg=10.0 + k) for k in range(10)]
    many += [replace(oracle, index=k, largest_deg=0.5) for k in range(12)]
    many += [replace(oracle, controller="mine", index=k, largest_deg=1.0 + (k == 4) * 9.0) for k in range(10)]
    figures = summarise(many, resamples=200)
    assert figures["constant"]["lost, %"].value == 30.0
    assert figures["constant"]["lost, %"].episodes == figures["oracle"]["lost, %"].episodes == 10
    assert figures["mine"]["stopped of what the oracle stops, %"].value == 90.0
    assert figures["constant"]["stopped of what the oracle stops, %"].value == 0.0
    assert figures["mine"]["largest slip beyond the oracle's, deg: median"].value == 0.5
    low, high = figures["mine"]["stopped of what the oracle stops, %"].interval
    assert (low, high) == pytest.approx((59.58, 98.21), abs=0.01)  # Wilson's of 9 of 10
    low, high = figures["oracle"]["lost, %"].interval  # Wilson: none of 10 may be one in four
    assert low == 0.0 and high == pytest.approx(100 * 1.96**2 / (10 + 1.96**2), abs=0.02)
    assert math.isnan(figures["constant"]["onset to alarm, ms: median"].value)
    assert set(tables(many, only="wet")) == {"constant", "oracle", "mine"}
    assert summarise(many, only="push") == {}


def test_an_episodes_record_is_one_like_any_other(tmp_path):
    candidates = Candidates("hold", WET)
    episode = candidates.make(0, 10_000, sees=True)
    played = play(episode, make_controller("oracle"), 10_000, candidates.forces_n, True)
    record = record_of(played)
    record_file.write(tmp_path / "a.h5", record)
    again = record_file.read(tmp_path / "a.h5")
    assert again.kind == "simulated" and again.events == record.events and len(again.events) > 0
    start, end = again.truth.span_us
    assert start <= again.events.t_us[0] and again.events.t_us[-1] <= end
    target = again.trajectory.target_force_n
    np.testing.assert_array_equal(target[played.decided_us // 1000], played.target_n.astype(np.float32))
    assert target[0] == pytest.approx(episode.params.grip.force_n)
    force = again.trajectory.pad_force_n.mean(1)
    assert force[np.searchsorted(again.truth.t_us, episode.end_us - 10_000)] > 1.2 * force[int(start) // 1000 + 50]


def test_a_record_has_what_was_seen_up_to_the_end_and_what_each_event_is_of():
    uneven = {"motion.duration_s": 5.0137, "motion.lift_s": 0.3113, "motion.hold_s": 0.5007}
    candidates = Candidates("hold", SHORT | uneven)
    episode = candidates.make(0, 10_000, sees=True)
    played = play(episode, make_controller("constant"), 10_000, candidates.forces_n, True)
    assert played.t_us[-1] - played.decided_us[-1] < 10_000  # the last step is a short one
    assert episode.frame.t_us == episode.end_us == played.t_us[-1]
    assert played.events.body is not None and played.events.cause is not None


def games_in(folder, *controllers, count=2, records=None):
    players = {name: {} for name in ("constant", *controllers)}
    return games_of(folder, load_config("hold", WET), players, "train", range(count), 100, records)


def test_controllers_of_an_earlier_run_are_compared_where_they_have_played_the_same_episodes(tmp_path):
    first = play_games(games_in(tmp_path, "strong"), 1, print, lambda: None)
    notes = []
    games = games_in(tmp_path, "oracle")
    now = play_games(games, 1, print, lambda: None)
    found = earlier_outcomes(games, notes.append)
    assert found == [one for one in first if one.controller == "strong"] and len(found) == 2 and not notes
    assert set(summarise([*now, *found], resamples=10)) == {"constant", "oracle", "strong"}
    assert earlier_outcomes(games_in(tmp_path, "oracle", "strong"), notes.append) == []
    fewer = games_in(tmp_path, "oracle", count=1)
    assert earlier_outcomes(fewer, notes.append) == found[:1] and not notes
    more = games_in(tmp_path, "oracle", count=3)
    assert earlier_outcomes(more, notes.append) == []
    assert notes == [
        "note: strong has played 2 of these 3 episodes in an earlier run, and is not compared; name it, too, to play "
        "the others"
    ]


def test_records_that_a_later_run_asks_for_are_written(tmp_path):
    def all_played(records):
        games = games_in(tmp_path / "held", records=records)
        return play_games(games, 1, print, lambda: None)

    first = all_played(None)
    assert all_played(tmp_path / "played") == first
    names = [f"constant-train-{index:07d}.h5" for index in range(2)]
    assert sorted(path.name for path in (tmp_path / "played").iterdir()) == ["constant-asked.json", *names]
    assert [listed.path.name for listed in open_samples(tmp_path / "played").listing] == names
    assert record_file.read(tmp_path / "played" / names[1]).index == 1
    (tmp_path / "played" / names[0]).unlink()
    stamp = (tmp_path / "played" / names[1]).stat().st_mtime_ns
    all_played(tmp_path / "played")
    assert (tmp_path / "played" / names[0]).exists()
    assert (tmp_path / "played" / names[1]).stat().st_mtime_ns == stamp


def test_records_of_another_configuration_are_not_overwritten(tmp_path):
    played, faster = tmp_path / "played", load_config("hold", WET | {"grip.actuator": "ideal"})

    def asked(out, config, name="constant"):
        return games_of(tmp_path / out, config, {name: {}}, "train", range(1), 100, played)

    asked("a", load_config("hold", WET))
    asked("b", load_config("hold", WET))
    with pytest.raises(ConfigError, match="played: holds episodes of another configuration"):
        asked("c", faster)
    (played / "strong-test-0000007.h5").touch()
    with pytest.raises(ConfigError, match=r"played: holds records of strong, and no strong-asked.json"):
        asked("c", faster, "strong")
    assert not (tmp_path / "c").exists()


def test_an_episode_without_a_record_is_not_played_again_for_one(tmp_path):
    games = games_in(tmp_path / "held", records=tmp_path / "played", count=1)
    assert not games[0].is_done
    games[0].path.write_text('{"rejected": "too far"}')
    assert games[0].is_done


MINE = """
from evslip.control.controllers.controller import Controller
{imports}

class Mine(Controller):
    sees = False
    def reset(self, setup):
        self.force_n = {force}
    def step(self, events, senses):
        return self.force_n
"""


@pytest.fixture
def write(tmp_path, monkeypatch):
    """Writes modules of a policy, as an editor would between two commands."""
    monkeypatch.syspath_prepend(tmp_path)
    names = set()

    def write(**texts):
        for name, text in texts.items():
            (tmp_path / f"{name}.py").write_text(text)
        names.update(texts)
        for name in names:
            sys.modules.pop(name, None)

    yield write
    write()


def test_a_policy_that_was_edited_is_not_taken_for_the_one_that_has_played(tmp_path, write):
    held = tmp_path / "held"
    write(own_policy=MINE.format(imports="", force="setup.force_n"))
    played = play_games(games_in(held, "own_policy:Mine", count=1), 1, print, lambda: None)
    assert play_games(games_in(held, "own_policy:Mine", count=1), 1, print, lambda: None) == played
    write(own_policy=MINE.format(imports="", force="2 * setup.force_n"))
    with pytest.raises(
        ConfigError, match=r"episodes/own_policy_Mine: holds episodes of own_policy:Mine before its source was changed"
    ):
        games_in(held, "own_policy:Mine", count=1)
    shutil.rmtree(held / "episodes" / "own_policy_Mine")
    anew = play_games(games_in(held, "own_policy:Mine", count=1), 1, print, lambda: None)
    assert anew[0] == played[0] and anew[1].mean_n > 1.5 * played[1].mean_n


def test_a_policy_that_refers_to_itself_is_gone_when_the_next_game_begins(tmp_path, write):
    circle = "setup.force_n; self.myself = self; alive.append(weakref.ref(self))"
    write(own_policy=MINE.format(imports="import weakref\nalive = []", force=circle))
    games = games_in(tmp_path / "held", "own_policy:Mine")
    gc.disable()
    try:
        for game in games:
            play_game(game)
        alive = [known() for known in sys.modules["own_policy"].alive]
    finally:
        gc.enable()
    assert len(alive) == 2 and alive[0] is None


def test_a_detector_that_was_trained_again_is_not_taken_for_the_one_that_has_played(tmp_path):
    model = shutil.copytree(FOLDER / "default-hold", tmp_path / "model")
    config = load_config("hold", WET | {"camera.width": 346, "camera.height": 260})
    players = {"detector": {"model": str(model)}}
    games_of(tmp_path / "held", config, players, "train", range(1), 100)
    games_of(tmp_path / "held", config, players, "train", range(1), 100)
    with (model / "model.json").open("a") as file:
        file.write("\n")
    with pytest.raises(ConfigError, match="holds episodes of detector before its model was changed"):
        games_of(tmp_path / "held", config, players, "train", range(1), 100)


def test_policies_whose_files_would_have_one_name_are_refused(tmp_path, write):
    text = MINE.format(imports="", force="1.0")
    write(a_b=text, a=f"{text}\nb_Mine = Mine")
    with pytest.raises(ConfigError, match="a_b:Mine, a:b_Mine: two of them have one folder"):
        games_in(tmp_path / "held", "a_b:Mine", "a:b_Mine")


def test_a_parameter_that_no_file_can_note_is_refused(tmp_path, write):
    write(own_policy=MINE.format(imports="", force="1.0").replace("sees = False", "def __init__(self, day): pass"))
    players = {"own_policy:Mine": {"day": date(2020, 1, 1)}}
    with pytest.raises(ConfigError, match=r"controller own_policy:Mine: .* is wrong, expected numbers and texts"):
        games_of(tmp_path / "held", load_config("hold", WET), players, "train", range(1), 100)
    assert not (tmp_path / "held").exists()


def test_what_a_policy_imports_from_its_folder_is_part_of_its_source(write):
    policy = MINE.format(imports="def late():\n    from own_force import FORCE_N\nimport json", force="1.0")
    write(own_policy=policy, own_force="FORCE_N = 1.0", other="")
    first = source_of("own_policy:Mine")
    write(other="import own_policy")
    assert source_of("own_policy:Mine") == first
    write(own_force="FORCE_N = 2.0")
    assert source_of("own_policy:Mine") != first


def test_a_package_is_read_whole_as_far_as_it_imports_itself(tmp_path, monkeypatch):
    package = tmp_path / "own_package"
    (package / "nets").mkdir(parents=True)
    files = {"__init__": "", "policy": MINE.format(imports="from .nets import small", force="1.0"), "unused": ""}
    files |= {"nets/__init__": "from ..base import X", "nets/small": "", "base": "X = 1"}
    for name, text in files.items():
        (package / f"{name}.py").write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    found = {}
    for name in files:
        before = source_of("own_package.policy:Mine")
        with (package / f"{name}.py").open("a") as file:
            file.write("\n")
        found[name] = source_of("own_package.policy:Mine") != before
    assert found == dict.fromkeys(files, True) | {"unused": False}
    for name in [name for name in sys.modules if name.startswith("own_package")]:
        del sys.modules[name]


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ("return None", "step gave None at .* s; expected newtons"),
        ("return float('nan')", "step gave nan at"),
        ("return '2.5'", "step gave '2.5' at"),
        ("return [1.0, 2.0]", r"step gave \[1\.0, 2\.0\] at"),
    ],
)
def test_a_force_that_is_none_is_told_with_policy_and_episode(tmp_path, write, body, words):
    write(own_policy=MINE.format(imports="", force="1.0").replace("return self.force_n", body))
    game = games_in(tmp_path / "held", "own_policy:Mine", count=1)[-1]
    with pytest.raises(ConfigError, match=rf"^own_policy:Mine on train/0: {words}"):
        play_game(game)


def test_a_policy_cannot_change_the_events_of_the_record(tmp_path, write):
    text = MINE.format(imports="", force="1.0").replace("sees = False", "sees = True")
    write(own_policy=text.replace("return self.force_n", "events.t_us[...] -= 1; return self.force_n"))
    game = games_in(tmp_path / "held", "own_policy:Mine", count=1, records=tmp_path / "records")[-1]
    with pytest.raises(ValueError, match="read-only"):
        play_game(game)


def test_a_policy_needs_no_base_class_and_may_have_any_parameter(tmp_path, write):
    text = (
        MINE.format(imports="", force="1.0")
        .replace("(Controller)", "")
        .replace("sees = False", "sees, alarm_of = False, 1")
    )
    write(own_policy=text.replace("def reset", "def __init__(self, name): self.name = name\n    def reset"))
    players = {"own_policy:Mine": {"name": 3}}
    (game,) = games_of(tmp_path / "held", load_config("hold", WET), players, "train", range(1), 100)
    play_game(game)
    assert json.loads(game.path.read_text())["false_alarms"] == 0
    with pytest.raises(ConfigError, match=r"controller constant: .*name"):
        make_controller("constant", name=3)


def test_a_policy_that_cannot_be_made_is_refused_in_one_line(write):
    write(
        own_policy=MINE.format(imports="", force="1.0").replace(
            "sees = False", "def __init__(self): open('no weights')"
        )
    )
    with pytest.raises(
        ConfigError, match=r"controller own_policy:Mine: cannot be made: FileNotFoundError: .*no weights"
    ):
        make_controller("own_policy:Mine")


def test_games_of_other_files_are_not_compared(tmp_path):
    image = tmp_path / "wood.png"
    for grey in (90, 91):
        Image.fromarray(np.full((8, 8), grey, np.uint8)).save(image)
        config = load_config("hold", WET | {"surface.texture": str(image)})
        if grey == 90:
            games_of(tmp_path / "held", config, {"constant": {}}, "train", range(1), 100)
    with pytest.raises(ConfigError, match="holds episodes of another configuration"):
        games_of(tmp_path / "held", config, {"constant": {}}, "train", range(1), 100)
