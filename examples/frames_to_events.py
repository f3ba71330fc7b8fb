"""Frames in a file, turned into events by `evslip events`, its preview and plot.

The picture of docs/explanation/event-camera.md.

python examples/frames_to_events.py docs/figures/frames_to_events.png [FOLDER]

FOLDER keeps the files: slip.npz (frames of a renderer, here evslip's own), slip.h5, slip.mp4 and rates.png.
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

import av
import numpy as np
from matplotlib.figure import Figure
from PIL import Image

import evslip

BEFORE_US, AFTER_US = 50_000, 350_000
PICTURE_MS = 10
SHOWN = (8, 18, 32)
"""Pictures of the preview that are drawn."""


def write_clip(path: Path) -> None:
    """Luminance, times and bodies of an object that slips, from shortly before it does."""
    params = evslip.draw(evslip.load_config("complex"), index=0)
    trajectory = evslip.simulate(params)
    onset_us = evslip.measure(trajectory).onset_us
    assert onset_us is not None
    frames = [f for f in evslip.render(trajectory) if onset_us - BEFORE_US <= f.t_us <= onset_us + AFTER_US]
    t_us, luminance, bodies = (np.stack(column) for column in zip(*frames, strict=True))
    np.savez(path, luminance=luminance, t_us=t_us, bodies=bodies)


def draw(folder: Path, out: str) -> None:
    with av.open(str(folder / "slip.mp4")) as container:
        pictures = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
    figure = Figure(figsize=(11, 6.6), layout="constrained")
    axes = figure.subplot_mosaic([list(SHOWN), ["rates"] * len(SHOWN)], height_ratios=(0.72, 1))
    for number in SHOWN:
        axes[number].imshow(pictures[number])
        axes[number].set_title(f"slip.mp4, picture {number}", size=10)
        axes[number].set(xticks=[], yticks=[])
    axes["rates"].imshow(np.asarray(Image.open(folder / "rates.png")))
    axes["rates"].set_axis_off()
    Path(out).parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(out, dpi=100)


def main(out: Path, folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    write_clip(folder / "slip.npz")
    command = f"events slip.npz slip.h5 --preview slip.mp4 --preview-ms {PICTURE_MS} --plot rates.png"
    program = [sys.executable, "-c", "from evslip.cli import main; main()"]
    subprocess.run([*program, *command.split()], cwd=folder, check=True)
    draw(folder, out)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path, nargs="?", default=Path("frames_to_events.png"))
    parser.add_argument("folder", type=Path, nargs="?")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        main(options.out, options.folder or Path(temporary))
