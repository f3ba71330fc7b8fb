"""Objects of other packages, by name or by the entry points under which installed packages offer them."""

from importlib.metadata import EntryPoint, entry_points
from typing import Any

from evslip.utils.errors import ConfigError


def installed(group: str) -> dict[str, str]:
    """Offers of installed packages in a group of entry points: name -> `module` or `module:object`, not yet loaded."""
    return {entry.name: entry.value for entry in sorted(entry_points(group=group), key=lambda entry: entry.name)}


def load(name: str) -> Any:
    """A module by its name, or what it holds by `module:object`. Raises ConfigError, whatever the module does."""
    try:
        return EntryPoint(name, name, "").load()
    except (Exception, SystemExit) as error:  # a script that ends at once is none of a library
        reason = " ".join(f"{type(error).__name__}: {error}".split())[:160]
        raise ConfigError(f"{name} cannot be loaded: {reason}; expected module or module:object") from error
