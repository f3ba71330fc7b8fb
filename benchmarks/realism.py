"""How near the events of each camera come to those of a real one: python benchmarks/realism.py RECORDING [MORE...]

The second half of a recording with frames (davis346.aedat4 of the shared folder, say) against events made from its own
frames: every preset of evslip, v2e's clean and noisy defaults by v2e's own rules, and preset files (--camera FILE),
with straight lines between frames and with frames along optical flow. The floor is what two draws of the camera
differ by, the oracle what an exact knowledge of the net change between frames would leave
(docs/explanation/realism.md). Prints Markdown. A row takes a few seconds, with the classifier (--classifier) half a
minute more.
"""

import argparse
from dataclasses import replace
from pathlib import Path

from evslip.events.presets import PRESETS
from evslip.learn.realism.pairs import pair_of_preset, real_recording
from evslip.learn.realism.realism import Realism, compare
from evslip.learn.realism.settings import RealismSettings
from evslip.utils.errors import EvslipError

V2E = ("clean", "noisy")
HEAD = (
    "camera", "between frames", "events, x real", "L1/N, r at 4 x 4, 40 ms", "floor", "L1/N, r at 8 x 8, 80 ms",
    "floor", "KS", "two-sample, %",
)  # fmt: skip


def row(camera: str, between: str, found: Realism) -> str:
    assert found.floor is not None and found.floor_coarse is not None
    tested = found.two_sample
    cells = (
        camera,
        between,
        f"{found.fine.total:.2f}",
        f"{found.fine.l1_per_event:.2f}, {found.fine.correlation:.2f}",
        f"{found.floor.l1_per_event:.2f}",
        f"{found.coarse.l1_per_event:.2f}, {found.coarse.correlation:.2f}",
        f"{found.floor_coarse.l1_per_event:.2f}",
        f"{found.ks:.2f}",
        "" if tested is None else f"{100 * tested.accuracy:.1f} ± {100 * tested.error:.1f}",
    )
    return f"| {' | '.join(cells)} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recordings", type=Path, nargs="+")
    parser.add_argument("--camera", nargs="+", default=list(PRESETS), help="presets, or files of them")
    parser.add_argument("--upsample", type=int, default=20)
    parser.add_argument(
        "--intensity",
        choices=("uint8", "srgb", "linear"),
        help="meaning of the codes; default: linear for files, else uint8",
    )
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--classifier", action="store_true", help="run the two-sample test too")
    parser.add_argument("--whole", action="store_true", help="score the whole recording, not its second half")
    options = parser.parse_args()
    for path in options.recordings:
        score(path, options)


def score(path: Path, options: argparse.Namespace) -> None:
    """Print the table of a recording."""
    recording, _ = real_recording(path)
    frames_us = recording.footage.t_us if recording.footage is not None else ()
    middle_s = None if options.whole or not len(frames_us) else int(frames_us[len(frames_us) // 2]) / 1e6
    base = RealismSettings(
        start_s=middle_s,
        seed=options.seed,
        upsample=options.upsample,
        intensity=options.intensity,
        classifier=options.classifier,
    )
    print(f"\n{path.name}, from {0 if middle_s is None else middle_s:.3f} s on\n")
    print(f"| {' | '.join(HEAD)} |\n{'|---' * len(HEAD)}|", flush=True)
    found = None
    for camera, mode in [*((name, "accurate") for name in options.camera), *((name, "v2e") for name in V2E)]:
        for between in ("linear", "flow"):
            settings = replace(base, interpolate=between, mode=mode)
            title = f"v2e's {camera}" if mode == "v2e" else camera
            try:
                pair = pair_of_preset(path, camera, settings)
            except EvslipError as error:
                print(f"| {title} | {between} | {error} |", flush=True)
                continue
            found = compare(pair, seed=options.seed, classifier=options.classifier)
            print(row(title, between, found), flush=True)
    if found is not None and found.oracle is not None:
        oracle = found.oracle
        print(
            f"| oracle | frames | {oracle.total:.2f} | {oracle.l1_per_event:.2f}, {oracle.correlation:.2f} | | | | | |"
        )


if __name__ == "__main__":
    main()
