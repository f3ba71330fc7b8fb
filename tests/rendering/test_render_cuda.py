"""The fast renderer's CUDA path: on numba's simulator, which runs kernels as Python, a thread a pixel, and on a GPU."""

import importlib
import os
import subprocess
import sys

import numpy as np
import pytest

from evslip import generate
from evslip.config.loading import load_config
from evslip.draws.draw import draw
from evslip.rendering import render, render_color
from evslip.utils.errors import MissingExtraError
from made_up import still

SIMULATED = """
from numba.cuda.simulator import kernel
from numba.cuda.simulator.cudadrv.devicearray import FakeCUDAArray


def bare(value):
    "Compiled passes take arrays, not what the simulator wraps around them."
    if isinstance(value, FakeCUDAArray):
        return value._ary
    if not isinstance(value, tuple):
        return value
    return type(value)(*map(bare, value)) if hasattr(value, "_fields") else tuple(map(bare, value))


launch, kernel.FakeWithinKernelCUDAArray = kernel.FakeCUDAKernel.__call__, bare
kernel.FakeCUDAKernel.__call__ = lambda self, *arguments: launch(self, *map(bare, arguments))

from test_render_cuda import compare

compare((60, 18), most=5e-4)
print("equal")
"""
SCENES = (
    {},
    {"object.shape": "cylinder", "light.radius_m": 4.0},
    {"camera.mount": "front", "camera.k1": -0.3, "light.polar_deg": 70.0},
)


def compare(size: tuple[int, int], most: float) -> None:
    """Both devices' frames of each scene: at 99.99 % of the pixels log luminance differs by less than `most`, and
    nowhere by 1 %. Bodies are the same but for a few pixels cut by the horizon."""
    differences = []
    for scene in SCENES:
        pair = []
        for device in ("cpu", "cuda"):
            traj = still(draw(load_config("simple", {**scene, "render.device": device}), 0))
            traj.gripper_pose[:, 0] += 0.05 * np.linspace(0, 1, len(traj.t_us))
            with pytest.MonkeyPatch.context() as patch:  # a made-up trajectory carries no grip: all of it counts
                patch.setattr(importlib.import_module("evslip.rendering"), "recorded_span", lambda _: (0, 1_000_000))
                pair.append(list(render(traj, times_us=np.array([0, 1_000_000]), size=size)))
        for a, b in zip(*pair, strict=True):
            assert np.mean(a.bodies != b.bodies) < 1e-3
            differences.append(np.abs(np.log(a.luminance) - np.log(b.luminance)).ravel())
        assert len(np.unique(pair[0][0].bodies)) >= 4
    found = np.concatenate(differences)
    assert np.mean(found >= most) <= 1e-4, (np.mean(found >= most), found.max())
    assert found.max() < 1e-2


@pytest.mark.slow
def test_the_simulated_gpu_gives_the_image_of_the_cpu():
    environment = {**os.environ, "NUMBA_ENABLE_CUDASIM": "1", "PYTHONPATH": os.pathsep.join(sys.path)}
    run = subprocess.run([sys.executable, "-c", SIMULATED], env=environment, capture_output=True, text=True)
    assert run.stdout == "equal\n", run.stderr[-3000:]


def test_a_gpu_gives_the_image_of_the_cpu():
    from numba import cuda

    if not cuda.is_available():
        pytest.skip("this machine has no NVIDIA GPU that numba can use")
    compare((346, 260), most=1e-3)


def test_a_missing_gpu_is_one_clear_line(tmp_path, monkeypatch):
    from numba import cuda

    if cuda.is_available():
        pytest.skip("this machine has a GPU")
    config = load_config("simple", {"render.device": "cuda"})
    monkeypatch.setattr(importlib.import_module("evslip.rendering"), "recorded_span", lambda _: (0, 1_000_000))
    with pytest.raises(MissingExtraError, match=r"^render\.device: 'cuda' needs an NVIDIA GPU.*evslip\[cuda\]"):
        render(still(draw(config, 0)))
    with pytest.raises(MissingExtraError, match=r"^render\.device: 'cuda' needs"):
        generate(config, tmp_path / "data", count=1)
    assert not (tmp_path / "data").exists()


def test_a_record_made_on_a_gpu_is_looked_at_without_one(monkeypatch):
    traj = still(draw(load_config("simple", {"render.device": "cuda", "object.height_m": 0.06}), 0))
    monkeypatch.setattr(importlib.import_module("evslip.rendering"), "recorded_span", lambda _: (0, 1_000_000))
    picture = render_color(traj, 0, size=(40, 30))
    assert picture.shape == (30, 40, 3)
    assert picture.std() > 0
