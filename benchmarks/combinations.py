"""What the physics makes of every combination of a grid, without rendering: held, slipped or rejected.

python benchmarks/combinations.py [--preset simple] [--count N] [--set KEY=VALUE ...]

Printed are the counts for each mass, how long an object hangs in the grip at least, and how many windows of slip a
sample gives at least; then, of the first 5, 10, 20 and 50 samples, how many slip. Exit code 1: a sample was rejected,
or one that slips has no window of slip, or one lies between 0.85 and 1.25 of its onset mass or does not do what that
foretells.
"""

import argparse
import sys
from collections import Counter, defaultdict

import evslip
from evslip.config.loading import parse_override
from evslip.draws.draw import draw, grid_size
from evslip.draws.stratification import SURE_HOLD, SURE_SLIP
from evslip.physics.truth import Truth
from evslip.utils.errors import GraspFailed, PlanRejected
from evslip.windows.cutting import label_of, movements
from evslip.windows.label import Label
from evslip.windows.window_set import WindowSettings


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--preset", default="simple")
    parser.add_argument("--count", type=int, help="samples; default: all combinations")
    parser.add_argument("--set", nargs="*", default=[], metavar="KEY=VALUE")
    options = parser.parse_args()
    config = evslip.load_config(options.preset, dict(map(parse_override, options.set)))
    count = options.count or grid_size(config)
    outcomes: dict[float, Counter[str]] = defaultdict(Counter)
    held_s: dict[float, list[float]] = defaultdict(list)
    windows: dict[float, list[int]] = defaultdict(list)
    slips, unclear = [], []
    for index in range(count):
        params = draw(config, index)
        mass, multiple = params.object.mass_kg, params.object.mass_kg / evslip.onset_mass(params)
        outcome, truth = outcome_of(params)
        outcomes[mass][outcome] += 1
        slips.append(outcome == "slips")
        if truth is not None:
            held_s[mass].append(truth.held.sum() / 1e3)
            windows[mass].append(slip_windows(truth))
        wanted = "holds" if multiple <= SURE_HOLD else "slips" if multiple >= SURE_SLIP else "either"
        if outcome != wanted or (outcome == "slips" and not windows[mass][-1]):
            unclear.append(f"index {index}: {outcome} at {multiple:.2f} times the onset mass")
    print(f"{options.preset}, {count} samples\n")
    print("| mass, kg | outcome | hangs at least, s | windows of slip, at least | in all |")
    print("|---" * 5 + "|")
    for mass, found in sorted(outcomes.items()):
        told = ", ".join(f"{number} {outcome}" for outcome, number in sorted(found.items()))
        least = f"{min(held_s[mass]):.2f} | {min(windows[mass])}" if held_s[mass] else "- | -"
        print(f"| {mass:g} | {told} | {least} | {sum(windows[mass])} |")
    print("\nof the first " + ", ".join(f"{n}: {sum(slips[:n])}" for n in (5, 10, 20, 50) if n < count) + " slip")
    print("\n".join(unclear))
    sys.exit(bool(unclear))


def outcome_of(params: evslip.Params) -> tuple[str, Truth | None]:
    """Holds, slips, or the kind of the rejection; and the ground truth, if there is any."""
    try:
        truth = evslip.measure(evslip.simulate(params))
    except (GraspFailed, PlanRejected) as failure:
        return f"rejected: {failure.kind}", None
    return "holds" if truth.onset_us is None else "slips", truth


def slip_windows(truth: Truth) -> int:
    """Number of windows that are labelled slip."""
    settings = WindowSettings()
    return sum(label_of(movement, settings) == Label.SLIP for movement in movements(truth, settings))


if __name__ == "__main__":
    main()
