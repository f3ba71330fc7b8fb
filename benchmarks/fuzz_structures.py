"""Hostile structures for `fuzz.py`: whole files whose parts are exchanged for what nobody would write.

Attributes and numbers beyond all bounds, NaN, other types and shapes, missing parts, links out of the file, claims of
endless data, JSON of any depth. What is read is used as a verb would use it.
"""

import contextlib
import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from evslip.codecs.facts import examine
from evslip.data import record_file
from evslip.data.footage import Footage
from evslip.data.intervals import Interval
from evslip.data.record import Record
from evslip.exchange.format_to_format import convert_format
from evslip.learn.checkpoint import Description, load_model, read_description, save_model
from evslip.learn.networks import build_model
from evslip.utils.errors import EvslipError
from evslip.windows.cutting import windows_of
from evslip.windows.window_set import WindowSettings, open_windows

INTEGERS = (-(2**63), -(2**62), -1, 0, 1, 2, 255, 2**31 - 1, 2**32, 2**40, 2**62, 2**63 - 1)
REALS = (float("nan"), float("inf"), float("-inf"), 1e300, -1e30, -1.0, 0.0, 1e-300, 0.5)
TEXTS = ("", "x" * 1000, "../../etc/passwd", "{", "[" * 50_000, "9" * 5000, '{"a": NaN}', "evslip", "recording")
Use = Callable[[Path], object]


def structures(folder: Path, recording: Record, sample: Record) -> list[tuple[Path, Use]]:
    """Whole files, and what is done with each."""
    folder.mkdir()
    record_file.write(folder / "sample.h5", sample)
    frames = Footage(np.arange(3) * 1000, np.zeros((3, recording.size[1], recording.size[0]), np.uint8))
    said = (Interval(0, 20_000, "slip"), Interval(20_000, 49_000, "hold"))
    record_file.write(folder / "recording.h5", replace(recording, intervals=said, footage=frames))
    settings = WindowSettings(0.005, 0.005, balance=False)
    windows_of([record_file.read(folder / "recording.h5")], settings).save(folder / "windows.h5")
    save_model(folder, build_model("event_rate"), Description("event_rate", 0.5, WindowSettings(), {"seed": 1}))
    records = {"sample.h5": _as_record, "recording.h5": _as_record}
    uses = {**records, "windows.h5": _as_windows, "model.json": _as_model}
    return [(folder / name, use) for name, use in uses.items()]


def write_hostile(whole: Path, damaged: Path, rng: np.random.Generator) -> None:
    """A copy of a file after one to three edits."""
    number = int(rng.integers(1, 4))
    if whole.suffix == ".json":
        content = json.loads(whole.read_text())
        for _ in range(number):
            _edit_tree(content, rng)
        text = json.dumps(content)
        damaged.write_text("[" * 50_000 if rng.random() < 0.02 else text)
        return
    shutil.copy(whole, damaged)
    with h5py.File(damaged, "r+") as file:
        for _ in range(number):
            with contextlib.suppress(
                LookupError, OSError, TypeError, ValueError, OverflowError, RuntimeError, MemoryError
            ):
                _edit_file(file, rng)  # an edit that HDF5 refuses is none


def _as_record(path: Path) -> None:
    record = record_file.read(path)
    with contextlib.suppress(EvslipError):
        windows_of([record], WindowSettings(0.005, 0.005, balance=False))
    examine(path)
    convert_format(path, path.with_name("converted.csv"))


def _as_windows(path: Path) -> None:
    windows = open_windows(path)
    windows.summary()
    with contextlib.suppress(EvslipError):
        for number in range(len(windows)):
            windows[number]
    with contextlib.suppress(EvslipError):
        windows.split_by_trajectory(0.5)


def _as_model(path: Path) -> None:
    folder = path.with_name("model")
    folder.mkdir(exist_ok=True)
    shutil.copy(path, folder / "model.json")
    shutil.copy(path.with_name("model.safetensors"), folder)
    read_description(folder)
    load_model(folder)


def _value(rng: np.random.Generator) -> Any:
    pool = (INTEGERS, REALS, TEXTS)[int(rng.integers(3))]
    value: Any = pool[int(rng.integers(len(pool)))]
    return [value] * 3 if rng.random() < 0.1 else value


def _edit_tree(tree: dict[str, Any], rng: np.random.Generator) -> None:
    while True:
        key = list(tree)[int(rng.integers(len(tree)))]
        if not isinstance(tree[key], dict) or not tree[key] or rng.random() < 0.2:
            break
        tree = tree[key]
    kind = rng.integers(0, 5)
    if kind == 0 and len(tree) > 1:
        del tree[key]
    else:
        tree[key] = {"a": _value(rng)} if kind == 1 else int("9" * 400) if kind == 2 else _value(rng)


def _edit_file(file: Any, rng: np.random.Generator) -> None:
    names: list[str] = ["/"]
    file.visit(names.append)
    name = names[int(rng.integers(len(names)))]
    kind = int(rng.integers(0, 10))
    if kind <= 2 or name == "/":
        node = file["/"] if rng.random() < 0.7 else file[name]
        keys = list(node.attrs) or ["width"]
        key = keys[int(rng.integers(len(keys)))]
        if rng.random() < 0.2:
            del node.attrs[key]
        else:
            node.attrs[key] = _value(rng)
    elif kind <= 5 and isinstance(file[name], h5py.Dataset) and file[name].size:
        data = file[name]
        values = np.array(data)
        pool = REALS if values.dtype.kind == "f" else INTEGERS
        where = rng.integers(0, values.size, int(rng.integers(1, 4)))
        chosen = np.array([pool[int(rng.integers(len(pool)))] for _ in where])
        with np.errstate(all="ignore"):
            values.reshape(-1)[where] = chosen.astype(values.dtype)
        data[...] = values
    elif kind == 6:
        del file[name]
    elif kind == 7:
        shapes = ((), (0,), (1,), (7,), (7, 7), (2**40,))
        del file[name]
        dtype = ("i8", "u1", "f4", "f8", "S5", "u2")[int(rng.integers(6))]
        file.create_dataset(name, shapes[int(rng.integers(len(shapes)))], dtype, chunks=None)
    elif kind == 8:
        del file[name]
        links = (h5py.ExternalLink("/etc/passwd", "/"), h5py.ExternalLink("whole.h5", name), h5py.SoftLink(f"/{name}"))
        links = (*links, h5py.SoftLink("/nowhere"), h5py.SoftLink("/events"), h5py.SoftLink("/"))
        file[name] = links[int(rng.integers(len(links)))]
    else:
        del file[name]
        if rng.random() < 0.5:
            file.create_dataset(name, (100,), "u1", external=[("/etc/passwd", 0, 100)])
        else:
            layout = h5py.VirtualLayout((100,), "u1")
            layout[:] = h5py.VirtualSource("/etc/passwd", "x", (100,))
            file.create_virtual_dataset(name, layout)
