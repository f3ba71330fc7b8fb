"""Networks by name."""

from evslip.learn.networks.cnn3d import CNN3d, CNN3dNorm
from evslip.learn.networks.countnet import CountNet
from evslip.learn.networks.evgru import EvGRU
from evslip.learn.networks.features import EventRate, Flow, RateMap
from evslip.learn.networks.mlp import MLP
from evslip.learn.networks.network import Geometry, Network
from evslip.learn.networks.snn import SNN
from evslip.learn.networks.voxelnet import VoxelNet
from evslip.utils.errors import ConfigError

__all__ = ["NETWORKS", "Geometry", "Network", "build_model", "network_class"]

NETWORKS: dict[str, type[Network]] = {
    "mlp": MLP,
    "snn": SNN,
    "cnn3d": CNN3d,
    "cnn3d_bn": CNN3dNorm,
    "voxelnet": VoxelNet,
    "countnet": CountNet,
    "evgru": EvGRU,
    "event_rate": EventRate,
    "rate_map": RateMap,
    "flow": Flow,
}


def network_class(name: str) -> type[Network]:
    """The class of a network. Raises ConfigError."""
    if name not in NETWORKS:
        raise ConfigError(f"model: {name!r} is unknown; expected one of {', '.join(NETWORKS)}")
    return NETWORKS[name]


def build_model(name: str, geometry: Geometry | None = None) -> Network:
    """A network with fresh weights from torch's generator. Raises ConfigError."""
    return network_class(name)(geometry)
