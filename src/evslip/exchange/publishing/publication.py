"""Settings of a publication. Light to import, for the command line."""

from dataclasses import dataclass
from datetime import date
from pathlib import Path

from evslip.utils.errors import ConfigError
from evslip.utils.files import printable


@dataclass(frozen=True, kw_only=True)
class Publication:
    """Name, licence and author under which a data set is published."""

    name: str | None = None
    """Default: that of its folder."""
    license: str = "cc-by-4.0"
    """Identifier of SPDX."""
    webdataset: bool = False
    """Records in tar shards instead of single files."""
    huggingface: bool = False
    """Let `datasets.load_dataset(FOLDER)` of Hugging Face find the splits."""
    lerobot: bool = False
    """Episodes in LeRobot's format v3.0 instead: Parquet, MP4, meta; of simulated samples."""
    fps: int = 30
    """Frames a second of these episodes."""
    camera: str | None = None
    """The camera whose events and pictures these episodes have, of samples that two saw: left or right."""
    shard_mb: float = 500.0
    """A shard is closed once it holds this much, in MB."""
    date_published: str | None = None
    """YYYY-MM-DD."""
    cite_as: str | None = None
    """How to cite it, as BibTeX or a sentence."""

    def __post_init__(self) -> None:
        for key in ("name", "license"):
            text = getattr(self, key) or ""
            if text.splitlines() not in ([], [text]):
                raise ConfigError(f"{key}: {text[:60]!r} has line breaks; expected one line")
        if not 0.001 <= self.shard_mb <= 1e6:
            raise ConfigError(f"shard_mb: {self.shard_mb:g} is out of range, expected 0.001 to 1000000")
        if not 1 <= self.fps <= 1000:
            raise ConfigError(f"fps: {self.fps} is out of range, expected 1 to 1000")
        if self.lerobot and (self.webdataset or self.huggingface):
            raise ConfigError("lerobot: has a layout of its own; expected neither webdataset nor huggingface")
        if self.camera is not None and not self.lerobot:
            raise ConfigError("camera: records are published whole; expected camera with lerobot alone")
        if self.date_published is not None and not _is_day(self.date_published):
            raise ConfigError(f"date_published: {self.date_published!r} is no day, expected YYYY-MM-DD")

    def name_of(self, source: str | Path) -> str:
        """The name of the publication of a data set, as one line of text: a folder's may be of any bytes."""
        return self.name or " ".join(printable(Path(source).resolve().name).splitlines())

    @property
    def metadata(self) -> dict[str, str]:
        """Date and citation, where they are known, by their names in schema.org and Croissant."""
        known = {"datePublished": self.date_published, "citeAs": self.cite_as}
        return {name: value for name, value in known.items() if value}


def _is_day(text: str) -> bool:
    try:
        return date.fromisoformat(text).isoformat() == text
    except ValueError:
        return False
