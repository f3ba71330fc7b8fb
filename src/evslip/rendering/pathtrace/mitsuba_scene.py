"""The scene inside Mitsuba: built once, moved for each frame."""

import math
from collections.abc import Collection, Sequence
from typing import Any

import numpy as np

from evslip.config.params import Params
from evslip.rendering.camera import Camera
from evslip.rendering.distractors.distractor import Distractor
from evslip.rendering.geometry.hand import finger_place, finger_turn
from evslip.rendering.pathtrace.denoising import AOVS, Denoiser
from evslip.rendering.pathtrace.materials import bsdf, lamp, sky
from evslip.rendering.pathtrace.parts import FINGERS, HAND, LINKS, OBJECT, Part, names_of, parts_of
from evslip.rendering.pathtrace.variant import mitsuba
from evslip.rendering.poses import ScenePoses
from evslip.scene.textures import library

BOUNCES = 8
"""Longest path of light, from the lamp to the camera, in segments."""
MOST_PATHS = 1 << 24
"""Traced at a time: bounds the memory."""
SURFACE_SPP = 4
"""Rays a pixel for albedo and normal, which the denoiser looks at."""
UNDER_M = np.array([0.0, 0.0, -5.0])
NEAR_M, FAR_M = 0.01, 1e5


class MitsubaScene:
    """Meshes, lights and camera of one sample, and the instant that they show."""

    def __init__(
        self, params: Params, camera: Camera, *, arm: bool = True, bounces: int = BOUNCES,
        frames: Collection[str] | None = None, distractors: Sequence[Distractor] = (),
    ):  # fmt: skip
        """camera: a pinhole; arm: whether the arm's links are there; bounces: longest path; frames: of all parts, only
        those that move with these (see `parts.Part`); distractors: those of the poses that are shown. Raises
        ConfigError, MissingExtraError."""
        self._mi = mi = mitsuba()
        parts = parts_of(params, arm, distractors, camera.fingers)
        parts = [part for part in parts if frames is None or part.frame in frames]
        self._parts = {f"{part.frame}_{k}": part for k, part in enumerate(parts)}
        background = library.load(params.background.texture, is_background=True)
        meshes = {name: _mesh(mi, name, part) for name, part in self._parts.items()}
        fov = math.degrees(2 * math.atan(camera.width / 2 / camera.focal_px))
        film = {
            "type": "hdrfilm", "width": camera.width, "height": camera.height, "pixel_format": "rgb",
            "component_format": "float32", "rfilter": {"type": "box"},
        }  # fmt: skip
        sensor = {
            "type": "perspective", "fov": fov, "fov_axis": "x", "near_clip": NEAR_M, "far_clip": FAR_M, "film": film,
            "sampler": {"type": "multijitter"},
        }  # fmt: skip
        self.integrator = mi.load_dict({"type": "path", "max_depth": bounces})
        self._denoiser = Denoiser() if params.render.denoise else None
        self._surfaces = mi.load_dict({"type": "aov", "aovs": AOVS})
        self._per_white = 1.0 / white_luminance(params)
        # A dark emitter would make Mitsuba divide zero by zero.
        lights = {}
        if params.background.luminance_cd_m2 > 0:
            lights["sky"] = sky(mi, params, background)
        if params.light.luminance_cd_m2 > 0:
            lights["lamp"] = lamp(params, background)
        self._radius_m = params.background.radius_m
        self._sky_turns = "sky" in lights and params.background.turn_deg_s != 0
        self.scene = mi.load_dict({"type": "scene", "sensor": sensor, **lights, **meshes})
        self._handles = mi.traverse(self.scene)
        self._shown: dict[str, tuple[np.ndarray, np.ndarray]] = {}

    def show(self, poses: ScenePoses, index: int) -> None:
        """Move everything to one instant."""
        handles, frames = self._handles, frames_of(poses, index)
        for name, part in self._parts.items():
            if part.frame not in frames:
                continue
            turn, place = frames[part.frame]
            shown = self._shown.get(name)
            if shown is not None and np.array_equal(shown[0], turn) and np.array_equal(shown[1], place):
                continue
            self._shown[name] = turn, place
            handles[f"{name}.vertex_positions"] = _flat(part.corners @ turn.T + place)
            handles[f"{name}.vertex_normals"] = _flat(part.normals @ turn.T)
        if self._sky_turns:
            turned = np.eye(4)
            turned[:3, :3] = self._radius_m * poses.background_turns[index]
            handles["sky.to_world"] = self._mi.Transform4f(turned)
        right, up, backward = poses.camera_rotation[index].T
        matrix = np.eye(4)
        matrix[:3] = np.column_stack([-right, up, -backward, poses.camera_position[index]])
        handles["sensor.to_world"] = self._mi.Transform4f(matrix)
        handles.update()

    def render(self, spp: int) -> np.ndarray:
        """Linear RGB in cd/m2, float32 of shape (height, width, 3), from `spp` paths a pixel; denoised if the
        parameters ask for it.

        Every frame has the same random numbers: noise that stands still makes no events.
        """
        light = self._averaged(self.integrator, spp)
        if self._denoiser is None:
            return light
        surfaces = self._averaged(self._surfaces, min(spp, SURFACE_SPP))
        return self._denoiser(light, surfaces[..., :3], surfaces[..., 3:6], self._per_white)

    def _averaged(self, integrator: Any, spp: int) -> np.ndarray:
        height, width = (int(side) for side in self.scene.sensors()[0].film().size()[::-1])
        most = max(1, MOST_PATHS // (height * width))
        total: Any = 0.0
        for seed, done in enumerate(range(0, spp, most)):
            count = min(most, spp - done)
            image = self._mi.render(self.scene, integrator=integrator, spp=count, seed=seed)
            total += count * np.array(image, np.float64)
        return (total / spp).astype(np.float32)


def white_luminance(params: Params) -> float:
    """About the luminance, cd/m2, of a white surface that faces the lamp."""
    lamp_share = (params.light.radius_m / params.light.distance_m) ** 2
    return max(params.light.luminance_cd_m2 * lamp_share + params.background.luminance_cd_m2, 1e-6)


def frames_of(poses: ScenePoses, index: int) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Axes as columns and origin of every frame that moves, by the names that parts have."""
    hand, place = poses.hand_rotation[index], poses.hand_position[index]
    frames = {HAND: (hand, place), OBJECT: (poses.object_rotation[index], poses.object_position[index])}
    for part, name in FINGERS.items():
        own = finger_place(part, float(poses.travel_m[index]))
        frames[name] = hand @ finger_turn(part), place + hand @ own
    # Without an arm that carries the hand, its links are put away under the table.
    frames |= dict.fromkeys(LINKS, (np.eye(3), np.array(UNDER_M)))
    if poses.links is not None:
        moved = zip(poses.links.turns[index], poses.links.places[index], strict=True)
        frames |= dict(zip(LINKS, moved, strict=False))
    others = zip(names_of(poses.distractors), poses.distractors, strict=True)
    frames |= {name: (one.axes, one.places(poses.at_us[index])) for name, one in others}
    return frames


def _mesh(mi: Any, name: str, part: Part) -> Any:
    props = mi.Properties()
    props["mesh_bsdf"] = mi.load_dict(bsdf(mi, part.paint))
    count = len(part.corners)
    mesh = mi.Mesh(
        name, vertex_count=3 * count, face_count=count, has_vertex_normals=True,
        has_vertex_texcoords=part.uv is not None, props=props,
    )  # fmt: skip
    handles = mi.traverse(mesh)
    handles["faces"] = np.arange(3 * count, dtype=np.uint32)
    handles["vertex_positions"] = _flat(part.corners)
    handles["vertex_normals"] = _flat(part.normals)
    if part.uv is not None:
        handles["vertex_texcoords"] = _flat(part.uv)
    handles.update()
    return mesh


def _flat(values: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(values, np.float32).ravel()
