"""Events that shadows make: python benchmarks/shadow_events.py [--count N] [--window SECONDS]

Pieces of random samples of `complex`, as in event_fidelity.py, are filmed as `evslip generate` does and with simpler
shadows, noiseless pixels each time; the table tells how many of the events are others. Columns as there.
"""

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from event_fidelity import CAMERAS, differences, fast, filmed, pieces

from evslip.config.loading import load_config
from evslip.draws.draw import draw
from evslip.physics.simulation import simulate
from evslip.rendering.camera import hand_camera
from evslip.rendering.geometry.hand import Boxes
from evslip.rendering.raycast import renderer
from evslip.rendering.shadows.casters import ARM_PART
from evslip.utils.errors import GraspFailed

CAST, ILLUMINATE = renderer.cast, renderer.illuminate


def links_as_boxes(lamp, radius_m, boxes, parts, numbers, outlines):
    return CAST(lamp, radius_m, boxes, parts, np.where(parts == ARM_PART, -1, numbers), outlines)


def no_links(lamp, radius_m, boxes, parts, numbers, outlines):
    kept = parts != ARM_PART
    return CAST(lamp, radius_m, Boxes(*(part[kept] for part in boxes)), parts[kept], numbers[kept], outlines)


def no_blockers(view, sky_turn, setting, casters, blockers, parts, standing):
    none = Boxes(*(part[:0] for part in blockers))
    return ILLUMINATE(view, sky_turn, setting, casters, none, parts[:0], standing)


VARIANTS: dict[str, tuple[Any, Any]] = {
    "links' shadows as those of boxes": (links_as_boxes, ILLUMINATE),
    "no shadows of links": (no_links, ILLUMINATE),
    "no light kept away by bodies nearby": (CAST, no_blockers),
}


@contextmanager
def drawn_with(cast: Any, illuminate: Any) -> Iterator[None]:
    renderer.cast, renderer.illuminate = cast, illuminate
    try:
        yield
    finally:
        renderer.cast, renderer.illuminate = CAST, ILLUMINATE


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=8, help="samples")
    parser.add_argument("--window", type=float, default=0.04, help="length of a piece in seconds")
    options = parser.parse_args()
    sums, counts = {name: np.zeros((len(CAMERAS), 4)) for name in VARIANTS}, np.zeros(len(CAMERAS))
    for index in range(options.count):
        try:
            traj = simulate(draw(load_config("complex"), index))
        except GraspFailed:
            continue  # no events
        camera = hand_camera(traj.params)
        for start, end in pieces(traj, round(1e6 * options.window)).values():
            as_it_is, _ = filmed(fast(traj, start, end), (camera.width, camera.height))
            counts += [events.count for events in as_it_is]
            for name, functions in VARIANTS.items():
                with drawn_with(*functions):
                    found, _ = filmed(fast(traj, start, end), (camera.width, camera.height))
                sums[name] += [differences(events, truth) for events, truth in zip(found, as_it_is, strict=True)]
    print("| drawn instead | " + " | ".join(f"{name}: total, pixels, 8x8, bins" for name in CAMERAS) + " |")
    print("|---|" + "---|" * len(CAMERAS))
    for name, found in sums.items():
        shares = found / np.maximum(counts, 1)[:, None]
        print(f"| {name} | " + " | ".join(", ".join(f"{value:.3f}" for value in row) for row in shares) + " |")


if __name__ == "__main__":
    main()
