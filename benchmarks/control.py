"""The closed loop: how fast the environments are, and whether they grow.

python benchmarks/control.py [--episodes 3]       # real time over processor time, by rate, size and observation
python benchmarks/control.py --leak 10000         # memory over so many episodes of senses alone, a few steps each
python benchmarks/control.py --limits FOLDER [--controller detector] [--model default-hold] [--count 200]
                                                  # what perception, actuator and physics cost a controller
"""

import argparse
import gc
import time
from pathlib import Path

import gymnasium
import numpy as np

import evslip.control  # noqa: F401 - registers the environments
from evslip.config.loading import load_config
from evslip.control.controllers.slip_signal import MODEL, TRUTH
from evslip.control.evaluation.games import games_of, play_games
from evslip.control.evaluation.summary import OPEN_LOOP, ORACLE, summarise
from evslip.view.control.page import figure_table

SIZES = ((86, 65), (173, 130), (346, 260))
RATES_HZ = (20, 100, 1000)
LEAK_STEPS = 5


def speed(episodes: int) -> None:
    """A table: seconds of the motion over those of one core that they took, from reset to end, and of steps alone."""
    print("| obs | size | rate, Hz | real time, x | of steps alone, x | a step, ms | reset, s | events a second |")
    print("|---|---|---|---|---|---|---|---|")
    for rate_hz in RATES_HZ:
        line("state", SIZES[-1], rate_hz, episodes)
    for size in SIZES:
        for rate_hz in RATES_HZ:
            line("counts", size, rate_hz, episodes)
    for obs in ("events", "voxels", "combined"):
        line(obs, SIZES[-1], 100, episodes)


def line(obs: str, size: tuple[int, int], rate_hz: int, episodes: int) -> None:
    env = gymnasium.make("evslip/Hold-v0", obs=obs, size=size, rate_hz=rate_hz, split="test")
    env.reset(options={"index": 0})
    env.step(np.zeros(1, np.float32))  # what is compiled is compiled now
    resets = steps = shown = 0.0
    count = events = 0
    for index in range(episodes):
        begun = time.process_time()
        env.reset(options={"index": index})
        resets += time.process_time() - begun
        done, begun = False, time.process_time()
        while not done:
            *_, terminated, truncated, info = env.step(np.zeros(1, np.float32))
            done, count, events = terminated or truncated, count + 1, events + info["events"]
        steps += time.process_time() - begun
        shown += count / rate_hz - shown
    env.close()
    width, height = size
    print(
        f"| {obs} | {width}x{height} | {rate_hz} | {shown / (steps + resets):.2f} | {shown / steps:.2f} | "
        f"{1e3 * steps / count:.2f} | {resets / episodes:.2f} | {events / shown:,.0f} |",
        flush=True,
    )


def leak(episodes: int) -> None:
    """Resident memory along the way."""
    env = gymnasium.make("evslip/Hold-v0", obs="state", rate_hz=20)
    env.reset(seed=0)
    print("| episodes | resident memory, MB |\n|---|---|")
    for episode in range(episodes + 1):
        if episode % max(1, episodes // 10) == 0:
            gc.collect()
            print(f"| {episode} | {resident_mb():.1f} |", flush=True)
        env.reset()
        for _ in range(LEAK_STEPS):
            *_, terminated, truncated, _ = env.step(env.action_space.sample())
            if terminated or truncated:
                break
    env.close()


def limits(folder: Path, controller: str, model: str, count: int) -> None:
    """A table: a controller as it is; with the truth in place of its detector; with an ideal actuator; with both, which
    leaves what the physics costs."""
    found = {}
    for actuator in ("panda", "ideal"):
        config = load_config("hold", {"grip.actuator": actuator})
        for own in (model, TRUTH):
            players = {OPEN_LOOP: {}, ORACLE: {}, controller: {"model": own}}
            perception = "truth" if own == TRUTH else "detector"
            games = games_of(folder / f"{actuator}-{perception}", config, players, "test", range(count))
            outcomes = play_games(games, None, print, lambda: None)
            found[f"{perception}, {actuator} actuator"] = summarise(outcomes)[controller]
    head, *lines = figure_table(found)
    print("| " + " | ".join(head) + " |\n" + "|---" * len(head) + "|")
    for line in lines:
        print("| " + " | ".join(line) + " |")


def resident_mb() -> float:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096 / 1e6


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--episodes", type=int, default=3)
    parser.add_argument("--leak", type=int, default=0)
    parser.add_argument("--limits", type=Path)
    parser.add_argument("--controller", default="detector")
    parser.add_argument("--model", default=MODEL)
    parser.add_argument("--count", type=int, default=200)
    options = parser.parse_args()
    if options.leak:
        leak(options.leak)
    elif options.limits:
        limits(options.limits, options.controller, options.model, options.count)
    else:
        speed(options.episodes)
