"""A sample of another simulator joins: frames and poses become a record, windows, and what a detector says of them.

python examples/other_simulator.py other/

Stands in for a simulator of yours: it draws 60 frames a second of a textured object in a gripper, which turns by 20
degrees from half time on, and writes frames/ and poses.csv. The rest is what you would do with your own folder; one
of the paper's simulator, with isaac_stats.csv, is brought in by the same call.
"""

import argparse
import csv
from pathlib import Path

import numpy as np
from PIL import Image

from evslip.data.recordings import open_samples
from evslip.exchange.importing.recordings import import_recording
from evslip.exchange.importing.settings import Importing
from evslip.windows.label import Label
from evslip.windows.window_set import WindowSettings

SIDES = [f"{side}_{part}" for side in ("gripper", "object") for part in ("x", "y", "z", "qw", "qx", "qy", "qz")]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seconds", type=float, default=2.0)
    parser.add_argument("--turn-deg", type=float, default=20.0)
    arguments = parser.parse_args()
    simulate(arguments.folder / "simulated", arguments.seconds, arguments.turn_deg)

    out = arguments.folder / "record.h5"
    record = import_recording(arguments.folder / "simulated", out, Importing(size=(346, 260), mount="side"))
    assert record.truth is not None  # poses give the ground truth
    print(f"{out}: {record.events.count:,} events, {record.label}, turns by {record.truth.theta_deg.max():.2f} deg")

    windows = open_samples(out).windows(WindowSettings(balance=False))
    windows.save(arguments.folder / "windows.h5")
    print(f"{arguments.folder / 'windows.h5'}: {windows.summary()}")
    for i in range(len(windows)):
        label = "slip" if windows.label[i] == Label.SLIP else "hold"
        print(f"  {windows.start_us[i] / 1e6:5.2f} s  {label}  {windows.rotation_deg[i]:6.2f} deg")


def simulate(folder: Path, seconds: float, turn_deg: float, rate: float = 60.0) -> None:
    """Write frames/ and poses.csv: hand and object in one world frame, metres, quaternions of unit length."""
    (folder / "frames").mkdir(parents=True, exist_ok=True)
    texture = np.random.default_rng(0).integers(40, 220, (12, 12), np.uint8)
    rows = []
    for i in range(round(seconds * rate) + 1):
        t_s = i / rate
        angle = np.radians(turn_deg) * np.clip(2 * t_s / seconds - 1, 0, 1)
        Image.fromarray(picture(texture, angle)).save(folder / "frames" / f"{i:05d}.png")
        gripper = [0.4, 0.0, 0.3 + 0.05 * t_s, 1.0, 0.0, 0.0, 0.0]
        turned = [*gripper[:3], np.cos(angle / 2), 0.0, np.sin(angle / 2), 0.0]
        rows.append([t_s, *gripper, *turned])
    with (folder / "poses.csv").open("w", newline="", encoding="ascii") as file:
        csv.writer(file).writerows([["t_s", *SIDES], *rows])


def picture(texture: np.ndarray, angle: float) -> np.ndarray:
    """A square object before a grey wall, as a camera on the hand sees it; uint8 of shape (260, 346)."""
    y, x = np.indices((260, 346)) - np.array([130.0, 173.0])[:, None, None]
    across = np.cos(angle) * x + np.sin(angle) * y
    down = np.cos(angle) * y - np.sin(angle) * x
    cells = ((np.stack([down, across]) + 90) // 15).astype(int)
    inside = ((cells >= 0) & (cells < 12)).all(0)
    return np.where(inside, texture[tuple(cells.clip(0, 11))], 90).astype(np.uint8)


if __name__ == "__main__":
    main()
