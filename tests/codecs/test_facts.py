"""Facts that `evslip info` prints, against loops over the events."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from evslip.codecs import read_events, source, write_events
from evslip.codecs.facts import Facts, examine
from evslip.data import record_file
from evslip.data.record import about
from evslip.events.frame import BODIES, NO_BODY
from evslip.events.stream import CAUSES, Events
from evslip.utils.errors import DataError
from sample_records import random_events, simulated


def by_brute_force(events: Events, size: tuple[int, int], gap_us: int) -> dict:
    t = events.t_us.tolist()
    steps = [(after - before, before) for before, after in pairwise(t)]
    stretches: dict[int, int] = {}
    pixels: dict[tuple[int, int], int] = {}
    for time, x, y in zip(t, events.x.tolist(), events.y.tolist(), strict=True):
        stretches[time // 10_000] = stretches.get(time // 10_000, 0) + 1
        if x < size[0] and y < size[1]:
            pixels[x, y] = pixels.get((x, y), 0) + 1
    return {
        "count": len(t),
        "on": sum(events.p.tolist()),
        "start_us": min(t),
        "end_us": max(t),
        "peak_hz": max(stretches.values()) * 100,
        "gaps": sum(step > gap_us for step, _ in steps),
        "gap_us": max([step for step, _ in steps] + [0]),
        "disorder": sum(step < 0 for step, _ in steps),
        "outside": sum(x >= size[0] or y >= size[1] for x, y in zip(events.x, events.y, strict=True)),
        "active_pixels": len(pixels),
        "most": max(pixels.values(), default=0),
    }


def told(facts: Facts) -> dict:
    return facts.as_json() | {"most": facts.busiest[2]}


@settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.integers(0, 2**32), st.integers(1, 400), st.sampled_from([5, 3000]))
def test_facts_are_those_of_a_loop(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, seed: int, count: int, step: int):
    monkeypatch.setattr(source, "BLOCK_BYTES", 800)
    rng = np.random.default_rng(seed)
    steps = rng.integers(0, step, count)
    events = random_events(rng, count, labelled=False).replace(t_us=np.cumsum(steps))
    write_events(tmp_path / "a.dat", events, (40, 30))
    expected = by_brute_force(events, (40, 30), 1500)
    facts, _ = examine(tmp_path / "a.dat", 1500)
    assert {name: told(facts)[name] for name in expected} == expected
    assert (facts.size, facts.format) == ((40, 30), "dat")


def test_errors_are_counted_not_refused(tmp_path: Path):
    rows = ["t_us,x,y,p", "5,1,1,1", "9,2,2,0", "7,60,1,1", "30000,3,3,1"]
    (tmp_path / "a.csv").write_text("\n".join(rows) + "\n")
    facts, _ = examine(tmp_path / "a.csv")
    assert (facts.disorder, facts.outside, facts.size, facts.extent) == (1, 0, None, (61, 4))
    assert (facts.start_us, facts.end_us, facts.gaps, facts.gap_us, facts.gap_start_us) == (5, 30000, 1, 29993, 7)
    assert any("1 events out of order" in line for line in facts.lines(10_000))
    header = b"% Version 2\n% Width 2\n% Height 2\n\x0c\x08"
    (tmp_path / "a.dat").write_bytes(header + np.array([1, 0, 2, 5], "<u4").tobytes())
    assert examine(tmp_path / "a.dat")[0].outside == 1


def test_labels_and_what_a_record_knows_are_told(tmp_path: Path):
    sample = simulated()
    record_file.write(tmp_path / "a.h5", sample)
    facts, _ = examine(tmp_path / "a.h5")
    events = sample.events
    assert facts.causes == {name: int((events.cause == i).sum()) for i, name in enumerate(CAUSES)}
    expected = {name: int((events.body == i).sum()) for i, name in enumerate(BODIES)}
    assert facts.bodies == expected | {"unknown": int((events.body == NO_BODY).sum())}
    assert about(sample) == {"record": "train/0000000, simulated", "truth": "slip, from 0.001 s"}


def test_no_events_and_huge_sensors_are_told(tmp_path: Path):
    write_events(tmp_path / "a.npz", random_events(np.random.default_rng(0), 0), (40, 30))
    assert examine(tmp_path / "a.npz")[0].lines(10)[-1].endswith("0 events out of order, 0 beyond the sensor")
    alone = Events(np.array([5_000_000]), *np.zeros((2, 1), np.uint16), np.ones(1, bool))
    write_events(tmp_path / "c.npz", alone, (40, 30))
    assert any(
        "0 of over 10 ms; the longest 0 ms, 0.000 s after" in line
        for line in examine(tmp_path / "c.npz")[0].lines(10_000)
    )
    corner = np.array([0, 65535], np.uint16)
    far = Events(np.array([1, 2]), corner, corner, np.ones(2, bool))
    write_events(tmp_path / "b.npz", far)
    facts, _ = examine(tmp_path / "b.npz")
    assert (facts.extent, facts.active_pixels, facts.busiest[2]) == ((65536, 65536), 0, 0)


@pytest.mark.parametrize(
    ("name", "column", "message"),
    [
        ("t_us", [1.5, 2.5], r"events/t_us: float64 of shape \(2,\), expected int64"),
        ("x", [-1, 2], "events/x: int64 .*, expected uint16"),
        ("y", ["1", "2"], "events/y: <U1 .*, expected uint16"),
        ("p", np.array([1, -1], np.int8), "events/p: int8 .*, expected bool"),
    ],
)
def test_columns_of_other_types_are_refused_as_they_are_by_a_reader(tmp_path: Path, name: str, column, message: str):
    short = np.array([1, 2], np.uint16)
    columns = {"t_us": np.array([1, 2]), "x": short, "y": short, "p": short > 1} | {name: np.array(column)}
    np.savez(tmp_path / "a.npz", size=[40, 30], **columns)
    for read in (examine, read_events):
        with pytest.raises(DataError, match=rf"a\.npz: {message}"):
            read(tmp_path / "a.npz")


def test_damage_is_an_error(tmp_path: Path):
    (tmp_path / "a.dat").write_bytes(b"% Version 2\n\x0c\x08123")
    with pytest.raises(DataError, match="left over"):
        examine(tmp_path / "a.dat")
