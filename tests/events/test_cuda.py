"""The CUDA path, on numba's simulator: it runs the kernel as Python, a thread a pixel."""

import os
import subprocess
import sys

import pytest

from evslip.events import EventCamera
from evslip.utils.errors import ConfigError, MissingExtraError

SAME_EVENTS = """
import numpy as np
from evslip.events import EventCamera

rng = np.random.default_rng(0)
size = (9, 5)
times = np.cumsum(rng.uniform(300, 30_000, 24))
clip = np.clip(np.cumsum(rng.normal(0, 0.07, (24, 5, 9)), 0) + 0.5, 0.01, 1.5)
masks = rng.integers(0, 4, clip.shape).astype(np.uint8)
cases = [
    ("clean", {}),
    ("davis346", {"shot_rate_hz": 30.0, "leak_rate_hz": 5.0}),
    ("noisy", {"hot_share": 0.2, "dead_share": 0.2}),
    ("davis346", {"photoreceptor_noise": 0.05}),
    ("davis346", {"intensity": "uint8"}),
    ("davis346-bright", {"shot_rate_hz": 30.0}),
]
for preset, arguments in cases:
    images = (160 * clip).astype(np.uint8) if "intensity" in arguments else clip.astype(np.float32)
    frames = list(zip(times, images, masks))
    cpu = EventCamera(preset, size=size, **arguments)
    gpu = EventCamera(preset, size=size, device="cuda", **arguments)
    expected, events = cpu.run(frames[:15]), gpu.run(frames[:15])
    assert expected.count > 100, expected.count
    # Half-way they change places.
    cpu, gpu = EventCamera.from_state(gpu.state()), EventCamera.from_state(cpu.state(), device="cuda")
    for a, b in ((expected, events), (cpu.run(frames[15:]), gpu.run(frames[15:]))):
        assert a.count == b.count > 0, (preset, a.count, b.count)
        orders = [np.lexsort((e.t_us, e.x, e.y)) for e in (a, b)]
        for name in ("x", "y", "p", "cause", "body"):
            np.testing.assert_array_equal(*(getattr(e, name)[o] for e, o in zip((a, b), orders)))
        assert np.abs(a.t_us[orders[0]] - b.t_us[orders[1]]).max() <= 1
print("equal")
"""


@pytest.mark.slow
def test_the_gpu_gives_the_events_of_the_cpu():
    environment = {**os.environ, "NUMBA_ENABLE_CUDASIM": "1"}
    run = subprocess.run([sys.executable, "-c", SAME_EVENTS], env=environment, capture_output=True, text=True)
    assert run.stdout == "equal\n", run.stderr[-3000:]


def test_a_missing_gpu_is_one_clear_line():
    from numba import cuda

    if cuda.is_available():
        pytest.skip("this machine has a GPU")
    with pytest.raises(MissingExtraError, match=r"device: 'cuda' needs an NVIDIA GPU.*evslip\[cuda\]"):
        EventCamera(device="cuda")


def test_v2es_rules_have_no_gpu():
    with pytest.raises(ConfigError, match="mode 'v2e' has no 'cuda'"):
        EventCamera(device="cuda", mode="v2e")
