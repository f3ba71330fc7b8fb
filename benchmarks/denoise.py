"""How near denoised frames of the path tracer come to many paths: python benchmarks/denoise.py [--picture FILE.jpg]

A frame of some samples at each number of paths, as it is and denoised, against one of many paths: correlation and rms
error of log luminance over the pixels of the hand camera, processor time of a frame. Prints Markdown. The picture shows
the same frame at the least number of paths, denoised, and with many. Needs the extra [photo].
"""

import argparse
import time
from pathlib import Path

import numpy as np
from PIL import Image

from evslip.config.loading import load_config
from evslip.draws.draw import draw
from evslip.physics.simulation import simulate
from evslip.rendering import recorded_span
from evslip.rendering.camera import hand_camera
from evslip.rendering.pathtrace.mitsuba_scene import MitsubaScene
from evslip.rendering.poses import ScenePoses

DARK = 1e-3
"""Luminance, white = 1, that is added before the logarithm, as the pixels' dark current is."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--preset", default="complex")
    parser.add_argument("--indices", type=int, nargs="+", default=[0, 3])
    parser.add_argument("--paths", type=int, nargs="+", default=[4, 8, 16])
    parser.add_argument("--many", type=int, default=1024)
    parser.add_argument("--picture", type=Path)
    options = parser.parse_args()
    print("| sample | paths a pixel | correlation | rms of ln luminance | CPU-s a frame |")
    print("|---|---|---|---|---|")
    for index in options.indices:
        compare(options, index)


def compare(options: argparse.Namespace, index: int) -> None:
    """Print the rows of a sample."""
    strip = []

    def scene_of(denoise: bool) -> MitsubaScene:
        params = draw(load_config(options.preset, {"render.denoise": denoise}), index, "test")
        trajectory = simulate(params)
        camera = hand_camera(params)
        first_us, last_us = recorded_span(trajectory)
        scene = MitsubaScene(params, camera.pinhole())
        scene.show(ScenePoses(trajectory, camera, np.array([0.5 * (first_us + last_us)])), 0)
        scene.render(1)  # compiles
        return scene

    plain, denoised = scene_of(False), scene_of(True)
    truth = plain.render(options.many)
    white = float(np.percentile(truth, 99))
    for paths in options.paths:
        for name, scene in (("", plain), (", denoised", denoised)):
            started = time.process_time()
            image = scene.render(paths)
            seconds = time.process_time() - started
            a, b = (np.log(picture.mean(-1).ravel() / white + DARK) for picture in (image, truth))
            together, rms = np.corrcoef(a, b)[0, 1], np.sqrt(np.mean((a - b) ** 2))
            print(f"| {index} | {paths}{name} | {together:.4f} | {rms:.3f} | {seconds:.2f} |", flush=True)
            if paths == options.paths[0]:
                strip.append(image)
    if options.picture is not None and index == options.indices[-1]:
        pictures = np.concatenate([*strip, truth], 1)
        codes = 255 * np.clip(pictures / white, 0, 1) ** (1 / 2.2)
        Image.fromarray(codes.astype(np.uint8)).save(options.picture, quality=90)


if __name__ == "__main__":
    main()
