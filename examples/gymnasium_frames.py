"""What an event camera would see of a Gymnasium environment: pip install 'gymnasium[classic-control]'.

python examples/gymnasium_frames.py events.h5 [--env CartPole-v1] [--steps 200]
"""

import argparse
import sys
from pathlib import Path

import numpy as np

from evslip.codecs import write_events
from evslip.events import EventCamera, concatenate

GREY = (0.2126, 0.7152, 0.0722)


def main(out: Path, name: str, steps: int) -> None:
    env = make(name)
    env.reset(seed=0)
    env.action_space.seed(0)
    image = env.render()
    size = (image.shape[1], image.shape[0])
    camera = EventCamera("dvxplorer", size=size, intensity="srgb")
    # Environments rarely say how long a step is; their films say how fast they are shown.
    step_us = 1e6 / env.metadata.get("render_fps", 30)
    parts = [camera.step(0, image @ GREY)]
    for number in range(1, steps + 1):
        _, _, terminated, truncated, _ = env.step(env.action_space.sample())
        if terminated or truncated:
            env.reset()
            camera.reset()
        parts.append(camera.step(number * step_us, env.render() @ GREY))
    env.close()
    events = concatenate(parts)
    write_events(out, events, size)
    print(f"{out}: {events.count:,} events from {steps + 1} frames of {name}, {events.p.mean():.0%} ON")


def make(name: str):
    """The environment, rendering into arrays, or one line that says what it needs."""
    try:
        import gymnasium
    except ModuleNotFoundError:
        sys.exit("this example needs Gymnasium: pip install 'gymnasium[classic-control]'")
    try:
        env = gymnasium.make(name, render_mode="rgb_array")
        env.reset()
        assert np.ndim(env.render()) == 3
    except gymnasium.error.Error as error:
        sys.exit(f"gymnasium: {' '.join(str(error).split())}")
    return env


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--env", default="CartPole-v1")
    parser.add_argument("--steps", type=int, default=200)
    options = parser.parse_args()
    main(options.out, options.env, options.steps)
