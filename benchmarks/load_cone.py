"""How the least force that holds changes within an episode that nothing disturbs: with nothing known of the hand, with
the load that its accelerometer feels, and by an ellipsoid for the pads' limit surface, fitted to the episode.

Along the pads, the load is a force and a torque, both linear in the reading (x, z) of the accelerometer: the least
force is the root of a form a x^2 + b x z + c z^2, with three numbers that are the object's own.
"""

import argparse

import numpy as np

from evslip.control.candidates import Candidates
from evslip.control.controllers.oracle import ConeOracle
from evslip.control.evaluation.play import play
from evslip.utils.errors import GraspFailed, PlanRejected

STEP_US = 5000
TILTED_DEG = 5.0
"""Range of the hand's tilt from which on it is a tilted one."""


class Listener(ConeOracle):
    """An oracle that notes what the hand's accelerometer reads."""

    def reset(self, setup):
        super().reset(setup)
        self.accelerations = []
        self.tilts_deg = []

    def step(self, events, senses):
        self.accelerations.append(senses.acceleration_m_s2)
        self.tilts_deg.append(np.degrees(senses.tilt_rad))
        return super().step(events, senses)


def variations(least_n: np.ndarray, acceleration: np.ndarray) -> list[float]:
    """Spread over mean, in %, of the least force, of it over the load, and of it over the ellipsoid's."""
    x, z = acceleration[:, 0], acceleration[:, 2]
    # Its square is linear in the three numbers.
    terms = np.stack([x * x, x * z, z * z], axis=1) / least_n[:, None]
    fitted = np.linalg.lstsq(terms, least_n, rcond=None)[0]
    ellipsoid = np.sqrt(np.maximum(terms @ fitted * least_n, 1e-12))
    ratios = least_n, least_n / np.linalg.norm(acceleration, axis=1), least_n / ellipsoid
    return [100 * float(ratio.std() / ratio.mean()) for ratio in ratios]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=40, help="candidates of the test split")
    options = parser.parse_args()
    if options.count < 1:
        parser.error(f"--count is {options.count}; expected 1 or more")
    candidates = Candidates("hold", {"disturbance.kind": "none"}, split="test")
    rows: dict[bool, list[list[float]]] = {True: [], False: []}
    for index in range(options.count):
        listener = Listener()
        try:
            played = play(candidates.make(index, STEP_US, sees=False), listener, STEP_US, candidates.forces_n, False)
        except (PlanRejected, GraspFailed):
            continue
        hangs = played.hangs & (played.least_n > 0)
        tilted = bool(np.ptp(listener.tilts_deg) >= TILTED_DEG)
        rows[tilted].append(variations(played.least_n[hangs], np.array(listener.accelerations)[hangs]))
    print("| hand | episodes | least force, % | over the load, % | over the ellipsoid's, % |\n|---|---|---|---|---|")
    for tilted, found in rows.items():
        cells = " | ".join(f"{value:.1f}" for value in np.median(found, axis=0)) if found else "– | – | –"
        print(f"| {f'tilts by {TILTED_DEG:g}° or more' if tilted else 'is level'} | {len(found)} | {cells} |")


if __name__ == "__main__":
    main()
