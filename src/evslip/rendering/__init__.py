"""From a trajectory to luminance: frames for the event camera, pictures for the eye.

Begin with `render`, then `raycast.renderer` (the fast renderer) and `timing.schedule` (when a frame is drawn).
A new renderer is a class with the methods of `Renderer` and one line in RENDERERS.
"""

from collections.abc import Callable, Collection, Iterator, Sequence
from importlib import import_module
from typing import Any

import numpy as np

from evslip.events.frame import Frame
from evslip.physics.trajectory import Trajectory
from evslip.rendering.camera import Camera, hand_camera, scene_camera
from evslip.rendering.distractors.distractor import Distractor, distractors_of
from evslip.rendering.lights import Lights
from evslip.rendering.outputs import OUTPUTS, Outputs, check_outputs
from evslip.rendering.poses import ScenePoses
from evslip.rendering.timing.flicker import Flicker
from evslip.rendering.timing.schedule import check_times, frame_times
from evslip.scene.textures.library import linear_to_srgb
from evslip.utils.errors import ConfigError

__all__ = ["OUTPUTS", "RENDERERS", "VIEWS", "frame_times", "pictures", "render", "render_color"]

RENDERERS = {
    "raycast": "evslip.rendering.raycast.renderer:Raycaster",
    "pathtrace": "evslip.rendering.pathtrace.tracer:Pathtracer",
}
"""Name -> module:class. A renderer is made from (params, camera, held finger travel, distractors=...) and draws poses:
`draw` gives luminance and body indices of one, `draw_sequence` of all in turn, `color` linear RGB."""
VIEWS = ("wrist", "scene")
"""The camera on the hand, and one beside the table that sees the whole robot."""
MIDDLE_GREY = 0.25
"""Median of the first held frame when the exposure is set per sample."""


def render(
    traj: Trajectory,
    *,
    start_us: int | None = None,
    end_us: int | None = None,
    size: tuple[int, int] | None = None,
    times_us: np.ndarray | None = None,
    renderer: str | None = None,
    outputs: Collection[str] = (),
) -> Iterator[Frame]:
    """Frames of a trajectory from the hand camera, luminance relative to white.

    By default the recorded span (`measure(traj).span_us`) at times from `frame_times`, and those that a flicker asks
    for; `times_us` (sorted integers) overrides them. `size` is (width, height) in pixels. Every frame's arrays are its
    own. `renderer`: of RENDERERS; default: the parameters' render.renderer.
    `outputs`, of OUTPUTS: what else the frames shall hold, see `Frame`. Raises ConfigError.
    """
    check_outputs(outputs)
    span = recorded_span(traj)
    part = span[0] if start_us is None else start_us, span[1] if end_us is None else end_us
    return render_span(traj, span, part, size=size, times_us=times_us, renderer=renderer, outputs=outputs)


def render_span(
    traj: Trajectory,
    span: tuple[int, int],
    part: tuple[int, int] | None = None,
    *,
    size: tuple[int, int] | None = None,
    times_us: np.ndarray | None = None,
    renderer: str | None = None,
    outputs: Collection[str] = (),
) -> Iterator[Frame]:
    """Frames as of `render`, of a trajectory whose recorded span is known; part: from and to when, default all of
    it."""
    camera, in_sequence = hand_camera(traj.params, size), times_us is None
    if times_us is None:
        times_us = frame_times(traj, *(part or span), camera=camera)
    times_us = np.asarray(times_us, np.int64)
    check_times(traj, times_us)
    poses, kept = ScenePoses(traj, camera, times_us), Outputs(traj, camera, outputs) if outputs else None
    flicker = Flicker(traj.params)
    if flicker.is_on:
        lights = Lights(traj.params, lambda params: make_renderer(renderer, traj._replace(params=params), camera, span))
        scale = exposure_scale(lights, traj, camera, span[0])
        if not in_sequence:
            return _frames(lights.draw_single(poses, times_us, scale), times_us, kept)
        every_us = flicker.times(times_us)
        return _frames(lights.draw_sequence(poses, times_us, every_us, scale), every_us, kept)
    chosen = make_renderer(renderer, traj, camera, span)
    scale = exposure_scale(chosen, traj, camera, span[0])
    single = (chosen.draw(poses, k, scale) for k in range(len(times_us)))
    drawn = chosen.draw_sequence(poses, scale) if in_sequence else single
    return _frames(drawn, times_us, kept)


def render_color(
    traj: Trajectory,
    t_us: int,
    *,
    size: tuple[int, int] | None = None,
    view: str = "wrist",
    renderer: str | None = None,
) -> np.ndarray:
    """A picture of one instant, sRGB uint8 of shape (height, width, 3), exposed as the luminance frames are.

    `view`: of VIEWS. What is brighter than white is clipped. Raises ConfigError, and MissingExtraError for pathtrace.
    """
    return next(pictures(traj, np.array([t_us]), size=size, view=view, renderer=renderer))


def pictures(
    traj: Trajectory,
    times_us: np.ndarray,
    *,
    size: tuple[int, int] | None = None,
    view: str = "wrist",
    renderer: str | None = None,
    color: bool = True,
) -> Iterator[np.ndarray]:
    """Pictures as of `render_color`, of several instants (sorted); with color=False grey, of shape (height, width)."""
    camera, span = view_camera(traj, view, size), recorded_span(traj)
    first, last = (int(traj.t_us[0]), int(traj.t_us[-1]))
    for t_us in times_us:
        if not first <= t_us <= last:
            raise ConfigError(
                f"time {t_us / 1e6:g} s is outside of the trajectory, {first / 1e6:g} to {last / 1e6:g} s"
            )
    chosen = make_renderer(renderer, traj, camera, span)
    scale = exposure_scale(chosen, traj, camera, span[0])
    poses = ScenePoses(traj, camera, np.asarray(times_us, np.int64))

    def drawn() -> Iterator[np.ndarray]:
        for index in range(len(times_us)):
            linear = chosen.color(poses, index, scale) if color else chosen.draw(poses, index, scale)[0]
            yield np.round(linear_to_srgb(linear) * 255).astype(np.uint8)

    return drawn()


def view_camera(traj: Trajectory, view: str, size: tuple[int, int] | None = None) -> Camera:
    """The camera of one of VIEWS. Raises ConfigError."""
    if view == "wrist":
        return hand_camera(traj.params, size)
    if view != "scene":
        raise ConfigError(f"view: {view!r} is unknown; expected one of {', '.join(VIEWS)}")
    return scene_camera(size or (traj.params.camera.width, traj.params.camera.height))


def recorded_span(traj: Trajectory) -> tuple[int, int]:
    """The time that is recorded, in microseconds."""
    from evslip.physics.truth import measure

    return measure(traj).span_us


def exposure_scale(renderer: Any, traj: Trajectory, camera: Camera, first_us: int) -> float:
    """Factor that makes luminance in cd/m2 relative to white. Raises ConfigError for a scene without light."""
    settings = traj.params.camera
    if settings.exposure == "absolute":
        return 1.0 / settings.white_cd_m2
    median = float(np.median(renderer.draw(ScenePoses(traj, camera, np.array([first_us])), 0)[0]))
    if not median > 0:
        raise ConfigError(
            "camera.exposure: the first frame is black, so no exposure fits it; "
            'give background.luminance_cd_m2 or light.luminance_cd_m2, or set camera.exposure = "absolute"'
        )
    return MIDDLE_GREY / median


def make_renderer(
    name: str | None,
    traj: Trajectory,
    camera: Camera,
    span: tuple[int, int],
    distractors: Sequence[Distractor] | None = None,
) -> Any:
    """A renderer by its name, or by the parameters' for None, for a trajectory of a known recorded span. distractors:
    default those of the trajectory. Raises ConfigError."""
    name = traj.params.render.renderer if name is None else name
    if name not in RENDERERS:
        raise ConfigError(f"renderer: {name!r} is unknown; expected one of {', '.join(RENDERERS)}")
    module, _, attribute = RENDERERS[name].partition(":")
    kind: Callable[..., Any] = getattr(import_module(module), attribute)
    inside = (traj.t_us >= span[0]) & (traj.t_us <= span[1])
    held_travel_m = float(np.median(traj.joints[inside, 7:9].mean(1)))
    standing = distractors_of(traj) if distractors is None else distractors
    return kind(traj.params, camera, held_travel_m, distractors=standing)


def _frames(
    drawn: Iterator[tuple[np.ndarray, np.ndarray]], times_us: np.ndarray, outputs: Outputs | None
) -> Iterator[Frame]:
    for t_us, (luminance, bodies) in zip(times_us.tolist(), drawn, strict=True):
        yield Frame(t_us, luminance, bodies, **(outputs.at(t_us) if outputs else {}))
