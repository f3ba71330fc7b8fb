"""The fast renderer against the path tracer: same geometry, textures and light.

python benchmarks/fidelity.py [--count 20] [--width 173] [--spp 128] [--picture docs/figures/fidelity.png]

Random scenes of the preset complex, each at one instant of its recorded span. Needs Mitsuba with LLVM or a GPU.

correlation   Pearson's, of ln(luminance + 0.01) over all pixels; then without the gripper's pixels, and against a
              path-traced scene without the arm's links
SSIM          Wang et al. 2004 (Gaussian of 1.5 px), of the sRGB-coded pictures
silhouette    mean distance between the outlines of object and gripper: the area between them over their length, px
shadow        the same for the share of the lamp that table pixels see, 0 to 1: soft edges count by their shift; -, if
              less than 20 px of shadow edge are in view
offset        shift of the outline that fits best, x and y, px: a renderer off by half a pixel shows here
bias          mean difference in ln luminance, fast minus traced, of background, table, object, gripper and arm
"""

import argparse
import tempfile
import warnings
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from PIL import Image
from scipy.ndimage import binary_erosion, gaussian_filter

from evslip.config.loading import load_config
from evslip.config.params import Params
from evslip.draws.draw import draw
from evslip.events.frame import BODIES, GRIPPER, SURFACE
from evslip.physics.simulation import simulate
from evslip.physics.trajectory import Trajectory
from evslip.rendering import exposure_scale, recorded_span
from evslip.rendering.camera import Camera, hand_camera
from evslip.rendering.lens import SPREAD, Lens
from evslip.rendering.pathtrace.mitsuba_scene import MitsubaScene
from evslip.rendering.pathtrace.parts import TABLE
from evslip.rendering.pathtrace.tracer import Pathtracer
from evslip.rendering.pathtrace.variant import SCALAR, describe, mitsuba
from evslip.rendering.poses import ScenePoses
from evslip.rendering.raycast.layers import SHARE
from evslip.rendering.raycast.renderer import Raycaster
from evslip.rendering.raycast.setting import LUMA, channel_of, make_lamp
from evslip.scene.textures.library import linear_to_srgb
from evslip.utils.errors import GraspFailed, PlanRejected

FLOOR = 0.01
GRID = 8
"""Rays along each side of a pixel for the true outline."""
LEAST_EDGE_PX = 20
GOLDEN = 0.6180339887


class Row(NamedTuple):
    correlation: float
    without_gripper: float
    without_arm: float
    ssim: float
    silhouette_px: float
    shadow_px: float
    offset_x: float
    offset_y: float
    bias: tuple[float, ...]


def log(image: np.ndarray) -> np.ndarray:
    return np.log(image + FLOOR)


def correlation(a: np.ndarray, b: np.ndarray, chosen: np.ndarray | None = None) -> float:
    chosen = np.ones(a.shape, bool) if chosen is None else chosen
    return float(np.corrcoef(log(a[chosen]), log(b[chosen]))[0, 1])


def ssim(a: np.ndarray, b: np.ndarray) -> float:
    """Mean structural similarity of pictures in [0, 1]."""

    def mean(image: np.ndarray) -> np.ndarray:
        return gaussian_filter(image, 1.5, truncate=3.5)

    c1, c2 = 0.01**2, 0.03**2
    ma, mb = mean(a), mean(b)
    va, vb, cov = mean(a * a) - ma * ma, mean(b * b) - mb * mb, mean(a * b) - ma * mb
    return float(np.mean((2 * ma * mb + c1) * (2 * cov + c2) / ((ma * ma + mb * mb + c1) * (va + vb + c2))))


def apart(found: np.ndarray, true: np.ndarray, chosen: np.ndarray | None = None) -> tuple[float, float]:
    """Mean distance between the edges of two pictures of shares in pixels, and the length of the true edges."""
    chosen = np.ones(true.shape, bool) if chosen is None else chosen
    length = float(np.hypot(*np.gradient(true))[chosen].sum())
    return float(np.abs(found - true)[chosen].sum()) / max(length, 1e-9), length


def offset(found: np.ndarray, true: np.ndarray) -> tuple[float, float]:
    """The shift (x, y) in pixels that takes `true` closest to `found`, for small ones (Lucas and Kanade 1981)."""
    dy, dx = np.gradient(true)
    normal = np.array([[np.sum(dx * dx), np.sum(dx * dy)], [np.sum(dx * dy), np.sum(dy * dy)]])
    x, y = np.linalg.solve(normal, -np.array([np.sum(dx * (found - true)), np.sum(dy * (found - true))]))
    return float(x), float(y)


def true_cover(scene: MitsubaScene, poses: ScenePoses, camera: Camera) -> np.ndarray:
    """Share of each pixel in which object, hand or fingers are in front, by GRID x GRID rays."""
    mi: Any = mitsuba()
    scene.show(poses, 0)
    steps = (np.arange(GRID) + 0.5) / GRID
    x = ((np.arange(camera.width)[:, None] + steps).ravel() - camera.width / 2) / camera.focal_px
    y = (camera.height / 2 - (np.arange(camera.height)[:, None] + steps).ravel()) / camera.focal_px
    x, y = np.meshgrid(x, y)
    rays = np.stack([x, y, -np.ones_like(x)]).reshape(3, -1)
    rays = poses.camera_rotation[0] @ (rays / np.linalg.norm(rays, axis=0))
    origin = np.repeat(poses.camera_position[0][:, None], rays.shape[1], 1)
    found = scene.scene.ray_intersect(mi.Ray3f(mi.Point3f(origin), mi.Vector3f(rays)))
    near = mi.Bool(False)
    for shape in scene.scene.shapes():
        if shape.id().split("_")[0] in ("object", "hand", "left", "right"):
            near |= found.shape == mi.ShapePtr(shape)
    near = np.array(near & found.is_valid()).reshape(camera.height, GRID, camera.width, GRID)
    return near.mean((1, 3))


def fast_cover(raycaster: Raycaster, poses: ScenePoses) -> np.ndarray:
    """The same share, as the fast renderer has it after `draw`."""
    layers = raycaster._openings.at(poses.travel_m[0]).layers
    share = np.zeros(raycaster.camera.width * raycaster.camera.height)
    pixels = np.repeat(layers.pixels, np.diff(layers.starts))
    np.add.at(share, pixels, layers.fragments[SHARE])
    return 1 - (1 - raycaster._body.total) * (1 - np.minimum(share, 1).reshape(raycaster._body.total.shape))


def lamp_alone(params: Params, white: str) -> Params:
    """The scene in the dark but for the lamp, on a white table."""
    return params.model_copy(
        update={
            "background": params.background.model_copy(update={"luminance_cd_m2": 0.0}),
            "surface": params.surface.model_copy(update={"texture": white}),
        }
    )


def open_lamp(params: Params, camera: Camera, poses: ScenePoses) -> np.ndarray:
    """What the white table would send under the lamp alone if nothing hid it, by the fast renderer's formula."""
    lamp, turn, place = make_lamp(params), poses.camera_rotation[0], poses.camera_position[0]
    rays = camera.rays() @ turn.T
    points = place + rays * (-place[2] / np.minimum(rays[..., 2], -1e-9))[..., None]
    way = lamp.position - points
    distance = np.linalg.norm(way, axis=-1)
    return lamp.luminance * lamp.radius_m**2 * way[..., 2] / distance**3


def shadow_error(traj: Trajectory, camera: Camera, poses: ScenePoses, bodies: np.ndarray, white: str) -> float:
    """Distance between the shadows' edges on the table, in pixels; nan where there are none."""
    params = lamp_alone(traj.params, white)
    lens, travel = Lens(params, camera), float(poses.travel_m[0])
    scene = MitsubaScene(params, lens.pinhole, bounces=2)
    shadowed = _direct(scene, poses, lens, 2 * params.render.spp)
    bare = MitsubaScene(params, lens.pinhole, bounces=2, frames=(TABLE,))
    unshadowed = _direct(bare, poses, lens, 2 * params.render.spp)
    fast = Raycaster(params, camera, travel).draw(poses, 0)[0]
    open_to_lamp = open_lamp(params, camera, poses)
    lit = (unshadowed > 0) & (open_to_lamp > 0)
    table = np.logical_and(binary_erosion(bodies == SURFACE, iterations=3), lit)
    found, true = (
        np.divide(a, b, where=table, out=np.zeros(b.shape)) for a, b in ((fast, open_to_lamp), (shadowed, unshadowed))
    )
    error, length = apart(found, true, binary_erosion(table, iterations=2))
    return error if length > LEAST_EDGE_PX else float("nan")


def _direct(scene: MitsubaScene, poses: ScenePoses, lens: Lens, spp: int) -> np.ndarray:
    scene.show(poses, 0)
    return lens.form(scene.render(spp).mean(-1), 1.0, SPREAD)


def compare(traj: Trajectory, camera: Camera, t_us: int, white: str) -> tuple[Row, np.ndarray]:
    """The measures of one instant, and a picture: fast, traced, and their difference in ln luminance from -1 to 1."""
    params, poses = traj.params, ScenePoses(traj, camera, np.array([t_us]))
    travel = float(poses.travel_m[0])
    fast, tracer = Raycaster(params, camera, travel), Pathtracer(params, camera, travel)
    scale = exposure_scale(fast, traj, camera, recorded_span(traj)[0])
    a, bodies = fast.draw(poses, 0, scale)
    cover, scene = fast_cover(fast, poses), tracer.scene
    traced = tracer.color(poses, 0, scale)
    b = channel_of(traced, LUMA)
    armless = Pathtracer(params, camera, travel, arm=False).draw(poses, 0, scale)[0]
    true = true_cover(scene, poses, camera)
    edge, _ = apart(cover, true)
    bias = tuple(
        float((log(a) - log(b))[bodies == k].mean()) if (bodies == k).any() else float("nan")
        for k in range(len(BODIES))
    )
    row = Row(
        correlation(a, b),
        correlation(a, b, bodies != GRIPPER),
        correlation(a, armless),
        ssim(linear_to_srgb(a), linear_to_srgb(b)),
        edge,
        shadow_error(traj, camera, poses, bodies, white),
        *offset(cover, true),
        bias,
    )
    colors = [linear_to_srgb(fast.color(poses, 0, scale)), linear_to_srgb(traced)]
    difference = np.clip(0.5 + 0.5 * (log(a) - log(b)), 0, 1)[..., None].repeat(3, -1)
    return row, np.round(np.concatenate([*colors, difference], 1) * 255).astype(np.uint8)


def tell(name: str, row: Row) -> str:
    bias = "  ".join(f"{value:6.2f}" for value in row.bias)
    return (
        f"{name:>6}  {row.correlation:11.4f} {row.without_gripper:9.4f} {row.without_arm:9.4f}  {row.ssim:5.3f}  "
        f"{row.silhouette_px:10.3f}  {row.shadow_px:6.2f}  {row.offset_x:6.3f} {row.offset_y:6.3f}  {bias}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--width", type=int, default=173)
    parser.add_argument("--spp", type=int, default=128)
    parser.add_argument("--picture", type=Path)
    parser.add_argument("--shown", type=int, default=4, help="scenes in the picture")
    options = parser.parse_args()
    print(describe())
    if mitsuba().variant() == SCALAR:
        raise SystemExit(f"needs LLVM or a GPU: {SCALAR} cannot intersect rays by the million")
    size = options.width, round(options.width * 260 / 346)
    config = load_config("complex", {"render.spp": options.spp})
    print(
        " scene  correlation   no grip    no arm   SSIM  silhouette  shadow  offset x     y   "
        "bias: background, table, object, gripper, arm"
    )
    rows, pictures, index = [], [], 0
    with tempfile.TemporaryDirectory() as folder:
        white = str(Path(folder) / "white.png")
        Image.new("RGB", (512, 512), "white").save(white)
        while len(rows) < options.count:
            params = draw(config, index)
            try:
                traj = simulate(params)
                start, end = recorded_span(traj)
            except (GraspFailed, PlanRejected):
                index += 1
                continue
            t_us = round(start + (end - start) * ((index + 0.5) * GOLDEN % 1))
            row, picture = compare(traj, hand_camera(params, size), t_us, white)
            rows.append(row)
            pictures.append(picture)
            print(tell(str(index), row), flush=True)
            index += 1
    warnings.simplefilter("ignore", RuntimeWarning)  # columns without a number
    table = np.array([[*row[:-1], *row.bias] for row in rows])
    for name, values in (("mean", np.nanmean(table, 0)), ("median", np.nanmedian(table, 0))):
        print(tell(name, Row(*(float(value) for value in values[:8]), bias=tuple(values[8:].tolist()))))
    worst = np.nanmin(table, 0), np.nanmax(table, 0)
    print(
        f"worst: correlation {worst[0][0]:.4f}, SSIM {worst[0][3]:.3f}, silhouette {worst[1][4]:.3f} px, "
        f"shadow {worst[1][5]:.2f} px"
    )
    if options.picture:
        Image.fromarray(np.concatenate(pictures[: options.shown])).save(options.picture, optimize=True)
        print(options.picture)


if __name__ == "__main__":
    main()
