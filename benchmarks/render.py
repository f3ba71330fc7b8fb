"""Speed of the fast renderer over whole recorded spans.

python benchmarks/render.py [PRESET] [COUNT] [WIDTH HEIGHT] [KEY=VALUE ...] [outputs]

KEY=VALUE: such as object.shape=cylinder. outputs: with depth, normals and motion.
"""

import argparse
import sys
import time

import numpy as np

from evslip.config.loading import load_config, parse_override
from evslip.draws.draw import draw
from evslip.physics.simulation import simulate
from evslip.rendering import OUTPUTS, render
from evslip.utils.errors import EvslipError


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("words", nargs="*")
    asked = parser.parse_intermixed_args()
    outputs = OUTPUTS if "outputs" in asked.words else ()
    words = [word for word in asked.words if word != "outputs"]
    overrides = dict(parse_override(word) for word in words if "=" in word)
    preset, count, *size = [*(plain := [word for word in words if "=" not in word]), *("complex", "5")[len(plain) :]]
    shape = (int(size[0]), int(size[1])) if size else None
    config = load_config(preset, overrides)
    start = time.perf_counter()
    warm = simulate(draw(config, 0))
    next(render(warm, size=shape))
    print(f"first frame after {time.perf_counter() - start:.1f} s (compiles when the cache is cold)")
    milliseconds, frames = [], []
    for index in range(int(count)):
        traj = simulate(draw(config, index))
        start, begun = time.process_time(), time.perf_counter()
        number = sum(1 for _ in render(traj, size=shape, outputs=outputs))
        spent, waited = (time.process_time() - start) * 1e3, (time.perf_counter() - begun) * 1e3
        milliseconds.append(spent / number)
        frames.append(number)
        print(
            f"sample {index}: {number} frames, {spent / number:.2f} CPU-ms a frame, {spent / 1e3:.2f} CPU-s in all; "
            f"{waited / number:.2f} ms a frame by the clock"
        )
    print(f"mean: {np.mean(frames):.0f} frames a sample, {np.average(milliseconds, weights=frames):.2f} CPU-ms a frame")


if __name__ == "__main__":
    try:
        main()
    except (EvslipError, ValueError) as error:
        sys.exit(f"render.py: {error}")
