"""Samples as a recording for the Rerun viewer: robot, poses, camera, frames, events and curves on one time line."""

import contextlib
import os
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from evslip.data.record import Record
from evslip.events.overlay import OFF_COLOR, ON_COLOR
from evslip.physics.robots.catalogue import robot_of
from evslip.physics.trajectory import Trajectory
from evslip.physics.truth import Truth
from evslip.rendering.camera import Camera, hand_camera
from evslip.rendering.geometry.links import link_poses
from evslip.rendering.poses import ScenePoses
from evslip.utils import atomic
from evslip.utils.errors import ConfigError, DataError, MissingExtraError
from evslip.view.pictures.figures import thinned
from evslip.view.pictures.frame_source import FrameSource

STEP_US = 20_000
"""Between two poses, frames and sets of events."""
MOST_EVENTS = 20_000
"""Most events of one step; more are thinned evenly."""
CURVE_STEP = 5
"""Every how many samples of the trajectory a curve has a point."""
SUFFIX = ".rrd"


def check_rerun(path: Path) -> None:
    """Raise ConfigError unless the name is one of a file for Rerun."""
    if path.suffix != SUFFIX:
        raise ConfigError(f"out: {path}: the name of a file for Rerun must end in {SUFFIX}")


def write_rerun(path: Path, records: Iterable[Record], progress: Callable[[], None] = lambda: None) -> None:
    """Write a file that `rerun FILE` opens. Each sample is a branch of its name; `progress` is called after each.

    Raises ConfigError, DataError, MissingExtraError, StorageError.
    """
    rr = _rerun()
    check_rerun(path)
    with tempfile.TemporaryDirectory() as folder:
        temporary = Path(folder) / "out.rrd"
        # A fixed identity, so that the same data open as the same recording.
        stream = rr.RecordingStream("evslip", recording_id=path.stem, send_properties=False)
        stream.save(temporary)
        stream.log("/", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        pages = []
        for record in records:
            log_record(stream, record)
            pages.append(_page(record))
            progress()
        blueprint = rr.blueprint
        stream.send_blueprint(blueprint.Blueprint(blueprint.Tabs(*pages), collapse_panels=True))
        stream.flush()
        stream.disconnect()
        with atomic.staged(path) as file, temporary.open("rb") as source:
            while piece := source.read(1 << 20):
                atomic.write_into(file, piece, path)


def log_record(stream: Any, record: Record) -> None:
    """Log a sample or a recording into a stream of Rerun. Raises DataError where there is nothing to log."""
    trajectory, truth, world = record.trajectory, record.truth, f"{record.name}/world"
    if trajectory is None and not record.events.count:
        raise DataError(f"{record.name}: has neither poses nor events")
    if trajectory is not None and truth is not None:
        _log_curves(stream, record.name, truth)
        span, origin, view = truth.span_us, 0, f"{world}/hand/camera"
        _log_still(stream, world, trajectory)
    else:
        origin = int(record.events.t_us[0])
        span, view = (origin, int(record.events.t_us[-1]) + 1), f"{record.name}/camera"
    sight = FrameSource(record)
    times = range(span[0], span[1], STEP_US)
    for t_us in times:
        stream.set_time("time", duration=(t_us - origin) / 1e6)
        if trajectory is not None:
            _log_poses(stream, world, trajectory, t_us)
        if sight.is_there:
            stream.log(f"{view}/frame", _rerun().Image(sight.at(t_us)).compress(jpeg_quality=85))
        _log_events(stream, view, record, t_us - STEP_US, t_us)
    stream.set_time("time", duration=(span[1] - origin) / 1e6)
    _log_events(stream, view, record, times[-1], span[1])


def _page(record: Record) -> Any:
    """How the viewer lays a record out: frame and events, the scene, and the curves."""
    from rerun import blueprint  # pyright: ignore[reportMissingImports] (an extra)

    if record.trajectory is None:
        return blueprint.Spatial2DView(origin=f"{record.name}/camera", name=record.name)
    root = f"/{record.name}"
    names = {"turned_deg": "turned, degrees", "slid_mm": "slid, mm"}
    names |= {"pad_force_n": "force of the pads, N", "friction_used": "share of friction in use"}
    curves = [blueprint.TimeSeriesView(origin=f"{root}/{key}", name=title) for key, title in names.items()]
    seen = blueprint.Spatial2DView(origin=f"{root}/world/hand/camera", name="frame and events")
    scene = blueprint.Spatial3DView(origin=f"{root}/world", name="scene")
    return blueprint.Horizontal(
        blueprint.Vertical(seen, scene, row_shares=[3, 2]), blueprint.Vertical(*curves), name=record.name
    )


def _log_still(stream: Any, root: str, trajectory: Trajectory) -> None:
    rr = _rerun()
    camera, shape = hand_camera(trajectory.params), trajectory.params.object
    half = [shape.width_m / 2, shape.depth_m / 2, shape.height_m / 2]
    stream.log(f"{root}/object", rr.Boxes3D(half_sizes=[half], fill_mode="solid", colors=[(224, 123, 0)]), static=True)
    stream.log(f"{root}/table", rr.Boxes3D(centers=[[0.5, 0, -0.005]], half_sizes=[[0.4, 0.5, 0.005]]), static=True)
    lens = rr.Pinhole(
        focal_length=camera.focal_px, width=camera.width, height=camera.height,
        camera_xyz=rr.ViewCoordinates.RUB, image_plane_distance=0.1,
    )  # fmt: skip
    stream.log(f"{root}/hand/camera", lens, static=True)
    if trajectory.camera_displacement is None:
        stream.log(f"{root}/hand/camera", _place_of(camera), static=True)


def _log_poses(stream: Any, root: str, trajectory: Trajectory, t_us: int) -> None:
    rr = _rerun()
    row = int(np.searchsorted(trajectory.t_us, t_us))
    for name, pose in (("object", trajectory.object_pose[row]), ("hand", trajectory.gripper_pose[row])):
        turn = Rotation.from_quat(pose[3:], scalar_first=True).as_quat()
        stream.log(f"{root}/{name}", rr.Transform3D(translation=pose[:3], quaternion=turn))
    if trajectory.camera_displacement is not None:  # vibration moves the camera on the hand
        camera = hand_camera(trajectory.params)
        camera = ScenePoses(trajectory, camera, np.array([t_us])).mounted(camera, 0)
        stream.log(f"{root}/hand/camera", _place_of(camera))
    joints = trajectory.joints[row]
    arm = robot_of(trajectory.params.robot).arm
    if arm is not None:
        links = link_poses(arm, joints[None, : len(arm.joints)])
        chain = [*links.places[0], trajectory.gripper_pose[row, :3]]
        stream.log(f"{root}/arm", rr.LineStrips3D([chain], radii=0.02))
    fingers = [[0, side * (travel + 0.005), 0.095] for side, travel in zip((1, -1), joints[7:], strict=True)]
    stream.log(f"{root}/hand/fingers", rr.Boxes3D(centers=fingers, half_sizes=[[0.01, 0.005, 0.02]] * 2))


def _place_of(camera: Camera) -> Any:
    return _rerun().Transform3D(translation=camera.position, mat3x3=camera.rotation)


def _log_events(stream: Any, view: str, record: Record, since_us: int, until_us: int) -> None:
    events = thinned(record.events.between(since_us, until_us), MOST_EVENTS)
    places = np.stack([events.x, events.y], -1) + np.float32(0.5)
    colors = np.where(events.p[:, None], ON_COLOR, OFF_COLOR).astype(np.uint8)
    stream.log(f"{view}/events", _rerun().Points2D(places, colors=colors, radii=0.5))


def _log_curves(stream: Any, root: str, truth: Truth) -> None:
    rr = _rerun()
    first, last = np.searchsorted(truth.t_us, truth.span_us)
    keep = slice(int(first), int(last), CURVE_STEP)
    curves = {"turned_deg": truth.theta_deg, "slid_mm": truth.slide_mm}
    for name, pads in (("pad_force_n", truth.pad_force_n), ("friction_used", truth.pad_utilisation)):
        if pads is not None:
            curves |= {f"{name}/left": pads[:, 0], f"{name}/right": pads[:, 1]}
    times = rr.TimeColumn("time", duration=truth.t_us[keep] / 1e6)
    for name, values in curves.items():
        stream.send_columns(f"{root}/{name}", [times], rr.Scalars.columns(scalars=values[keep].astype(float)))


def _rerun() -> Any:
    # Rerun asks its maker's server for nothing, and tells it nothing.
    os.environ.setdefault("RERUN_ANALYTICS_ENABLED", "0")
    with contextlib.suppress(ImportError):
        import rerun  # pyright: ignore[reportMissingImports] (an extra)

        return rerun
    raise MissingExtraError("files for Rerun need the package rerun-sdk: pip install 'evslip[rerun]'")
