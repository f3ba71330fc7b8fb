"""Frames of a motion that is told piece by piece."""

import importlib
from typing import Any

import numpy as np
import pytest

from evslip.config.loading import load_config
from evslip.config.params import Params
from evslip.draws.draw import draw
from evslip.events.frame import OBJECT, Frame
from evslip.physics.trajectory import Trajectory
from evslip.rendering import render
from evslip.rendering.live import LiveView
from evslip.utils.errors import ConfigError
from made_up import carried, still, turning

EVERY_US = 10_000


@pytest.fixture(autouse=True)
def whole_span(monkeypatch: pytest.MonkeyPatch):
    """Made-up trajectories carry no grip, so all of them counts as recorded."""
    module = importlib.import_module("evslip.rendering")
    monkeypatch.setattr(module, "recorded_span", lambda traj: (int(traj.t_us[0]), int(traj.t_us[-1])))


def sample(**overrides: Any) -> Params:
    own = {"camera.width": 104, "camera.height": 78} | {k.replace("__", "."): v for k, v in overrides.items()}
    return draw(load_config("simple", own), 0)


def pieces(traj: Trajectory, every: int = EVERY_US // 1000) -> list[Trajectory]:
    """Samples of `every` milliseconds each, every one beginning with the last of the one before."""
    names = ("t_us", "gripper_pose", "object_pose", "joints", "pad_force_n", "floor_force_n")
    cuts = [slice(k, k + every + 1) for k in range(0, len(traj.t_us) - 1, every)]
    return [traj._replace(**{name: getattr(traj, name)[cut] for name in names}) for cut in cuts]


def followed(nominal: Trajectory, real: Trajectory) -> list[Frame]:
    """All live frames of what was to be one motion and became another."""
    view = LiveView(nominal, (int(nominal.t_us[0]), int(nominal.t_us[-1])), every_us=EVERY_US)
    return [frame for piece in pieces(real) for frame in view.advance(piece)]


def log_images(frames: list[Frame]) -> np.ndarray:
    return np.log(np.stack([frame.luminance for frame in frames]))


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


@pytest.mark.parametrize(
    "extra", [{}, {"camera__mount": "front"}, {"clutter__count": 2.0, "passers__count": 1.0}], ids=str
)
def test_live_frames_are_those_drawn_one_by_one(extra: dict[str, Any]):
    traj = carried(sample(**extra))
    frames = followed(traj, traj)
    times = np.array([frame.t_us for frame in frames])
    assert set(range(0, 1_000_001, EVERY_US)) <= set(times.tolist())
    alone = list(render(traj, times_us=times))
    changes = rms(np.diff(log_images(alone), axis=0))
    assert rms(log_images(frames) - log_images(alone)) < 0.5 * changes
    assert np.mean([np.mean(one.bodies == other.bodies) for one, other in zip(frames, alone, strict=True)]) > 0.99


def test_a_slip_that_was_not_planned_is_seen():
    real, planned = turning(sample()), turning(sample(), degrees=0.0)
    frames = followed(planned, real)
    times = np.array([frame.t_us for frame in frames])
    alone = list(render(real, times_us=times))
    held = list(render(planned, times_us=times))
    covers = [np.stack([frame.bodies == OBJECT for frame in some]) for some in (frames, alone, held)]
    late = times > 700_000
    assert (covers[0] != covers[1])[late].mean() < 0.05 * (covers[2] != covers[1])[late].mean()
    both = covers[0] & covers[1]
    assert rms((log_images(frames) - log_images(alone))[both]) < 0.1 * rms((log_images(held) - log_images(alone))[both])


def test_frames_do_not_know_what_comes():
    planned, real = turning(sample(), degrees=0.0), turning(sample())
    other = real._replace(object_pose=real.object_pose.copy())
    other.object_pose[501:] = planned.object_pose[501:]
    first, second = followed(planned, real), followed(planned, other)
    same = [np.array_equal(one.luminance, two.luminance) for one, two in zip(first, second, strict=True)]
    until = sum(frame.t_us <= 500_000 for frame in first)
    assert all(same[:until]) and not any(same[until:])


def test_every_frame_of_flickering_light_comes_once():
    traj = still(sample(flicker__lamp_depth=0.3, flicker__surroundings_depth=0.3), 0.1)
    frames = followed(traj, traj)
    times = np.array([frame.t_us for frame in frames])
    assert len(times) > 50 and np.all(np.diff(times) > 0) and times[-1] == 100_000
    expected = list(render(traj, times_us=times))
    off = np.abs(log_images(frames) - log_images(expected))
    assert np.quantile(off, 0.95) < 1e-5 and off.mean() < 1e-3  # but at the object's edge, see LiveView


def test_a_step_in_flickering_light_is_seen_up_to_its_end():
    traj = still(sample(flicker__lamp_depth=0.3, flicker__surroundings_depth=0.3), 0.1)
    view = LiveView(traj, (0, 100_000), every_us=EVERY_US)
    assert [view.advance(piece)[-1].t_us for piece in pieces(traj)] == list(range(EVERY_US, 100_001, EVERY_US))


def test_what_cannot_be_drawn_live_says_so():
    traj = still(sample(render__renderer="pathtrace"), 0.1)
    with pytest.raises(ConfigError, match=r"render.renderer: pathtrace .* expected raycast"):
        LiveView(traj, (0, 100_000), every_us=EVERY_US)
