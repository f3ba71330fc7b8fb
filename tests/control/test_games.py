"""Episodes that controllers play, and figures of them."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from evslip.config.loading import load_config
from evslip.control.candidates import Candidates
from evslip.control.controllers import make_controller
from evslip.control.evaluation.episode_record import record_of
from evslip.control.evaluation.games import games_of, play_games
from evslip.control.evaluation.outcome import Outcome
from evslip.control.evaluation.play import play
from evslip.control.evaluation.summary import summarise, tables
from evslip.data import record_file
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
    assert 60 <= low < 90 < high <= 100
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
