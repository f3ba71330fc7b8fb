"""Whether CUDA's compiler takes the renderer's passes, without a GPU: python benchmarks/compile_cuda.py [CAPABILITY]

Needs pip install 'evslip[cuda]'. CAPABILITY: such as 90 for sm_90, the default. Draws one frame of each kind of body up
to the launch of each kernel, compiles it for the arguments that it would get, and prints its registers and memory.
"""

import shutil
import subprocess
import sys
import tempfile
import time
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest import mock

import numpy as np
from numba import cuda as numba_cuda
from numba import typeof

import evslip.rendering as rendering
from evslip.config.loading import load_config
from evslip.draws.draw import draw
from evslip.physics.simulation import simulate
from evslip.rendering.raycast import cuda_backdrop, cuda_bodies, cuda_device

cuda: Any = numba_cuda


class HostArray(np.ndarray):
    """Stands in for an array on the GPU; its content does not matter."""

    def copy_to_host(self, out: np.ndarray | None = None) -> np.ndarray:
        return np.asarray(self) if out is None else out

    def copy_to_device(self, values: np.ndarray) -> None:
        self[...] = values


class Host:
    to_device = staticmethod(lambda values: np.ascontiguousarray(values).view(HostArray))
    device_array = staticmethod(lambda shape, kind: np.zeros(shape, kind).view(HostArray))


def bare(value: Any) -> Any:
    if isinstance(value, tuple):
        kind: Any = type(value)
        return kind(*map(bare, value)) if hasattr(value, "_fields") else tuple(map(bare, value))
    return np.asarray(value) if isinstance(value, HostArray) else value


def main(capability: str = "90") -> None:
    if find_spec("numba_cuda") is None:
        sys.exit("CUDA's compiler is missing; pip install 'evslip[cuda]'")
    if not capability.isdecimal():
        sys.exit(f"CAPABILITY: {capability!r} is wrong, expected digits, such as 90")
    modules, seen = (cuda_device, cuda_backdrop, cuda_bodies), set()

    def compile_one(device: Any, kernel: Any, chunks: int, longest: int, *arguments: Any) -> None:
        kinds = tuple(typeof(bare(value)) for value in (*arguments, device.lists(chunks, longest)))
        if (kernel, kinds) in seen:
            return
        seen.add((kernel, kinds))
        start = time.perf_counter()
        with mock.patch.multiple(cuda_backdrop, cuda=cuda), mock.patch.multiple(cuda_bodies, cuda=cuda):
            code, _ = cuda.compile(kernel.py_func, kinds, device=False, abi="numba", cc=at_hand.compute_capability)
        spent = time.perf_counter() - start
        print(
            f"{kernel.py_func.__name__}: {len(code) >> 10} KiB of PTX in {spent:.1f} s; {assembled(code, capability)}"
        )

    # Functions that a kernel calls are compiled for the GPU at hand.
    at_hand = SimpleNamespace(compute_capability=divmod(int(capability), 10))
    patches = [mock.patch.object(module, "cuda", Host) for module in modules]
    with (
        patches[0], patches[1], patches[2], mock.patch.object(cuda_device, "require_cuda", lambda _: None),
        mock.patch.object(cuda_device.Device, "launch", compile_one),
        mock.patch("numba.cuda.dispatcher.get_current_device", lambda: at_hand),
        mock.patch.object(rendering, "exposure_scale", lambda *_: 1.0),
    ):  # fmt: skip
        for shape in ("cuboid", "cylinder"):
            traj = simulate(draw(load_config("complex", {"object.shape": shape, "render.device": "cuda"}), 0))
            next(iter(rendering.render(traj, times_us=traj.t_us[-2:], size=(72, 54))))


def assembled(code: str, capability: str) -> str:
    """What the assembler says of registers and memory."""
    assembler = shutil.which("ptxas")
    if assembler is None:
        return "no ptxas on the PATH to tell its registers"
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "kernel.ptx"
        path.write_text(code)
        words = [assembler, "-v", f"-arch=sm_{capability}", str(path), "-o", str(path.with_suffix(".cubin"))]
        said = subprocess.run(words, capture_output=True, text=True).stderr
    told = [line.split(":", 1)[-1].strip() for line in said.splitlines() if "register" in line or "spill" in line]
    return ", ".join(told) or said.strip()


if __name__ == "__main__":
    main(*sys.argv[1:])
