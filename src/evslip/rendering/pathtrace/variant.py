"""Build of Mitsuba that runs: on a GPU, compiled for this processor by LLVM, or plain."""

import glob
import importlib.util
import os
import re
from functools import cache
from pathlib import Path
from types import ModuleType

from evslip.utils.errors import ConfigError, MissingExtraError

CUDA, LLVM, SCALAR = "cuda_ad_rgb", "llvm_ad_rgb", "scalar_rgb"
LEAST_LLVM = 17
"""Dr.Jit's code makes older versions abort the process."""
CHOICE = "EVSLIP_MITSUBA_VARIANT"
"""Environment variable that overrides the choice."""
LLVM_PATH = "DRJIT_LIBLLVM_PATH"
"""Environment variable in which Dr.Jit looks for the library first."""
_PLACES = (
    "/usr/lib/*-linux-gnu/libLLVM*.so*",
    "/usr/lib/llvm-*/lib/libLLVM*.so*",
    "/usr/lib64/libLLVM*.so*",
    "/usr/lib64/llvm*/lib*/libLLVM*.so*",
    "/usr/lib/libLLVM*.so*",
    "/opt/homebrew/opt/llvm*/lib/libLLVM*.dylib",
    "/usr/local/opt/llvm*/lib/libLLVM*.dylib",
)


def check_installed() -> None:
    """Raise MissingExtraError where Mitsuba is missing; imports nothing."""
    if importlib.util.find_spec("mitsuba") is None:
        raise MissingExtraError("the path tracer needs Mitsuba; pip install 'evslip[photo]'")


@cache
def mitsuba() -> ModuleType:
    """Mitsuba with its variant set, the same for the life of the process. Raises MissingExtraError, ConfigError."""
    check_installed()
    variant = os.environ.get(CHOICE) or choose()
    library = find_llvm()
    if library is not None:
        os.environ.setdefault(LLVM_PATH, str(library))
    elif variant == LLVM and not os.environ.get(LLVM_PATH):
        raise MissingExtraError(
            f"{LLVM} needs the LLVM library, version {LEAST_LLVM} or newer; apt install libllvm19, or name its file in "
            f"{LLVM_PATH}, or leave {CHOICE} unset for {SCALAR}, which needs none"
        )
    import mitsuba as mi

    if variant not in mi.variants() or not variant.endswith("_rgb"):
        raise ConfigError(f"{CHOICE}: {variant!r} is unknown; expected one of {CUDA}, {LLVM}, {SCALAR}")
    mi.set_variant(variant)
    mi.set_log_level(mi.LogLevel.Error)
    threads = most_threads()
    if variant == LLVM and threads is not None:
        import drjit

        drjit.set_thread_count(threads)
    return mi


def most_threads() -> int | None:
    """Threads that this process may use; None: as many as there are cores."""
    text = os.environ.get("NUMBA_NUM_THREADS", "")
    return int(text) if text.isdecimal() else None


def choose() -> str:
    """The fastest variant that this machine runs."""
    if _has_gpu():
        return CUDA
    return LLVM if os.environ.get(LLVM_PATH) or find_llvm() is not None else SCALAR


def describe() -> str:
    """One line on what is used and why."""
    variant = mitsuba().variant()
    if variant == CUDA:
        return f"Mitsuba {variant}: on the GPU"
    if variant == LLVM:
        return f"Mitsuba {variant}: compiled by {os.environ.get(LLVM_PATH, 'LLVM')}"
    return (
        f"Mitsuba {variant}: no LLVM {LEAST_LLVM} or newer found; apt install libllvm19 makes it about 3 times faster"
    )


@cache
def find_llvm() -> Path | None:
    """The newest LLVM library of the system that Dr.Jit can use, by the version in its name; it is not loaded."""
    found = [(version_of(file), file) for place in _PLACES for file in glob.glob(place)]  # noqa: PTH207
    fitting = [(version, file) for version, file in found if version >= LEAST_LLVM]
    return Path(max(fitting)[1]) if fitting else None


def version_of(file: str) -> int:
    """Major version in the name of an LLVM library, such as libLLVM-19.so or libLLVM.so.19.1; 0 where there is none."""
    match = re.search(r"libLLVM(?:-|\.so\.|\.)(\d+)", Path(file).name)
    return int(match[1]) if match else 0


def _has_gpu() -> bool:
    return Path("/proc/driver/nvidia/version").exists() and bool(glob.glob("/dev/nvidia[0-9]*"))  # noqa: PTH207
