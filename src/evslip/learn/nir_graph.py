"""The spiking network in NIR, the Neuromorphic Intermediate Representation (Pedersen et al. 2024).

An SRM neuron with alpha kernels is what two leaky integrators in a row and a threshold do: their response to a spike is
r t/tau^2 exp(-t/tau), which with r = e tau is the alpha kernel. The refractory response is a second pair, from the
neuron's spikes back to its threshold. Times are in seconds, a bin being the window's length / 150. The graph begins at
the input neurons' spikes.
"""

import math
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import torch

from evslip.learn.layers import srm
from evslip.learn.networks.network import Geometry, Network
from evslip.learn.networks.snn import BINS, SNN
from evslip.utils import atomic
from evslip.utils.errors import ConfigError, DataError, MissingExtraError

LAYERS = ("linear1", "linear2")


def to_nir(network: Network) -> Any:
    """A spiking network as a nir.NIRGraph. Raises ConfigError for another network, MissingExtraError without nir."""
    if not isinstance(network, SNN):
        raise ConfigError(
            f"NIR is for spiking networks; expected a model of the network snn, not {type(network).__name__}"
        )
    nir = _nir()
    bin_s = network.geometry.length_us / 1e6 / BINS
    nodes: dict[str, Any] = {"input": nir.Input({"input": np.array([network.units])})}
    edges: list[tuple[str, str]] = []
    before = "input"
    for name in LAYERS:
        weight = getattr(network, name).weight.detach().cpu().numpy()
        number = len(weight)
        nodes[name] = nir.Linear(weight)
        _pair(nir, nodes, edges, f"{name}_response", number, srm.TAU * bin_s)
        nodes[f"{name}_spikes"] = nir.Threshold(np.full(number, srm.THETA))
        nodes[f"{name}_scale"] = nir.Scale(np.full(number, -srm.SCALE_REFRACTORY * srm.THETA))
        _pair(nir, nodes, edges, f"{name}_refractory", number, srm.TAU_REFRACTORY * bin_s)
        edges += [
            (before, name),
            (name, f"{name}_response_1"),
            (f"{name}_response_2", f"{name}_spikes"),
            (f"{name}_spikes", f"{name}_scale"),
            (f"{name}_scale", f"{name}_refractory_1"),
            (f"{name}_refractory_2", f"{name}_spikes"),
        ]
        before = f"{name}_spikes"
    nodes["output"] = nir.Output({"output": np.array([2])})
    return nir.NIRGraph(nodes, [*edges, (before, "output")])


def write_nir(network: Network, path: str | Path) -> None:
    """Write the graph of a spiking network as NIR's HDF5 file. Raises ConfigError, MissingExtraError, StorageError."""
    graph, path = to_nir(network), Path(path)
    with atomic.staged(path) as file:
        _nir().write(file, graph)


def read_nir(path: str | Path, geometry: Geometry | None = None) -> SNN:
    """The spiking network of a file that `write_nir` wrote. Raises DataError if it is not one, MissingExtraError."""
    nir = _nir()
    network = SNN(geometry)
    try:
        found = nir.read(str(path)).nodes
        with torch.no_grad():
            for name in LAYERS:
                getattr(network, name).weight.copy_(torch.from_numpy(found[name].weight))
        for name, node in to_nir(network).nodes.items():
            for parameter in ("tau", "r", "threshold", "scale"):
                if hasattr(node, parameter):
                    np.testing.assert_allclose(getattr(found[name], parameter), getattr(node, parameter), rtol=1e-5)
    except (OSError, KeyError, AttributeError, ValueError, RuntimeError, TypeError, AssertionError) as error:
        reason = " ".join(str(error).split())[:120]
        raise DataError(f"{path}: not the graph of an snn that evslip wrote: {reason}") from None
    return network.eval()


def _pair(nir: Any, nodes: dict[str, Any], edges: list[tuple[str, str]], name: str, number: int, tau_s: float) -> None:
    """Two leaky integrators whose response to a spike is the alpha kernel."""
    for place, gain in ((1, 1.0), (2, math.e * tau_s)):
        tau, r, rest = (np.full(number, value) for value in (tau_s, gain, 0.0))
        nodes[f"{name}_{place}"] = nir.LI(tau, r, rest)
    edges.append((f"{name}_1", f"{name}_2"))


def _nir() -> Any:
    if not find_spec("nir"):
        raise MissingExtraError("NIR files need nir; pip install 'evslip[nir]'")
    import nir

    return nir
