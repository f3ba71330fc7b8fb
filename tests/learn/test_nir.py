"""The spiking network's NIR graph: it reloads, and simulated as a graph it spikes as the network does."""

from typing import Any

import numpy as np
import pytest
import torch

from evslip.cli.detect import export
from evslip.learn import build_model
from evslip.learn.checkpoint import Description, save_model
from evslip.learn.layers import patterns
from evslip.learn.networks.snn import SNN
from evslip.utils.errors import ConfigError, DataError, MissingExtraError
from evslip.windows.window_set import WindowSettings
from learn_windows import random_window

nir = pytest.importorskip("nir")

from evslip.learn.nir_graph import read_nir, to_nir, write_nir  # noqa: E402 (needs nir)


@pytest.fixture(scope="module")
def network() -> SNN:
    torch.manual_seed(2)
    network = build_model("snn")
    assert isinstance(network, SNN)
    with torch.no_grad():  # so that it spikes before it is trained
        network.linear1.weight += 0.3
        network.linear2.weight += 3
    return network


def simulated(graph: Any, spikes: np.ndarray, bin_s: float) -> np.ndarray:
    """Output spikes of a graph for input spikes (units, bins): each node in turn, leaky integrators sampled exactly."""
    state = {name: np.zeros(node.input_type["input"]) for name, node in graph.nodes.items()}
    fed = {name: [a for a, b in graph.edges if b == name] for name in graph.nodes}
    out = np.zeros((2, spikes.shape[1]))
    for t in range(spikes.shape[1]):
        # A pair of integrators answers a spike from the next bin on: state 2 first, with state 1 as it was.
        for name, node in graph.nodes.items():
            if isinstance(node, nir.LI) and name.endswith("_2"):
                leak, (source,) = np.exp(-bin_s / node.tau), fed[name]
                state[name] = leak * (state[name] + node.r * bin_s / node.tau * state[source])
        for name, node in graph.nodes.items():
            if isinstance(node, nir.LI) and name.endswith("_1"):
                state[name] = np.exp(-bin_s / node.tau) * state[name]
        said = {"input": spikes[:, t]}
        for name in ("linear1", "linear2"):
            threshold = graph.nodes[f"{name}_spikes"]
            drive = sum(state[source] for source in fed[f"{name}_spikes"])
            said[f"{name}_spikes"] = (drive >= threshold.threshold).astype(float)
            back = graph.nodes[f"{name}_scale"].scale * said[f"{name}_spikes"]
            refractory, response = graph.nodes[f"{name}_refractory_1"], graph.nodes[f"{name}_response_1"]
            state[f"{name}_refractory_1"] = state[f"{name}_refractory_1"] + refractory.r / refractory.tau * back
            weighted = graph.nodes[name].weight @ said[fed[name][0]]
            state[f"{name}_response_1"] = state[f"{name}_response_1"] + response.r / response.tau * weighted
        out[:, t] = said["linear2_spikes"]
    return out


def test_the_graph_spikes_as_the_network(network: SNN) -> None:
    batch = [network.prepare(random_window(0, 4000))]
    spikes = patterns.dense(batch, network.input_neurons.units, 150)[0].T.numpy().astype(np.float64)
    expected = network.spikes(batch)[0].detach().numpy()
    found = simulated(to_nir(network), spikes, 0.16 / 150)
    assert expected.sum() > 10
    assert (found != expected).mean() < 0.02  # a spike may move by a bin where the potential grazes the threshold


def test_a_file_reloads_and_agrees(network: SNN, tmp_path) -> None:
    write_nir(network, tmp_path / "snn.nir")
    again = read_nir(tmp_path / "snn.nir")
    batch = [network.prepare(random_window(seed, 4000)) for seed in range(2)]
    torch.testing.assert_close(again(batch), network(batch), rtol=0, atol=0)


def test_the_command_line_exports_a_saved_network(network: SNN, tmp_path, capsys, monkeypatch) -> None:
    save_model(tmp_path, network, Description("snn", 0.5, WindowSettings(), {}))
    export(tmp_path, tmp_path / "out.nir")
    assert "201,664 weights" in capsys.readouterr().out
    assert torch.equal(read_nir(tmp_path / "out.nir").linear1.weight, network.linear1.weight)
    monkeypatch.setattr("evslip.learn.nir_graph.find_spec", lambda name: None)
    with pytest.raises(MissingExtraError, match=r"evslip\[nir\]"):
        export(tmp_path, tmp_path / "again.nir")
    save_model(tmp_path, build_model("event_rate"), Description("event_rate", 0.5, WindowSettings(), {}))
    with pytest.raises(ConfigError, match="network snn"):  # also where the extra is missing: it would not help
        export(tmp_path, tmp_path / "again.nir")
    assert not (tmp_path / "again.nir").exists()


def test_what_is_no_such_network_is_refused(tmp_path) -> None:
    with pytest.raises(ConfigError, match="snn"):
        write_nir(build_model("event_rate"), tmp_path / "other.nir")
    (tmp_path / "text.nir").write_text("hello")
    with pytest.raises(DataError, match=r"text\.nir"):
        read_nir(tmp_path / "text.nir")
    graph = to_nir(build_model("snn"))
    graph.nodes["linear1_response_1"].tau *= 2
    nir.write(tmp_path / "slow.nir", graph)
    with pytest.raises(DataError, match=r"slow\.nir"):
        read_nir(tmp_path / "slow.nir")
