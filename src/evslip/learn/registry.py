"""Networks by name."""

from collections.abc import Callable

from evslip.errors import ConfigError
from evslip.learn.cnn3d import CNN3d
from evslip.learn.network import Geometry, Network

NETWORKS: dict[str, Callable[[Geometry], Network]] = {
    "cnn3d": CNN3d,
    "cnn3d_bn": lambda geometry: CNN3d(geometry, batch_norm=True, dropout=0.5),
}


def build_model(name: str, geometry: Geometry | None = None) -> Network:
    """A network with fresh weights from torch's generator. Raises ConfigError."""
    if name not in NETWORKS:
        raise ConfigError(f"model: {name!r} is unknown; expected one of {', '.join(NETWORKS)}")
    return NETWORKS[name](geometry or Geometry())
