"""Triggers beside the events of a file: counted, and said to be left out."""

import json
from pathlib import Path

import numpy as np
import pytest

from command_line import evslip
from evslip.codecs import read_events
from evslip.codecs.prophesee.triggers import Evt3Decoder
from evslip.codecs.triggers import FALLING, RISING, TriggerFacts, Triggers, trigger_facts
from evslip.exchange.format_to_format import convert_format
from evslip.utils.errors import DataError

EVT2 = "% evt 2.0\n% format EVT2;height=260;width=346\n% end\n"
EVT21 = "% evt 2.1\n% format EVT21;height=260;width=346{}\n% end\n"
EVT3 = "% evt 3.0\n% format EVT3;height=260;width=346\n% end\n"
EDGES = [(5_000, 1, 6), (7_003, 0, 6), (7_003, 1, 0)]
"""Time in us, level after the edge, number of the input."""
EXPECTED = TriggerFacts(3, 5_000, 7_003, {"rising": 2, "falling": 1}, {0: 1, 6: 2})


def evt2_words(edges) -> list[int]:
    """A word of time before each trigger, and an event."""
    words = []
    for t_us, level, channel in edges:
        words += [8 << 28 | t_us >> 6, 10 << 28 | (t_us & 63) << 22 | channel << 8 | level]
    return [*words, 1 << 28 | (edges[-1][0] & 63) << 22 | 10 << 11 | 20]


def evt3_words(edges) -> list[int]:
    words = []
    for t_us, level, channel in edges:
        words += [8 << 12 | t_us >> 12 & 0xFFF, 6 << 12 | t_us & 0xFFF, 10 << 12 | channel << 8 | level]
    return [*words, 20, 2 << 12 | 2048 | 10]


def write(path: Path, header: str, words: list[int], dtype: str) -> Path:
    path.write_bytes(header.encode() + np.array(words, dtype).tobytes())
    return path


@pytest.fixture(params=["evt2", "evt21", "evt21 legacy", "evt3"])
def file(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    path = tmp_path / "a.raw"
    if request.param == "evt2":
        return write(path, EVT2, evt2_words(EDGES), "<u4")
    if request.param == "evt3":
        return write(path, EVT3, evt3_words(EDGES), "<u2")
    legacy = request.param.endswith("legacy")
    halves = [(word, 1) if legacy else (1, word) for word in evt2_words(EDGES)]
    return write(path, EVT21.format(";endianness=legacy" if legacy else ""), np.ravel(halves).tolist(), "<u4")


def test_triggers_among_prophesees_words_are_counted(file: Path):
    assert trigger_facts(file) == EXPECTED
    events = read_events(file)
    assert (events.count, int(events.t_us[0])) == (1, 7_003)


def test_info_tells_triggers(file: Path):
    assert "triggers  3: 2 rising, 1 falling; from 5000 to 7003 us; inputs 0, 6\n" in evslip("info", file).stdout
    told = json.loads(evslip("info", file, "--json").stdout)["triggers"]
    assert told["count"] == 3 and told["kinds"] == {"rising": 2, "falling": 1}


def test_what_is_written_without_triggers_is_said(file: Path, tmp_path: Path):
    assert convert_format(file, tmp_path / "b.h5").lost == ("3 triggers",)
    assert trigger_facts(tmp_path / "b.h5") is None
    assert "note: c.h5 does not hold 3 triggers" in evslip("import", file, tmp_path / "c.h5").stdout


def test_without_triggers_nothing_is_lost(tmp_path: Path):
    path = write(tmp_path / "a.raw", EVT3, [8 << 12, 6 << 12, 20, 2 << 12 | 10], "<u2")
    assert str(trigger_facts(path)) == "none"
    assert convert_format(path, tmp_path / "b.h5").lost == ()


def by_brute_force(words: list[int]) -> list[tuple[int, int, int]]:
    """Triggers of EVT 3.0 one word at a time."""
    found, high, low = [], -1, 0
    for word in words:
        kind, value = word >> 12, word & 0xFFF
        if kind == 8 and value != high % 4096:
            low = 0 if high >= 0 else low
            high = value if high < 0 else high - (high % 4096 - value) + (4096 if high % 4096 - value > 2048 else 0)
        elif kind == 8 and high < 0:
            high = value
        elif kind == 6:
            low = value
        elif kind == 10 and high >= 0:
            found.append((high << 12 | low, RISING if value & 1 else FALLING, value >> 8))
    return found


@pytest.mark.parametrize("seed", range(20))
def test_triggers_of_evt3_by_blocks_are_those_by_words(seed: int):
    rng = np.random.default_rng(seed)
    kinds = rng.choice([8, 6, 10, 0, 2], 400)
    values = np.where(kinds == 8, np.cumsum(rng.integers(0, 400, 400)) & 0xFFF, rng.integers(0, 4096, 400))
    words = kinds << 12 | values
    decoder, found = Evt3Decoder(), []
    for block in np.split(words.astype(np.uint16), np.sort(rng.integers(0, 400, 5))):
        part = decoder.decode(block)
        found += list(zip(*(column.tolist() for column in part), strict=True))
    assert found == by_brute_force(words.tolist())


def test_triggers_that_dv_processing_writes(tmp_path: Path):
    dv = pytest.importorskip("dv_processing")
    path, kinds = tmp_path / "a.aedat4", dv.TriggerType
    config = dv.io.MonoCameraWriter.Config("camera")
    config.addEventStream((346, 260))
    config.addTriggerStream()
    writer = dv.io.MonoCameraWriter(str(path), config)
    store = dv.EventStore()
    store.push_back((1_000, 3, 4, True))
    writer.writeEvents(store)
    given = [kinds.EXTERNAL_SIGNAL_RISING_EDGE, kinds.EXTERNAL_SIGNAL_FALLING_EDGE] * 500 + [kinds.APS_EXPOSURE_START]
    for i, kind in enumerate(given):
        writer.writeTrigger(dv.Trigger(2_000 + i, kind))
    del writer
    expected = {"rising": 500, "falling": 500, "begin of an exposure": 1}
    assert trigger_facts(path) == TriggerFacts(1_001, 2_000, 3_000, expected, {0: 1_001})
    assert convert_format(path, tmp_path / "b.aedat4").lost == ("1,001 triggers",)
    data = bytearray(path.read_bytes())
    path.write_bytes(data[: len(data) // 2])
    with pytest.raises(DataError):
        trigger_facts(path)


def test_a_kind_that_nobody_knows_is_told(monkeypatch: pytest.MonkeyPatch):
    from evslip.codecs.inivation import aedat4

    odd = Triggers(np.array([1]), np.array([77]), np.array([0]))
    monkeypatch.setattr(aedat4, "triggers", lambda path: iter([odd]))
    assert str(trigger_facts("a.aedat4")) == "1: 1 of kind 77; from 1 to 1 us"
