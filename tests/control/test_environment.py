"""The environments, as Gymnasium's users meet them."""

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode

import evslip.control  # noqa: F401 - registers them
from evslip.control.observations import OBSERVATIONS
from evslip.utils.errors import ConfigError

SHORT = {
    "robot.kind": "cartesian",
    "motion.kind": "hold",
    "motion.duration_s": 3.0,
    "motion.lift_s": 0.2,
    "motion.lower_s": 0.2,
    "motion.hold_s": 0.3,
    "disturbance.kind": "none",
    "render.max_motion_px": 4.0,
}
UNEVEN = SHORT | {"motion.duration_s": 3.0137, "motion.lift_s": 0.2113, "motion.hold_s": 0.3007}
"""Neither the steps nor the milliseconds of the physics fit into it."""
FLICKER = {"flicker.lamp_depth": 0.3, "flicker.surroundings_depth": 0.3}
SMALL = {"overrides": SHORT, "size": (48, 36), "rate_hz": 50}


def make(name="evslip/Hold-v0", **arguments):
    return gymnasium.make(name, **SMALL | arguments)


def played(env, actions, **reset):
    """Observations, rewards and infos of an episode."""
    found = [(*env.reset(**reset), 0.0)]
    for action in actions:
        observation, reward, terminated, truncated, info = env.step(np.array([action], np.float32))
        found.append((observation, info, reward))
        if terminated or truncated:
            break
    return found


def same(first, second):
    if isinstance(first, dict):
        return first.keys() == second.keys() and all(same(first[key], second[key]) for key in first)
    if isinstance(first, tuple | list):
        return len(first) == len(second) and all(map(same, first, second))
    if isinstance(first, np.ndarray):
        return first.dtype == second.dtype and first.tobytes() == second.tobytes()
    return first == second


@pytest.mark.parametrize("obs", OBSERVATIONS)
def test_gymnasium_finds_nothing_wrong(obs, monkeypatch):
    monkeypatch.setenv("MPLBACKEND", "agg")
    env = make(obs=obs)
    check_env(env.unwrapped)
    env.close()


@pytest.mark.parametrize("name", ["evslip/Hold-v0", "evslip/Lift-v0"])
def test_presets_of_the_environments_can_be_played(name):
    env = gymnasium.make(name, obs="state", rate_hz=20)
    found = played(env, [0.5] * 5, seed=3)
    assert len(found) == 6
    forces = [info["target_n"] for _, info, _ in found]
    assert np.allclose(np.diff(forces), 0.5 * 60 / 20)
    env.close()


def test_an_episode_ends_with_the_command_to_open_and_its_reward_is_the_sum_of_its_terms():
    env = make(obs="state", index=4)
    found = played(env, [0.1] * 1000)
    for _, info, reward in found[1:]:
        assert reward == pytest.approx(sum(info["reward_terms"].values()))
        assert info["index"] >= 4 and info["least_force_n"] > 0
    assert found[-1][1]["t_us"] == env.unwrapped.episode.end_us
    with pytest.raises(ConfigError, match="reset"):
        env.step(np.zeros(1, np.float32))
    env.close()


def test_an_object_that_is_let_go_is_lost_and_costs():
    heavy = SHORT | {"object.mass_kg": 0.1, "grip.force_n": 3.0, "motion.duration_s": 5.0, "motion.hold_s": 0.5}
    env = make(obs="state", overrides=heavy, index=0, weights={"drop": 7.0})
    found = played(env, [-1.0] * 1000)
    *_, (_, info, _) = found
    assert info["is_lost"] and info["reward_terms"]["drop"] == -7.0
    assert info["slips"] >= 1 and info["slide_mm"] > 1
    env.close()


@pytest.mark.parametrize("mode", ["sync", "async"])
def test_equal_seeds_are_equal_episodes_also_in_vector_environments(mode):
    actions = [0.3, -0.2, 0.0, 0.1]
    env = make(obs="combined")
    alone = [played(env, actions, seed=seed) for seed in (11, 12)]
    assert same(alone[0], played(env, actions, seed=11))
    env.close()
    kwargs = {"autoreset_mode": AutoresetMode.SAME_STEP}
    vector = gymnasium.make_vec(
        "evslip/Hold-v0", 2, vectorization_mode=mode, vector_kwargs=kwargs, obs="combined", **SMALL
    )
    observation, _ = vector.reset(seed=[11, 12])
    for step, action in enumerate([None, *actions]):
        if action is not None:
            observation, *_ = vector.step(np.full((2, 1), action, np.float32))
        for k in range(2):
            assert same({name: value[k] for name, value in observation.items()}, dict(alone[k][step][0]))
    vector.close()


def test_an_index_names_an_episode():
    env = make(obs="state")
    first = played(env, [0.0] * 3, seed=1, options={"index": 5})
    assert same(first, played(env, [0.0] * 3, seed=2, options={"index": 5}))
    assert not same(first[0][1], played(env, [], options={"index": 21})[0][1])
    env.close()


def test_observations_show_the_same_events():
    """Counts, voxels and lists of one step agree with one another."""
    seen = {}
    for obs in ("counts", "voxels", "events"):
        env = make(obs=obs, index=1, bins=1)
        seen[obs] = [one for one, _, _ in played(env, [0.0] * 8)]
        events = env.unwrapped.events
        env.close()
    counts, voxels, lists = (seen[name][-1] for name in ("counts", "voxels", "events"))
    assert counts.sum() == lists["count"][0] == len(events) > 0
    assert np.array_equal(counts[0].astype(float) - counts[1], voxels[0])
    n = lists["count"][0]
    assert np.array_equal(lists["x"][:n], events.x) and (lists["t_us"][:n] <= 20_000).all()
    assert not lists["t_us"][n:].any()


def test_a_longer_window_has_the_events_of_several_steps():
    env = make(obs="counts", index=2, window_s=0.06)
    seen = []
    env.reset()
    for _ in range(6):
        observation, *_ = env.step(np.zeros(1, np.float32))
        seen.append((int(observation.sum()), env.unwrapped.episode.events.count))
    assert seen[-1][0] == sum(new for _, new in seen[-3:])
    env.close()


@pytest.mark.parametrize("rate_hz", [20, 125, 1000])
@pytest.mark.parametrize("extra", [{}, FLICKER, {"readout.clock_us": 1000}], ids=["plain", "flicker", "coarse clock"])
def test_every_event_is_in_the_observation_of_the_step_in_which_it_comes(extra, rate_hz):
    env = make(obs="counts", index=2, rate_hz=rate_hz, overrides=UNEVEN | extra)
    env.reset()
    episode, step_us, late = env.unwrapped.episode, 1_000_000 // rate_hz, 0
    while episode.t_us + step_us < episode.end_us:
        since_us = episode.t_us
        observation, *_ = env.step(np.zeros(1, np.float32))
        assert observation.sum() == episode.events.count == env.unwrapped.events.count
        times = env.unwrapped.events.t_us
        assert ((since_us < times) & (times <= episode.t_us)).all() and (np.diff(times) >= 0).all()
        late += int((episode.events.t_us <= since_us).sum())
    assert late or "readout.clock_us" not in extra
    *_, truncated, _ = env.step(np.zeros(1, np.float32))
    assert truncated
    env.close()


@pytest.mark.parametrize("name", ["evslip/Hold-v0", "evslip/Lift-v0"])
@pytest.mark.parametrize("extra", [{}, FLICKER], ids=["plain", "flicker"])
def test_the_last_observation_reaches_to_the_end_and_is_of_a_whole_window(name, extra):
    env = make(name, obs="events", index=2, rate_hz=20, overrides=UNEVEN | extra)
    env.reset()
    episode, truncated = env.unwrapped.episode, False
    while not truncated:
        since_us, earlier = episode.t_us, env.unwrapped.events
        observation, _, _, truncated, _ = env.step(np.zeros(1, np.float32))
    assert 0 < episode.t_us - since_us < 50_000 and episode.t_us == episode.end_us == episode.frame.t_us
    before = int((earlier.t_us > episode.t_us - 50_000).sum())
    assert before > 0 or "Lift" in name  # where little moves
    assert observation["count"][0] == before + episode.events.count
    env.close()


def test_after_the_end_other_light_is_not_seen():
    env = make(index=1, rate_hz=20)
    env.reset()
    episode = env.unwrapped.episode
    episode.advance(episode.end_us, episode.target_n)
    frame = episode.frame
    episode.look_anew(episode.params)
    assert episode.frame is frame
    env.close()


def test_the_force_may_be_the_action():
    env = make(obs="state", action="force", index=0)
    env.reset()
    for _ in range(10):
        *_, info = env.step(np.array([5.0], np.float32))
    assert info["target_n"] == 5.0 and info["force_n"] == pytest.approx(5.0, abs=0.1)
    env.close()


def test_pictures_show_frame_and_events():
    env = make(obs="state", render_mode="rgb_array", index=1)
    env.reset()
    for _ in range(5):
        env.step(np.zeros(1, np.float32))
    picture = env.render()
    assert picture.shape == (36, 48, 3) and picture.dtype == np.uint8
    events = env.unwrapped.events
    assert len(events) and (picture[events.y, events.x].max(1) > 200).all()
    env.close()


@pytest.mark.parametrize("action", [np.array([np.nan]), np.zeros(2), np.zeros(()), "up", None])
def test_an_action_that_is_none_is_refused(action):
    env = make(obs="state", index=0).unwrapped
    env.reset()
    with pytest.raises(ConfigError, match=r"action: .* expected an array of one finite number"):
        env.step(action)
    env.close()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"obs": "pixels"}, "obs: 'pixels' is unknown; expected one of events, counts"),
        ({"action": "jump"}, "action: 'jump' is unknown"),
        ({"rate_hz": 60}, "rate_hz: 60 is wrong; .* 50, 100"),
        ({"index": -1}, "index: -1 is wrong"),
        ({"split": "validation"}, "split: 'validation' is unknown"),
        ({"config": "holding"}, "holding: neither a preset"),
        ({"weights": {"fall": 1.0}}, "weights: 'fall' is unknown; expected some of slip_deg"),
        ({"change": 3}, "change: is no argument .* change_n_s"),
        ({"change_n_s": -1}, "change_n_s: -1 is wrong"),
        ({"size": (3, 3)}, "camera.width: 3 is out of range"),
        ({"size": 48}, "size: 48 is wrong"),
        ({"obs": ["counts"]}, r"obs: \['counts'\] is unknown"),
        ({"index": float("inf")}, "index: inf is wrong, expected a whole number"),
        ({"bins": 2.5}, "bins: 2.5 is wrong, expected a whole number from 1 to 100"),
        ({"most_events": 10.5}, "most_events: 10.5 is wrong, expected a whole number"),
        ({"weights": 3.0}, "weights: 3.0 is wrong, expected some of slip_deg, slip_mm"),
        ({"overrides": "object.mass_kg=1"}, "overrides: 'object.mass_kg=1' is wrong, expected such as"),
        ({"overrides": {1: 2}}, r"overrides: \{1: 2\} is wrong"),
        ({"config": 3}, "config: int, expected a preset's name"),
        ({"rate_hz": np.array([100, 2])}, "rate_hz: .* is wrong"),
        ({"weights": {"drop": float("nan")}}, "weights: drop: nan is wrong, expected a finite number"),
    ],
)
def test_what_is_wrong_is_said(arguments, words):
    with pytest.raises(ConfigError, match=words):
        make(**arguments)


def test_a_window_needs_a_screen(monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "MPLBACKEND"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(ConfigError, match="'human' needs a screen"):
        make(render_mode="human")


def test_wrappers_fit():
    env = gymnasium.wrappers.FlattenObservation(make(obs="combined", index=0))
    env = gymnasium.wrappers.TransformReward(env, lambda reward: reward / 10)
    env = gymnasium.wrappers.RecordEpisodeStatistics(env)
    observation, _ = env.reset(seed=0)
    assert observation.shape == (2 * 48 * 36 + 8,)
    env.step(env.action_space.sample())
    env.close()


@pytest.mark.parametrize("most_n", [70.0, {"min": 5.0, "max": 20.0}])
def test_the_force_that_is_told_is_the_one_that_is_commanded(most_n):
    """However much the gripper, and the object of this episode, bear less than those of others."""
    own = {"robot.gripper": "small", "grip.actuator": "ideal", "grip.most_n": most_n}
    env = make(obs="state", action="force", index=0, overrides=SHORT | own)
    env.reset()
    _, _, _, _, info = env.step(env.action_space.high)
    episode = env.unwrapped.episode
    assert info["target_n"] == episode.senses.force_n == min(episode.params.grip.most_n, 40.0)
    assert info["force_n"] == pytest.approx(info["target_n"]) and info["target_n"] < env.action_space.high[0]


def test_a_short_last_step_costs_what_it_lasts():
    env = gymnasium.make("evslip/Lift-v0", obs="state", rate_hz=20, overrides=UNEVEN).unwrapped
    env.reset(options={"index": 0})
    terminated = truncated = False
    while not (terminated or truncated):
        before_us = env.episode.t_us
        *_, terminated, truncated, info = env.step(np.array([1.0]))
    seconds = (env.episode.t_us - before_us) / 1e6
    excess_n = max(0.0, info["force_n"] - info["least_force_n"]) if env.episode.truth.hangs else 0.0
    assert 0 < seconds < 0.05 and excess_n > 0
    assert info["reward_terms"]["excess"] == pytest.approx(-excess_n * seconds)


def test_numbers_of_numpy_are_numbers():
    given = {"change_n_s": np.float32(3), "window_s": np.float32(0.02), "bins": np.int64(3), "most_events": np.int64(9)}
    gymnasium.make("evslip/Hold-v0", rate_hz=np.int64(50), weights={"drop": np.float32(3)}, **given).close()


def test_after_a_reset_that_failed_there_is_no_episode():
    env = gymnasium.make("evslip/Hold-v0", obs="state", overrides=SHORT).unwrapped
    env.reset(seed=0)
    with pytest.raises(ConfigError, match="index: -2 is wrong"):
        env.reset(options={"index": -2})
    with pytest.raises(ConfigError, match="no episode yet"):
        env.step(np.zeros(1))
