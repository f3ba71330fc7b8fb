"""Plan of a configuration's draws, worked out once for all of them."""

import hashlib
from collections.abc import Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

from evslip.config.config import Config
from evslip.config.distributions import Uniform
from evslip.config.sample import leaves
from evslip.draws.splits import TEXTURE, Dimension, divide
from evslip.events import preset_file
from evslip.physics.robots import catalogue
from evslip.scene.textures import library
from evslip.utils.errors import ConfigError
from evslip.utils.files import digest, named, stamp_of


class DrawPlan(NamedTuple):
    """Patterns replaced by the names they match, choices divided between the splits."""

    fixed: dict[str, Any]
    """Every key that is no choice, with its constant or range."""
    dimensions: tuple[Dimension, ...]
    """The choices, in the order of their first keys."""
    shares: dict[str, tuple[tuple[int, ...], ...]]
    """The rows of each dimension that a split, "train" or "test", draws from."""
    files: tuple[str, ...]
    """Paths of all textures, meshes and sensors' presets that are files, sorted."""
    constants: dict[str, frozenset[Any]]
    """Constants among the entries of every key that is a choice: no range next to them may yield one of them."""

    def varied(self) -> list[str]:
        """Keys that are not the same in every sample."""
        return [k for k, value in self.fixed.items() if isinstance(value, Uniform)] + list(self.constants)

    def grid_sizes(self, split: str) -> tuple[int, ...]:
        """Lengths of a split's lists that a grid combines."""
        rows = zip(self.dimensions, self.shares[split], strict=True)
        return tuple(len(share) for dimension, share in rows if not dimension.is_pool)


def make_plan(config: Config) -> DrawPlan:
    """The plan of a configuration. Folders of images are listed here, once. Raises ConfigError, also where the files
    are not those of the configuration's digest."""
    hashable: Any = config  # as a frozen model is, which type checkers do not know
    return _make_plan(hashable)


def pinned(config: Config) -> Config:
    """This configuration, with the digests of its robot's file and of all others that it names. Raises ConfigError."""
    files = _make_plan.__wrapped__(config).files  # as they are now, not as when a plan was kept
    robot = catalogue.pinned(config.robot)
    return config.model_copy(update={"robot": robot, "files_sha256": _digest(files) if files else None})


@lru_cache(maxsize=64)  # one for each kind of slip and its variants
def _make_plan(config: Config) -> DrawPlan:
    given = leaves(config)
    values = {key: _textures(key, value) if key.endswith(f".{TEXTURE}") else value for key, value in given.items()}
    groups = [
        tuple(key for key in group if isinstance(given[key], tuple) and given[key] == values[key])
        for group in config.together
    ]
    group_of = {key: group for group in groups for key in group}
    dimensions: dict[tuple[str, ...], Dimension] = {}
    for key, value in values.items():
        if isinstance(value, tuple):
            keys = group_of.get(key, (key,))
            rows = tuple(zip(*(values[k] for k in keys), strict=True))
            dimensions[keys] = Dimension(keys, rows, is_pool=value != given[key])
    choices = tuple(dimensions.values())
    files = tuple(sorted(set(_files(values))))
    if config.files_sha256 is not None and config.files_sha256 != (found := _digest(files)):
        raise ConfigError(
            "files_sha256: an image, a mesh or a sensor's preset has changed, or images have come or gone: the digest "
            f"of these files is {found[:12]}..., expected {config.files_sha256[:12]}...; bring the old files back, or "
            "begin a new data set"
        )
    entries = {key: column for d in choices for key, column in zip(d.keys, zip(*d.rows, strict=True), strict=True)}
    return DrawPlan(
        fixed={key: value for key, value in values.items() if key not in entries},
        dimensions=choices,
        shares=divide(choices, config.seed, config.test_share),
        files=files,
        constants={key: frozenset(e for e in column if not isinstance(e, Uniform)) for key, column in entries.items()},
    )


def _textures(key: str, value: Any) -> Any:
    """The names that a texture's patterns and folders stand for."""
    try:
        return library.expand(value, is_background=key.startswith("background."))
    except ConfigError as error:
        raise ConfigError(f"{key.removesuffix(TEXTURE)}{error}") from None


def _files(values: Mapping[str, Any]) -> Iterator[str]:
    """Names of files that a sample may be made of, its robot's aside."""
    pool = library.pool(True)
    for key, value in values.items():
        for name in value if isinstance(value, tuple) else (value,):
            is_texture = key.endswith(f".{TEXTURE}") and name not in pool
            is_preset = key == "sensor.preset" and name.endswith(preset_file.SUFFIX)
            if is_texture or is_preset or (key == "object.mesh" and name is not None):
                yield name


def _digest(files: tuple[str, ...]) -> str:
    """Digest of files' names, as a configuration has them, and of what is in them."""
    parts = tuple(part for file in files for part in _parts(file))
    return _digest_of(files, parts, tuple(map(stamp_of, parts)))


def _parts(file: str) -> tuple[Path, ...]:
    path, _ = named(file)
    return preset_file.files_of(path) if file.endswith(preset_file.SUFFIX) else (path,)


@lru_cache(maxsize=4)  # each kind of slip has a plan of its own, and all are of the same files
def _digest_of(files: tuple[str, ...], parts: tuple[Path, ...], stamps: tuple[tuple[int, int], ...]) -> str:
    del stamps  # of files that may be others the next time
    try:
        content = digest(parts)
    except OSError as error:
        raise ConfigError(f"{error.filename}: cannot be read: {error.strerror}") from None
    return hashlib.sha256("\n".join((*files, content)).encode("utf-8", "surrogateescape")).hexdigest()
