"""Formats of files of events: evslip's own in one list, and those of other packages."""

import importlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from evslip.utils import plugins
from evslip.utils.errors import ConfigError, DataError

GROUP = "evslip.codecs"
"""Entry points of installed packages that offer formats."""


@dataclass(frozen=True)
class Format:
    """A format of files of events, and what it can hold beside them."""

    name: str
    origin: Any
    """Its codec (see `evslip.codecs`), or the name of the module that is its codec."""
    suffixes: tuple[str, ...]
    """In lower case; each is of one format."""
    writes: bool = True
    keeps_size: bool = True
    keeps_labels: bool = False
    keeps_settings: bool = False
    keeps_cameras: bool = False
    """Whether it may have the events of several cameras."""
    compresses: bool = False
    """Whether its files may be compressed."""

    @property
    def codec(self) -> Any:
        """The module or object that reads and writes files of the format."""
        return importlib.import_module(self.origin) if isinstance(self.origin, str) else self.origin


HDF5 = Format(
    "hdf5",
    "evslip.codecs.arrays.hdf5",
    (".h5", ".hdf5"),
    keeps_labels=True,
    keeps_settings=True,
    keeps_cameras=True,
    compresses=True,
)
"""The format of records, too."""
ROSBAG2 = Format("rosbag2", "evslip.codecs.ros.bag2", (".db3", ".mcap"), keeps_cameras=True, compresses=True)
"""Its folders, too."""
FORMATS = (
    HDF5,
    Format("aedat4", "evslip.codecs.inivation.aedat4", (".aedat4",), keeps_cameras=True, compresses=True),
    Format("raw", "evslip.codecs.prophesee.raw", (".raw",)),
    Format("dat", "evslip.codecs.prophesee.dat", (".dat",)),
    Format("es", "evslip.codecs.es", (".es",)),
    Format("npz", "evslip.codecs.arrays.npz", (".npz",), keeps_labels=True, keeps_settings=True, compresses=True),
    Format("csv", "evslip.codecs.text.csv", (".csv",), keeps_size=False),
    Format("txt", "evslip.codecs.text.txt", (".txt",), keeps_size=False),
    Format("mat", "evslip.codecs.arrays.mat", (".mat",), keeps_size=False, compresses=True),
    Format("aedat2", "evslip.codecs.inivation.aedat2", (".aedat",), writes=False),
    Format("rosbag", "evslip.codecs.ros.bag", (".bag",), keeps_cameras=True, compresses=True),
    ROSBAG2,
)
"""Formats that evslip brings along."""
_others: dict[str, Format] = {}
"""Formats of other packages, by name."""


def known_suffixes(writing: bool = False) -> list[str]:
    """Suffixes of the formats that can be read, or written; of other packages those that are registered."""
    return [suffix for form in (*FORMATS, *_others.values()) if form.writes or not writing for suffix in form.suffixes]


def format_of(path: str | Path, writing: bool = False) -> Format:
    """The format of a file, by its suffix; a folder with metadata.yaml is a ROS 2 bag. Raises DataError, with the known
    suffixes, for one that cannot be read, or written."""
    suffix, broken = Path(path).suffix.lower(), []
    found = ROSBAG2 if is_bag_folder(path) and not writing else _with_suffix(suffix)
    if found is None:  # looked for only now: it takes a moment
        broken = _register_installed()
        found = _with_suffix(suffix)
    if found is None or (writing and not found.writes):
        known = f"known are {', '.join(known_suffixes(writing))}"
        problem = f"{path}: no format of events that can be {'written' if writing else 'read'}; {known}"
        raise DataError("; ".join([problem, *broken]))
    return found


def is_bag_folder(path: str | Path) -> bool:
    """Whether a path is the folder of a ROS 2 bag, which is read like a file of events."""
    return (Path(path) / "metadata.yaml").is_file()


def stem_of(path: str | Path) -> str:
    """Name of a recording without the suffix of its format; the name of a folder has none, whatever its dots."""
    return Path(path).name if is_bag_folder(path) else Path(path).stem


def recordings_in(folder: str | Path) -> list[Path]:
    """Readable recordings of events in a folder, by name: files, and folders that are a ROS 2 bag."""
    known = known_suffixes()
    return [
        one
        for one in sorted(Path(folder).iterdir())
        if is_bag_folder(one) or (one.is_file() and one.suffix.lower() in known)
    ]


def register(codec: Any, name: str = "") -> Format:
    """Take a format from another package: its codec, or the name of that as `module` or `module:object`.

    Files with its suffixes are then read and written as all others are. A codec has what a module of evslip.codecs has,
    and `suffixes`, such as (".abc",); `keeps_size` and `keeps_labels` say whether its files hold the sensor's size
    (default: True) and the labels (False). name: the format's; default: the codec's. Raises ConfigError.
    """
    title = codec if isinstance(codec, str) else getattr(codec, "__name__", type(codec).__name__)
    codec = plugins.load(codec) if isinstance(codec, str) else codec
    suffixes: Any = getattr(codec, "suffixes", None)
    are_listed = isinstance(suffixes, list | tuple) and all(isinstance(s, str) and s[:1] == "." != s for s in suffixes)
    if not are_listed or not callable(getattr(codec, "stream", None)):
        raise ConfigError(f"{title}: not a codec of events; expected suffixes such as ('.abc',) and stream(path)")
    form = Format(
        name or title.replace(":", ".").rpartition(".")[2],
        codec,
        tuple(suffix.lower() for suffix in suffixes),
        writes=hasattr(codec, "Sink") or hasattr(codec, "write"),
        keeps_size=getattr(codec, "keeps_size", True),
        keeps_labels=getattr(codec, "keeps_labels", False),
    )
    for suffix in form.suffixes:
        taken = _with_suffix(suffix)
        if taken is not None and taken.name != form.name:
            raise ConfigError(f"{title}: the suffix {suffix} is that of {taken.name}; expected others")
    if any(form.name == own.name for own in FORMATS):
        raise ConfigError(f"{title}: {form.name} is a format of evslip; expected another name")
    _others[form.name] = form
    return form


def _with_suffix(suffix: str) -> Format | None:
    return next((form for form in (*FORMATS, *_others.values()) if suffix in form.suffixes), None)


def _register_installed() -> list[str]:
    """Take the formats of installed packages; what is wrong with some of them, a line each."""
    broken = []
    for name, codec in plugins.installed(GROUP).items():
        if name not in _others:
            try:
                register(codec, name)
            except ConfigError as error:
                broken.append(f"entry point {name} of {GROUP}: {error}")
    return broken
