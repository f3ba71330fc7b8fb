"""A cluster of two nodes, each with a raylet and workers of its own, on this machine."""

import hashlib
import os
import sys
from pathlib import Path

import pytest

import evslip
from evslip.generation.progress import Progress
from evslip.generation.runners import runner
from evslip.utils.errors import ConfigError, MissingExtraError

CHEAP = Path(__file__).parents[2] / "benchmarks" / "cheap.toml"
COUNT = 24


def records(root: Path) -> dict[str, str]:
    """Path and hash of every record."""
    files = sorted((root / "samples").rglob("*.h5"))
    return {str(f.relative_to(root)): hashlib.sha256(f.read_bytes()).hexdigest() for f in files}


class KillANode(Progress):
    """Lets the machines' power fail half-way."""

    def __init__(self, cluster, node):
        self.cluster, self.node, self.count, self.notices = cluster, node, 0, []

    def made(self, made):
        self.count += 1
        if self.count == COUNT // 4:
            self.cluster.remove_node(self.node, allow_graceful=False)

    def notice(self, text):
        self.notices.append(text)


@pytest.mark.slow
@pytest.mark.filterwarnings("default")  # Ray's own
def test_a_cluster_that_loses_a_node_half_way_makes_the_same_bytes(tmp_path, monkeypatch):
    pytest.importorskip("ray")
    from ray.cluster_utils import Cluster

    monkeypatch.setenv("RAY_USAGE_STATS_ENABLED", "0")
    node = {"num_cpus": 1, "object_store_memory": 80_000_000}
    cluster = Cluster(initialize_head=True, head_node_args={**node, "include_dashboard": False})
    try:
        watcher = KillANode(cluster, cluster.add_node(**node))
        summary = evslip.generate(
            CHEAP, tmp_path / "ray", COUNT, runner_name=f"ray:{cluster.address}", progress=watcher
        )
    finally:
        cluster.shutdown()
    assert watcher.notices[0] == "Ray: nodes: 2, cores: 2"
    # Whether the lost node was at work just then, and is missed, is Ray's affair: see the next test.
    assert watcher.count == COUNT
    assert sorted(made.entry["index"] for made in summary.made) == list(range(COUNT))
    assert evslip.open_dataset(tmp_path / "ray").verify() == []
    evslip.generate(CHEAP, tmp_path / "local", COUNT, workers=1)
    assert records(tmp_path / "ray") == records(tmp_path / "local")


def test_without_ray_one_line_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(MissingExtraError, match=r"ray is not installed; pip install .*evslip\[ray\]"):
        next(runner("ray")(abs, [1], 1))


def test_a_cluster_that_does_not_answer_is_named():
    pytest.importorskip("ray")
    with pytest.raises(ConfigError, match=r"no Ray cluster at 127\.0\.0\.1:9"):
        next(runner("ray:127.0.0.1:9")(abs, [1], 1))


@pytest.mark.slow
@pytest.mark.filterwarnings("default")
def test_a_ray_of_this_machine_survives_workers_that_die(tmp_path, monkeypatch):
    pytest.importorskip("ray")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(Path(__file__).parent), os.environ.get("PYTHONPATH", "")]))
    notices = []
    tasks = [str(tmp_path / "once"), *map(str, range(5))]
    done = list(runner("ray")(die_once, tasks, 1, notices.append))
    assert sorted(done) == sorted(tasks)
    assert any("lost" in notice for notice in notices)


def die_once(task: str) -> str:
    """Of a path: die unless the file is there, having made it."""
    path = Path(task)
    if path.is_absolute() and not path.exists():
        path.touch()
        os._exit(1)
    return task
