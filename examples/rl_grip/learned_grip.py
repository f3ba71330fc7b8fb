"""A grip force that is learned by reinforcement: pip install 'evslip[control,view]' stable-baselines3

python learned_grip.py [--minutes 26] [--out policy.npz]     # learns, draws curve.png
evslip control --policy learned_grip:Learned --count 20 --rate-hz 25 --set camera.width=86 --set camera.height=65

Proximal policy optimisation (Schulman et al. 2017) by Stable-Baselines3. The agent sees, 25 times a second, how many
events came in each of 8 x 6 parts of a small picture, in this step and the three before, and what the hand feels. The
weights are plain arrays, so a robot needs neither PyTorch nor Stable-Baselines3.
"""

import argparse
import importlib.util
import os
import sys
import time
from collections import deque
from pathlib import Path

import gymnasium
import numpy as np
from gymnasium import spaces

import evslip.control  # noqa: F401 - registers the environments
from evslip.control.controllers.controller import Controller

SIZE, RATE_HZ, CHANGE_N_S, STEPS = (86, 65), 25, 20.0, 4
COLUMNS, ROWS = 8, 6
WEIGHTS = Path(os.environ.get("LEARNED_GRIP", Path(__file__).with_name("policy.npz")))


class Features:
    """What the agent sees: events of the last steps in parts of the picture, logarithmic, and the hand's senses."""

    length = STEPS * COLUMNS * ROWS + 6

    def __init__(self):
        self._steps = deque([np.zeros(COLUMNS * ROWS, np.float32)] * STEPS, STEPS)

    def __call__(self, counts: np.ndarray, senses: np.ndarray) -> np.ndarray:
        """From counts (height, width) of a step's events and the senses (8,): float32 of shape (length,)."""
        height, width = counts.shape
        rows, columns = np.arange(height) * ROWS // height, np.arange(width) * COLUMNS // width
        parts = np.zeros((ROWS, COLUMNS), np.float32)
        np.add.at(parts, (rows[:, None], columns), counts)
        self._steps.append(np.log1p(parts).ravel() / 5)
        left, right, _, *acceleration, _, force = senses
        felt = [(left + right) / 20, force / 10, *(np.array(acceleration) / 10), 1.0]
        return np.concatenate([*self._steps, np.array(felt, np.float32)]).astype(np.float32)


class Seen(gymnasium.ObservationWrapper):
    """An environment whose observations are `Features`."""

    def __init__(self, env: gymnasium.Env):
        super().__init__(env)
        self.observation_space = spaces.Box(-np.inf, np.inf, (Features.length,), np.float32)
        self._features = Features()

    def reset(self, **options):
        self._features = Features()
        return super().reset(**options)

    def observation(self, observation):
        return self._features(observation["counts"].astype(np.float32).sum(0), observation["state"])


class Learned(Controller):
    """The policy that was learned, for `evslip control` and for a robot."""

    def reset(self, setup):
        self.setup, self.force_n, self._features = setup, setup.force_n, Features()
        with np.load(WEIGHTS) as file:  # plain arrays: numpy refuses pickled ones
            self._layers = [(file[f"weight{i}"], file[f"bias{i}"]) for i in range(3)]

    def step(self, events, senses):
        width, height = self.setup.size
        place = events.y.astype(np.intp) * width + events.x
        counts = np.bincount(place, minlength=width * height).reshape(height, width).astype(np.float32)
        values = self.features = self._features(counts, senses.vector())
        for number, (weight, bias) in enumerate(self._layers):
            values = weight @ values + bias
            values = np.tanh(values) if number < 2 else values
        self.action = float(np.clip(values[0], -1, 1))
        change = self.action * CHANGE_N_S * self.setup.step_us / 1e6
        self.force_n = self.setup.allowed(self.force_n + change)
        return self.force_n


def environment() -> gymnasium.Env:
    return gymnasium.make(
        "evslip/Hold-v0", obs="combined", rate_hz=RATE_HZ, size=SIZE, change_n_s=CHANGE_N_S, weights={"drop": 20.0}
    )


def make() -> gymnasium.Env:
    from stable_baselines3.common.monitor import Monitor

    return Monitor(Seen(environment()))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=26.0)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--out", type=Path, default=WEIGHTS)
    options = parser.parse_args()
    if importlib.util.find_spec("stable_baselines3") is None:
        sys.exit("learned_grip: Stable-Baselines3 is missing: pip install stable-baselines3")
    import torch
    from stable_baselines3 import PPO
    from stable_baselines3.common.callbacks import BaseCallback
    from stable_baselines3.common.vec_env import SubprocVecEnv, VecNormalize

    class Until(BaseCallback):
        """Stops in time, and notes how every episode went."""

        begun, episodes = time.monotonic(), []

        def left(self) -> float:
            """Share of the time that is left."""
            return max(0.0, 1 - (time.monotonic() - self.begun) / (60 * options.minutes))

        def _on_step(self) -> bool:
            for info in self.locals["infos"]:
                if "episode" in info:
                    self.episodes.append((self.num_timesteps, info["episode"]["r"]))
            return self.left() > 0

    torch.set_num_threads(1)
    course = Until()
    envs = VecNormalize(SubprocVecEnv([make] * options.workers, "spawn"), norm_obs=False, gamma=0.98)
    agent = PPO(
        "MlpPolicy", envs, n_steps=512, batch_size=128, gamma=0.98, seed=0, device="cpu",
        learning_rate=lambda _: 5e-4 * max(0.02, course.left()), policy_kwargs={"log_std_init": -1.0}, verbose=1,
    )  # fmt: skip
    agent.learn(10**9, callback=course)
    layers = [*agent.policy.mlp_extractor.policy_net[::2], agent.policy.action_net]
    arrays = {f"weight{i}": layer.weight.detach().numpy() for i, layer in enumerate(layers)}
    np.savez(options.out, **arrays, **{f"bias{i}": layer.bias.detach().numpy() for i, layer in enumerate(layers)})
    envs.close()
    if not course.episodes:
        sys.exit(f"learned_grip: no episode ended in {options.minutes:g} minutes; give it more")
    draw(np.array(course.episodes), options.out.with_name("curve.png"))
    print(f"{options.out}: {agent.num_timesteps} steps, {len(course.episodes)} episodes")


def draw(episodes: np.ndarray, path: Path) -> None:
    """Reward of each episode, and the mean of fifty."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6, 3.4), layout="constrained")
    axes = figure.subplots()
    axes.plot(episodes[:, 0], episodes[:, 1], ".", ms=3, color="tab:gray", label="an episode")
    if len(episodes) >= 50:
        mean = np.convolve(episodes[:, 1], np.ones(50) / 50, "valid")
        axes.plot(episodes[49:, 0], mean, color="tab:orange", label="mean of 50")
    axes.set(xlabel="steps of 40 ms", ylabel="reward")
    axes.set_ylim(np.percentile(episodes[:, 1], 5) - 5, 0)
    axes.legend()
    axes.grid(alpha=0.3)
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    main()
