"""Frames in light that flickers: light adds up, so a frame is a sum of the lamp's part and the surroundings'."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from evslip.config.params import Params
from evslip.rendering.poses import ScenePoses
from evslip.rendering.scratch import kernel
from evslip.rendering.timing.flicker import Flicker

Parts = tuple[np.ndarray, np.ndarray]
"""Luminance in the mean light of each of `Lights`, float32 of shape (parts, height, width), and body indices."""


class Lights:
    """Renderers of the lights that flicker differently: one of all light, or one of the lamp's and one of the rest."""

    def __init__(self, params: Params, make: Callable[[Params], Any]):
        """make: gives the renderer of a sample's parameters."""
        own = params.flicker
        lamp, rest = params.light.luminance_cd_m2, params.background.luminance_cd_m2
        if lamp > 0 and rest > 0 and own.lamp_depth != own.surroundings_depth:
            self._columns = [0, 1]
            self._renderers = [make(_without(params, "background")), make(_without(params, "light"))]
        else:
            self._columns = [0 if lamp > 0 else 1]
            self._renderers = [make(params)]
        self._flicker = Flicker(params)

    def draw(self, poses: ScenePoses, index: int, scale: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
        """A frame as of a renderer, in the mean light."""
        parts, bodies = _stacked(tuple(one.draw(poses, index, scale) for one in self._renderers))
        return parts.sum(0), bodies

    def draw_single(self, poses: ScenePoses, times_us: np.ndarray, scale: float) -> Iterator[tuple[Any, Any]]:
        """Frames of the poses at the given times (n,), in the light of that moment."""
        for index, weights in enumerate(self._weights(times_us)):
            parts, bodies = _stacked(tuple(one.draw(poses, index, scale) for one in self._renderers))
            yield mix(parts, parts, weights, np.zeros_like(weights)), bodies

    def draw_sequence(
        self, poses: ScenePoses, keys_us: np.ndarray, times_us: np.ndarray, scale: float, live: bool = False
    ) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Frames at `times_us` (m,), of which the poses are those at `keys_us` (n,), drawn in sequence. What moves is
        taken as linear in time between two keys, which are as close as `schedule.frame_times` has them. live: as of
        `Raycaster.draw_sequence`."""
        sequences = [one.draw_sequence(poses, scale, **({"live": True} if live else {})) for one in self._renderers]
        drawn = (_stacked(frames) for frames in zip(*sequences, strict=True))
        weights, firsts = self._weights(times_us), np.searchsorted(times_us, keys_us)
        before = next(drawn)
        # A key's own frame comes before the next key is drawn, which live is not known yet.
        yield mix(before[0], before[0], weights[0], np.zeros_like(weights[0])), before[1].copy()
        for key, after in enumerate(drawn):
            start_us, end_us = keys_us[key], keys_us[key + 1]
            for k in range(firsts[key] + 1, firsts[key + 1]):
                share = (times_us[k] - start_us) / (end_us - start_us)
                own = before if share < 0.5 else after
                yield mix(before[0], after[0], (1 - share) * weights[k], share * weights[k]), own[1].copy()
            last = weights[firsts[key + 1]]
            yield mix(after[0], after[0], last, np.zeros_like(last)), after[1].copy()
            before = after

    def _weights(self, times_us: np.ndarray) -> np.ndarray:
        return self._flicker.brightness(times_us)[:, self._columns]


def mix(before: np.ndarray, after: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Sum of the images (parts, height, width) of two moments, with a weight for each, (parts,)."""
    out = np.zeros(before.shape[1:], np.float32)
    for part in range(len(before)):
        _add(out, before[part], after[part], np.float32(first[part]), np.float32(second[part]))
    return out


@kernel
def _add(out, before, after, first, second):
    """Add two images with their weights to `out`."""
    for row in range(out.shape[0]):
        here, one, other = out[row], before[row], after[row]
        for x in range(here.size):
            here[x] += first * one[x] + second * other[x]


def _stacked(frames: tuple[tuple[np.ndarray, np.ndarray], ...]) -> Parts:
    return np.stack([luminance for luminance, _ in frames]), frames[0][1]


def _without(params: Params, section: str) -> Params:
    """Scene with one of its lights off."""
    return params.model_copy(update={section: getattr(params, section).model_copy(update={"luminance_cd_m2": 0.0})})
