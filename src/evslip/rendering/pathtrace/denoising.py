"""Frames without the noise of path tracing: Intel Open Image Denoise (Áfra, openimagedenoise.org), on the processor."""

import importlib.util
from typing import Any

import numpy as np

from evslip.rendering.pathtrace.variant import most_threads
from evslip.utils.errors import MissingExtraError

AOVS = "albedo:albedo,normal:sh_normal"
"""Further facts of each pixel: the share of light that its surface returns, and its normal."""


def check_denoiser() -> None:
    """Raise MissingExtraError where Open Image Denoise is missing; imports nothing."""
    if importlib.util.find_spec("pyoidn") is None:
        raise MissingExtraError("render.denoise needs Open Image Denoise; pip install 'evslip[photo]'")


class Denoiser:
    """Denoises frames of one size."""

    def __init__(self) -> None:
        """Raises MissingExtraError."""
        check_denoiser()
        import pyoidn

        self._oidn = pyoidn
        self._device: Any = pyoidn.Device(pyoidn.OIDN_DEVICE_TYPE_CPU)
        threads = most_threads()
        if threads is not None:
            self._device.set_int("numThreads", threads)
            self._device.set_bool("setAffinity", False)
        self._device.commit()

    def __call__(self, light: np.ndarray, albedo: np.ndarray, normal: np.ndarray, scale: float) -> np.ndarray:
        """Denoised linear RGB; all images float32 of shape (height, width, 3). scale: from their unit to about 1 at
        white, the same for all frames of a sequence: chosen for each, it would flicker."""
        images = {"color": light, "albedo": albedo, "normal": normal, "output": np.empty_like(light)}
        images = {name: np.ascontiguousarray(image, np.float32) for name, image in images.items()}  # kept until the end
        with self._oidn.Filter(self._device, self._oidn.OIDN_FILTER_TYPE_RT) as denoise:
            for name, image in images.items():
                denoise.set_image(name, image, self._oidn.OIDN_FORMAT_FLOAT3)
            denoise.set_bool("hdr", True)
            denoise.set_float("inputScale", scale)
            denoise.commit()
            denoise.execute()
        error = self._device.get_error()
        if error is not None:
            raise RuntimeError(f"Open Image Denoise: {error}")
        return images["output"]
