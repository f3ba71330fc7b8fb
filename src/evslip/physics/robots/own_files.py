"""Files that a robot's file names."""

from pathlib import Path

from evslip.utils.errors import ConfigError

MOST_BYTES = 32 << 20
MESHES = (".stl", ".obj", ".ply", ".dae")


def require_mesh(file: Path, key: str) -> None:
    """Raise ConfigError, which begins with `key`, unless there is a mesh file that is not too large."""
    if file.suffix.lower() not in MESHES:
        raise ConfigError(f"{key}: {file.name}: unknown kind of mesh; expected one of {', '.join(MESHES)}")
    if not file.is_file():
        raise ConfigError(f"{key}: {file.name}: there is no such file, {file}")
    if file.stat().st_size > MOST_BYTES:
        raise ConfigError(f"{key}: {file.name}: larger than {MOST_BYTES >> 20} MB; simplify the mesh")
