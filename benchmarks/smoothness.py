"""Jumps of brightness while things move by 0.05 px a frame: python benchmarks/smoothness.py [--every N]

An edge that moves by 0.05 px takes 20 frames to cross a pixel, so no frame should take much more than a twentieth of
the contrast there. A jump is counted where the log luminance of a pixel changes by more than 0.02 and by more than
12 % of the range in the 3 x 3 pixels around it.
"""

import argparse
import itertools
from collections.abc import Callable
from functools import cache, partial
from typing import NamedTuple

import numpy as np
from scipy.ndimage import maximum_filter

from evslip.config.loading import load_config
from evslip.config.params import Params
from evslip.draws.draw import draw
from evslip.physics.trajectory import Trajectory
from evslip.rendering.camera import hand_camera
from evslip.rendering.lens import SPREAD, expose
from evslip.rendering.poses import ScenePoses
from evslip.rendering.raycast import renderer
from evslip.rendering.raycast.renderer import Raycaster

STEP_PX = 0.05
SMALLEST, SHARE = 0.02, 0.12
PLAIN = {"object.texture": "gradient-0", "surface.texture": "gradient-2", "background.texture": "gradient-3"}
FINE = 5
TEXTURES = ("cardboard-0", "tile-0", "brick-0", "noise-0")
MOTIONS = ("slide", "lift", "turn")
LAMPS = list(itertools.product((60.0, 150.0, 300.0), (25.0, 55.0), (0.3, 1.0, 3.0)))
"""Azimuth and polar angle in degrees, radius in metres."""


class Jumps(NamedTuple):
    pixels: int
    """Pixels looked at, summed over the frames."""
    jumps: int
    beyond: int
    """Those that a converged picture of the same scene does not make as well, by the same limits."""
    worst: float
    """Largest change in log luminance of those beyond."""


def standing(params: Params, frames: int, motion: str) -> Trajectory:
    """The object on the table under the hand, then moved along, up, or turned about the line of sight."""
    k, pixel_m, height = np.arange(frames + 1), 0.27 / hand_camera(params).focal_px, params.object.height_m
    hand = np.tile([0.45, 0.0, height + 0.1034 - 0.01, 0.0, 1.0, 0.0, 0.0], (len(k), 1))
    body = np.tile([0.45, 0.0, height / 2, 1.0, 0.0, 0.0, 0.0], (len(k), 1))
    joints = np.zeros((len(k), 9))
    joints[:, 7:] = params.object.depth_m / 2
    if motion == "slide":
        body[:, 0] += STEP_PX * pixel_m * k
    elif motion == "lift":
        body[:, 2] += STEP_PX * pixel_m * k
    elif motion == "turn":
        half = STEP_PX * pixel_m / height * k
        body[:, 2] += 0.4 * STEP_PX * pixel_m * k
        body[:, 3], body[:, 5] = np.cos(half), np.sin(half)
    elif motion == "camera":
        hand[:, 2] += 0.1
        hand[:, 0] += STEP_PX * pixel_m * k
    return Trajectory(params, k * 1000, hand, body, joints, np.ones((len(k), 2)), np.zeros(len(k)))


def frames_of(params: Params, traj: Trajectory) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Log luminance, body indices and the object's coverage of every frame, each (frames, height, width)."""
    camera = hand_camera(params)
    poses = ScenePoses(traj, camera, traj.t_us)
    raycaster = Raycaster(params, camera, float(poses.travel_m[0]))
    logs, bodies, totals = [], [], []
    for index in range(len(traj.t_us)):
        luminance, body = raycaster.draw(poses, index)
        logs.append(np.log(luminance))
        bodies.append(body)
        totals.append(raycaster._body.total.copy())
    return np.array(logs), np.array(bodies), np.array(totals)


def converged(params: Params, traj: Trajectory) -> np.ndarray:
    """Log luminance (frames, height, width) from FINE x FINE pixels for each one, with the same lens."""
    camera = hand_camera(params)
    fine = hand_camera(params, (camera.width * FINE, camera.height * FINE))
    poses = ScenePoses(traj, fine, traj.t_us)
    renderer.SPREAD = np.float32(0)
    raycaster, logs = Raycaster(params, fine, float(poses.travel_m[0])), []
    for index in range(len(traj.t_us)):
        luminance = raycaster.draw(poses, index)[0].reshape(camera.height, FINE, camera.width, FINE).mean((1, 3))
        spread = np.empty_like(luminance)
        expose(luminance, np.float32(1), SPREAD, np.empty_like(luminance), spread)
        logs.append(np.log(spread))
    renderer.SPREAD = SPREAD
    return np.array(logs)


def highest(values: np.ndarray, reach: int) -> np.ndarray:
    """Maximum over the (2 reach + 1)^2 pixels around each of (frames, height, width)."""
    return maximum_filter(values, (1, 2 * reach + 1, 2 * reach + 1), mode="nearest")


def jumps_in(log: np.ndarray, where: np.ndarray, truth: Callable[[], np.ndarray]) -> Jumps:
    """where (frames - 1, height, width): the pixels that count; truth: makes the converged pictures' log luminance.
    Their own jumps are no faults: those of strokes near the resolution's limit, whose neighbours may be alike for a
    moment, and those at the dark end of strong edges, where a logarithm is steep."""
    high, low = highest(log, 1), -highest(-log, 1)
    contrast = np.maximum(high[1:], high[:-1]) - np.minimum(low[1:], low[:-1])
    change = np.diff(log, axis=0)
    bad = (np.abs(change) > SHARE * contrast) & (np.abs(change) > SMALLEST) & where
    if not bad.any():
        return Jumps(int(where.sum()), 0, 0, 0.0)
    wrong = np.abs(change - np.diff(truth(), axis=0))
    beyond = bad & (wrong > SHARE * contrast) & (wrong > SMALLEST)
    worst = float(np.abs(change)[beyond].max(initial=0.0))
    return Jumps(int(where.sum()), int(bad.sum()), int(beyond.sum()), worst)


def regions(log: np.ndarray, bodies: np.ndarray, totals: np.ndarray) -> dict[str, np.ndarray]:
    """Where the silhouettes, the contact line and the penumbrae are between consecutive frames."""
    partly = (totals > 0) & (totals < 1)
    covered = highest(totals, 2) > 0
    on_surface = highest((bodies == 1).astype(np.uint8), 2) > 0
    below = np.zeros_like(covered)
    for frame, body in enumerate(bodies):  # rows from a little above the object's lowest
        rows = np.flatnonzero((body == 2).any(1))
        below[frame, max(0, rows.max() - 8) :] = True
    contact = covered & on_surface & below
    return {
        "silhouette": (partly & ~contact)[1:],
        "contact line": contact[1:],
        "penumbra": ((bodies == 1) & ~covered)[1:],
    }


def look(shape: str, options: argparse.Namespace) -> dict[str, list[Jumps]]:
    """Jumps by kind of place, one entry a scene."""
    found: dict[str, list[Jumps]] = {}
    size = {"camera.width": options.width, "camera.height": round(options.width * 260 / 346), "object.shape": shape}
    for (azimuth, polar, radius), motion in itertools.product(LAMPS[:: options.every], MOTIONS):
        lamp = {"light.azimuth_deg": azimuth, "light.polar_deg": polar, "light.radius_m": radius}
        lamp["light.luminance_cd_m2"] = 4.5e6 / radius**2
        params = draw(load_config("simple", {**PLAIN, **lamp, **size, "background.luminance_cd_m2": 600.0}), 0)
        traj = standing(params, options.frames, motion)
        log, bodies, totals = frames_of(params, traj)
        truth = cache(partial(converged, params, traj))
        for name, where in regions(log, bodies, totals).items():
            found.setdefault(name, []).append(jumps_in(log, where, truth))
    for texture, motion in itertools.product(TEXTURES, (*MOTIONS, "camera")):
        textures = {f"{part}.texture": texture for part in ("object", "surface", "background")}
        params = draw(load_config("simple", {**textures, **size}), 0)
        traj = standing(params, options.texture_frames, motion)
        log, bodies, totals = frames_of(params, traj)
        inside = -highest(-totals, 1) == 1
        if motion == "camera":
            inside = (bodies < 2) & (highest(totals, 1) == 0)
        found.setdefault("fine texture", []).append(jumps_in(log, inside[1:], partial(converged, params, traj)))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=40, help="frames of each lamp's scene")
    parser.add_argument("--texture-frames", type=int, default=12, help="frames of each fine texture")
    parser.add_argument("--every", type=int, default=1, help="look at every Nth of the 18 lamps")
    parser.add_argument("--width", type=int, default=138, help="columns of the picture")
    parser.add_argument("--shapes", nargs="+", default=["cuboid", "cylinder"])
    options = parser.parse_args()
    for shape in options.shapes:
        print(f"{shape}: pixels x frames, jumps, jumps beyond the converged picture's, the largest of these in log")
        for name, scenes in look(shape, options).items():
            pixels, jumps, beyond = (sum(scene[k] for scene in scenes) for k in range(3))
            print(f"  {name:13} {pixels:10} {jumps:6} {beyond:6} {max(scene.worst for scene in scenes):7.3f}")


if __name__ == "__main__":
    main()
