"""Sources of controllers beside their parameters: what one has played counts as long as they are the same."""

import ast
import hashlib
from collections.abc import Iterator, Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

from evslip.utils.plugins import load

INSTALLED = ("site-packages", "dist-packages")
"""Folders of many packages, of which a controller's own alone counts."""


def sources_of(controller: str, parameters: Mapping[str, Any]) -> dict[str, str]:
    """SHA-256 of what a controller is made of that a user may change: "source" of one of another package, "model" of
    one that asks a detector in a folder. Raises ConfigError."""
    found = {"source": source_of(controller)} if ":" in controller else {}
    model = parameters.get("model")
    if not isinstance(model, str):
        return found
    from evslip.learn.checkpoint import DESCRIPTION, WEIGHTS, is_shipped

    if not is_shipped(model):
        files = [Path(model) / name for name in (DESCRIPTION, WEIGHTS)]
        if all(one.is_file() for one in files):
            found["model"] = hashlib.sha256(b"".join(one.read_bytes() for one in files)).hexdigest()
    return found


def source_of(policy: str) -> str:
    """SHA-256 of the source of a policy, module:Class, and of what it imports that lies in the same folder or package.
    Other files that it reads, such as weights, are not seen. Raises ConfigError."""
    load(policy)
    module = import_module(policy.partition(":")[0].strip())
    if getattr(module, "__file__", None) is None:
        return ""
    file = Path(str(module.__file__))
    root = file.parents[module.__name__.count(".") + hasattr(module, "__path__")]
    own = module.__name__.partition(".")[0]
    files, left = {file}, [(module.__name__, file)]
    while left:
        for name in _imports(*left.pop()):
            found = _file_of(root, name)
            is_own = root.name not in INSTALLED or name.partition(".")[0] == own
            if found is not None and is_own and found not in files:
                files.add(found)
                left.append((name, found))
    digest = hashlib.sha256()
    for one in sorted(files):
        text = one.read_bytes()
        digest.update(f"{one.relative_to(root)} {len(text)}\n".encode() + text)
    return digest.hexdigest()


def _imports(name: str, file: Path) -> Iterator[str]:
    """Names that may be of modules, of all that a module imports, wherever in it."""
    try:
        tree = ast.parse(file.read_bytes())
    except (SyntaxError, ValueError):  # no Python, or none that can be imported
        return
    package = name.split(".") if file.name == "__init__.py" else name.split(".")[:-1]
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield from _with_packages(alias.name)
        elif isinstance(node, ast.ImportFrom):
            above = package[: len(package) - node.level + 1] if node.level else []
            base = ".".join([*above, *filter(None, [node.module])])
            yield from _with_packages(base)
            yield from (f"{base}.{alias.name}" for alias in node.names)


def _with_packages(name: str) -> Iterator[str]:
    """A module's name, and those of the packages around it."""
    parts = name.split(".")
    return (".".join(parts[: k + 1]) for k in range(len(parts)))


def _file_of(root: Path, name: str) -> Path | None:
    """File of a module below a folder."""
    place = root.joinpath(*name.split("."))
    return next((one for one in (place / "__init__.py", place.with_name(f"{place.name}.py")) if one.is_file()), None)
