"""Time and memory of `evslip events`: python benchmarks/clips.py [--seconds S S ...]

A soft bar crosses 288 x 192 pixels, filmed at 1000 Hz into an .npz file; camera noisy, output HDF5, without and with a
preview. Each run is a process of its own; memory is the peak of its resident set (Linux), compiled code included.
"""

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

WIDTH, HEIGHT = 288, 192
RUN = """
import re, sys
from functools import partial
from pathlib import Path
from evslip.exchange.frames_to_events import FrameConversion, convert_frames, open_frames
from evslip.view.pictures.preview import preview
conversion = FrameConversion(clip=Path(sys.argv[1]), camera="noisy")
clip = open_frames(conversion)
watchers = [partial(preview, Path(path), clip.size, picture_ms=1000 / 30) for path in sys.argv[3:]]
made = convert_frames(conversion, clip, Path(sys.argv[2]), watchers=watchers)
print(made.events, re.search(r"VmHWM:\\s+(\\d+)", Path("/proc/self/status").read_text())[1])
"""


def write_clip(path: Path, seconds: float) -> int:
    """Returns the number of frames."""
    x = np.arange(WIDTH)
    rows = np.linspace(25, 75, HEIGHT)[:, None]
    frames = np.stack([rows + 150 * np.exp(-(((x - 7 * n % WIDTH) / 15) ** 2)) for n in range(288)]).astype(np.uint8)
    count = int(1000 * seconds)
    np.savez_compressed(path, frames=np.resize(frames, (count, HEIGHT, WIDTH)), t_us=1000 * np.arange(count))
    return count


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, nargs="+", default=(0.3, 3.0, 12.0))
    options = parser.parse_args()
    print("| frames | preview | M events | s | Mpixel/s | peak, MB |\n|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        clip, out, preview = (Path(folder) / name for name in ("clip.npz", "e.h5", "p.mp4"))
        for seconds in options.seconds:
            count = write_clip(clip, seconds)
            for extra in ([], [preview]):
                command = [sys.executable, "-c", RUN, clip, out, *extra]
                start = time.perf_counter()
                result = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=True)
                took = time.perf_counter() - start
                events, peak = map(int, result.stdout.split())
                speed = count * WIDTH * HEIGHT / took / 1e6
                row = f"{events / 1e6:.1f} | {took:.1f} | {speed:.0f} | {peak / 1024:.0f}"
                print(f"| {count} | {'yes' if extra else 'no'} | {row} |", flush=True)


if __name__ == "__main__":
    main()
