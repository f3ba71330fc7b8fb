"""An object that the hand holds perfectly makes no events but through moving light and shadow."""

import importlib

import numpy as np
import pytest
from PIL import Image
from scipy.ndimage import binary_erosion

from evslip.config.loading import load_config
from evslip.draws.draw import draw
from evslip.events import EventCamera
from evslip.events.frame import GRIPPER, OBJECT
from evslip.rendering import render
from made_up import still

render_module = importlib.import_module("evslip.rendering")  # as an attribute of evslip, that name is the function
SIZE = 138, 104


@pytest.fixture(autouse=True)
def whole_span(monkeypatch):
    """Made-up trajectories carry no grip, so all of them counts as recorded."""
    monkeypatch.setattr(render_module, "recorded_span", lambda traj: (int(traj.t_us[0]), int(traj.t_us[-1])))


@pytest.fixture
def params(tmp_path):
    """A lamp so far away that its direction is the same everywhere, and the same light from all around."""
    Image.new("RGB", (8, 8), (128, 128, 128)).save(tmp_path / "even.png")
    scene = {
        "camera.width": SIZE[0],
        "camera.height": SIZE[1],
        "object.texture": "cardboard-0",
        "surface.texture": "brick-0",
        "background.texture": str(tmp_path / "even.png"),
        "light.distance_m": 1000.0,
        "light.radius_m": 10.0,
        "light.luminance_cd_m2": 5e7,
    }
    return draw(load_config("simple", scene), 0)


def moving(params):
    """Hand and object move together, without turning."""
    traj = still(params)
    way = 0.05 * np.sin(np.linspace(0, 2 * np.pi, len(traj.t_us)))
    for poses in (traj.gripper_pose, traj.object_pose):
        poses[:, 0] += way
        poses[:, 2] += 0.02 - 0.4 * way
    return traj


def inside(traj):
    """Events on the inside of the object and of the gripper, two pixels from their outlines; and of all."""
    frames = list(render(traj))
    events = EventCamera("davis346", size=SIZE, sigma=0.0, leak_rate_hz=0.0, shot_rate_hz=0.0).run(frames)
    masks = [
        np.all([binary_erosion(frame.bodies == body, iterations=2) for frame in frames], axis=0)
        for body in (OBJECT, GRIPPER)
    ]
    assert all(mask.sum() > 100 for mask in masks)
    return [int(mask[events.y.astype(int), events.x.astype(int)].sum()) for mask in masks], events.count


def test_a_held_object_makes_no_events_where_light_and_shadow_stand_still(params):
    found, everywhere = inside(moving(params))
    assert found == [0, 0] and everywhere > 1000


def test_an_object_that_turns_in_the_hand_does(params):
    traj = moving(params)
    half = np.radians(np.linspace(0, 12, len(traj.t_us))) / 2
    traj.object_pose[:, 3], traj.object_pose[:, 5] = np.cos(half), np.sin(half)
    found, _ = inside(traj)
    assert found[0] > 100 and found[1] == 0
