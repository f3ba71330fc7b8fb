"""Networks by name: evslip's own, those of installed packages, and what a user names as `module:Class`.

Begin with `network.Network`, or `speed_network.SpeedNetwork` for one that also estimates speeds. A new one is a file
here and a line in NETWORKS, or a class in a package of yours. Only what the user names, or an installed package offers,
is imported: never what a model's folder alone asks for.
"""

import importlib
from typing import TYPE_CHECKING, Any

from evslip.utils import plugins
from evslip.utils.errors import ConfigError

if TYPE_CHECKING:
    from evslip.learn.networks.network import Geometry, Network

__all__ = ["NETWORKS", "Geometry", "Network", "build_model", "network_class", "register", "stored_class"]
GROUP = "evslip.networks"
"""Entry points of installed packages that offer networks."""
_HERE = "evslip.learn.networks"
NETWORKS = {
    "mlp": f"{_HERE}.mlp:MLP",
    "snn": f"{_HERE}.snn:SNN",
    "cnn3d": f"{_HERE}.cnn3d:CNN3d",
    "cnn3d_bn": f"{_HERE}.cnn3d:CNN3dNorm",
    "voxelnet": f"{_HERE}.voxelnet:VoxelNet",
    "countnet": f"{_HERE}.countnet:CountNet",
    "evgru": f"{_HERE}.evgru:EvGRU",
    "slipnet": f"{_HERE}.slipnet:SlipNet",
    "event_rate": f"{_HERE}.features:EventRate",
    "rate_map": f"{_HERE}.features:RateMap",
    "flow": f"{_HERE}.features:Flow",
}
"""Networks that evslip brings along: the class of each as `module:Class`, not yet imported."""
_named: set[str] = set()
"""Classes, as `module:Class`, that the user has named."""


def __getattr__(name: str) -> Any:
    if name not in ("Geometry", "Network"):  # which would import PyTorch
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{_HERE}.network"), name)


def __dir__() -> list[str]:
    return __all__


def register(network: str) -> None:
    """Allow a class, `module:Class`, to be imported where a model's folder names it, too. Raises ConfigError unless it
    is a network."""
    _load(network, network)
    _named.add(network)


def network_class(name: str) -> "type[Network]":
    """The class of a network that the user names; `module:Class` is registered, too. Raises ConfigError."""
    if ":" in name:
        register(name)
    return stored_class(name)


def stored_class(name: str) -> "type[Network]":
    """The class of a network that a model's folder names: evslip's own, of an installed package or registered. Raises
    ConfigError."""
    offered = {} if name in NETWORKS else plugins.installed(GROUP)
    known = offered | NETWORKS
    if name in known or name in _named or name in offered.values():
        return _load(known.get(name, name), name)
    if ":" in name:
        raise ConfigError(
            f"model: {name!r} is of another package, which offers it under no entry point {GROUP}; if you trust it, "
            f"name it: --network {name}, or evslip.learn.networks.register"
        )
    names = ", ".join(NETWORKS | offered)
    raise ConfigError(f"model: {name!r} is unknown; expected one of {names}, or module:Class")


def build_model(name: str, geometry: "Geometry | None" = None) -> "Network":
    """A network with fresh weights from torch's generator. Raises ConfigError."""
    return network_class(name)(geometry)


def _load(origin: str, name: str) -> "type[Network]":
    from evslip.learn.networks.network import Network

    found = plugins.load(origin)
    if not (isinstance(found, type) and issubclass(found, Network)):
        raise ConfigError(f"model: {name} is no network; expected a subclass of {_HERE}.network.Network")
    return found
