"""What an NVIDIA GPU changes, and whether it gives what the CPU gives: python benchmarks/gpu.py [--only PART ...]

* events: frames as `evslip generate` feeds the camera with (see events.py), and a textured square at 1280x720, by the
  clock: the CPU on one thread and on all cores, and the GPU. "later" counts events whose time differs, by 1 us at most;
  any other difference ends the script with exit code 1.
* training: a step of every network, windows of drifting points (see learn.py), batch 32; what of it is preparing the
  windows on the CPU stands apart. "loss" compares the first step's loss on both.
* tracer: a frame of the hand camera in each variant of Mitsuba that runs here, after one that compiles; "correlation"
  is that of ln luminance with many paths of the first that runs.

Needs the extras [cuda], [learn], [photo], or those of the parts that are named.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from evslip.events import EventCamera, Events
from evslip.utils.errors import EvslipError, MissingExtraError

PARTS = ("events", "training", "tracer")
VARIANTS = ("cuda_ad_rgb", "llvm_ad_rgb", "scalar_rgb")
SAMPLE, PATHS, MANY = ("simple", 0), 16, 1024
REPEATS = 5


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=PARTS, default=PARTS, metavar="PART")
    parser.add_argument("--trace", nargs=3, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.trace:
        return trace(*options.trace)
    parts: dict[str, Callable[[], bool]] = {"events": events, "training": training, "tracer": tracer}
    try:
        held = [parts[name]() for name in options.only]
    except EvslipError as error:
        print(f"gpu.py: {error}", file=sys.stderr)
        return 2
    return int(not all(held))


def seconds(work: Callable[[], object], repeats: int = REPEATS) -> float:
    """Least time of a call by the clock, after one that compiles."""
    work()
    times = []
    for _ in range(repeats):
        started = time.perf_counter()
        work()
        times.append(time.perf_counter() - started)
    return min(times)


def events() -> bool:
    """Print the rows of films; whether the GPU's events are those of the CPU."""
    from events import Film, make_clip, rendered_films

    EventCamera("clean", size=(8, 8), device="cuda")  # a missing GPU is said before anything is drawn
    clip = make_clip((1280, 720), 120)
    films = [*rendered_films([1]), Film("square 1280x720", 500.0 * np.arange(len(clip)), clip)]
    cores = len(os.sched_getaffinity(0))
    print(f"| frames | pixels | million events | 1 thread, Mpixel/s | {cores} threads | GPU | GPU/1 thread | later |")
    print("|---|---|---|---|---|---|---|---|")
    equal = True
    for film in films:
        for preset in ("clean", "davis346"):
            size = (film.floats.shape[2], film.floats.shape[1])
            frames = list(zip(film.times_us, film.floats, strict=True))

            def run(frames=frames, size=size, preset=preset, **device) -> Events:
                return EventCamera(preset, size=size, **device).run(frames)

            cpu, gpu = run(), run(device="cuda")
            later = difference(cpu, gpu)
            equal = equal and later is not None
            speeds = [
                film.floats.size / 1e6 / seconds(partial(run, **how))
                for how in ({"threads": 1}, {"threads": cores}, {"device": "cuda"})
            ]
            one, all_cores, there = speeds
            print(
                f"| {film.name} | `{preset}` | {cpu.count / 1e6:.2f} | {one:.0f} | {all_cores:.0f} | {there:.0f} "
                f"| {there / one:.1f} | {'DIFFERENT' if later is None else later} |",
                flush=True,
            )
    print()
    return equal


def difference(cpu: Events, gpu: Events) -> int | None:
    """Events whose times differ, by a microsecond at most; None for any other difference."""
    if cpu.count != gpu.count:
        return None
    orders = [np.lexsort((one.t_us, one.x, one.y)) for one in (cpu, gpu)]
    for name in ("x", "y", "p", "cause"):
        a, b = (getattr(one, name)[order] for one, order in zip((cpu, gpu), orders, strict=True))
        if not np.array_equal(a, b):
            return None
    gaps = np.abs(cpu.t_us[orders[0]] - gpu.t_us[orders[1]])
    return int((gaps > 0).sum()) if gaps.max(initial=0) <= 1 else None


class Step(NamedTuple):
    """A training step on one device."""

    ms: float
    preparing_ms: float
    loss: float


def training() -> bool:
    """Print the rows of networks; whether the first losses agree."""
    import torch
    from learn import made_up

    from evslip.learn import NETWORKS

    if not torch.cuda.is_available():
        raise MissingExtraError("training: torch sees no NVIDIA GPU; the plain torch of the package index brings CUDA")
    windows = [made_up(seed) for seed in range(32)]
    print("| network | CPU, ms a step | GPU | CPU/GPU | of it preparing, on the CPU | loss on both |")
    print("|---|---|---|---|---|---|")
    agree = True
    for name in NETWORKS:
        cpu, gpu = (step_on(device, name, windows) for device in ("cpu", "cuda"))
        if cpu is None or gpu is None:
            continue
        agree = agree and bool(np.isclose(cpu.loss, gpu.loss, rtol=1e-3, atol=1e-4))
        print(
            f"| `{name}` | {cpu.ms:.1f} | {gpu.ms:.1f} | {cpu.ms / gpu.ms:.1f} | {gpu.preparing_ms:.1f} "
            f"| {cpu.loss:.4f}, {gpu.loss:.4f} |",
            flush=True,
        )
    print()
    return agree


def step_on(device: str, name: str, windows: list) -> Step | None:
    """None for a network that is found without gradients."""
    import torch

    from evslip.learn import build_model
    from evslip.learn.networks.speed_network import SpeedNetwork

    torch.manual_seed(0)
    network = build_model(name)
    if not any(parameter.requires_grad for parameter in network.parameters()):
        return None
    network.to(device).train()
    for module in network.modules():
        if isinstance(module, torch.nn.Dropout):
            module.p = 0.0  # random numbers differ between devices
    labels = (torch.arange(len(windows)) % 2).to(device)
    more = (torch.full((len(windows), 2), 5.0, device=device),) if isinstance(network, SpeedNetwork) else ()
    optimiser = torch.optim.AdamW(network.parameters(), lr=1e-5)

    def prepared() -> list:
        return [network.prepare(window) for window in windows]

    def step() -> float:
        optimiser.zero_grad()
        loss = network.step(prepared(), labels, 0.0, *more)[0]
        loss.backward()
        optimiser.step()
        return loss.item()

    loss = step()
    return Step(1e3 * seconds(step), 1e3 * seconds(prepared), loss)


def tracer() -> bool:
    """Print the rows of variants; whether the GPU traced."""
    print(f"| variant | s a frame of {PATHS} paths a pixel | correlation with {MANY} paths |")
    print("|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        truth, traced = None, False
        for variant in VARIANTS:
            file = Path(folder) / f"{variant}.npy"
            paths = MANY if truth is None else 0
            command = [sys.executable, __file__, "--trace", variant, str(file), str(paths)]
            run = subprocess.run(command, capture_output=True, text=True, check=False)
            if run.returncode:
                print(f"| `{variant}` | does not run here: {run.stderr.strip().splitlines()[-1][:160]} | |")
                continue
            traced = traced or variant == "cuda_ad_rgb"
            frame = np.load(file)
            truth = np.load(file.with_suffix(".many.npy")) if truth is None else truth
            print(f"| `{variant}` | {run.stdout.strip()} | {np.corrcoef(frame.ravel(), truth.ravel())[0, 1]:.4f} |")
    return traced


def trace(variant: str, file: str, many: str) -> int:
    """Trace one frame in this process, which keeps its variant: print seconds, write ln luminance, and that of many
    paths, if there shall be any."""
    os.environ["EVSLIP_MITSUBA_VARIANT"] = variant
    from evslip.config.loading import load_config
    from evslip.draws.draw import draw
    from evslip.physics.simulation import simulate
    from evslip.rendering import recorded_span
    from evslip.rendering.camera import hand_camera
    from evslip.rendering.pathtrace.mitsuba_scene import MitsubaScene
    from evslip.rendering.poses import ScenePoses

    preset, index = SAMPLE
    trajectory = simulate(draw(load_config(preset), index))
    camera = hand_camera(trajectory.params)
    scene = MitsubaScene(trajectory.params, camera.pinhole())
    middle_us = 0.5 * sum(recorded_span(trajectory))
    scene.show(ScenePoses(trajectory, camera, np.array([middle_us])), 0)

    def logs(paths: int) -> np.ndarray:
        light = scene.render(paths).mean(2)
        return np.log(light / np.percentile(light, 99) + 1e-3)

    np.save(file, logs(PATHS))
    print(f"{seconds(lambda: scene.render(PATHS), 1):.3f}")
    if int(many):
        np.save(Path(file).with_suffix(".many.npy"), logs(int(many)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
