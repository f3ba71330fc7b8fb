"""The card of a published data set: README.md with the header that data-set hubs read."""

import json
from typing import Any

from evslip.exchange.publishing.table import COLUMNS
from evslip.utils.version import __version__

_SIZES = ((1_000, "n<1K"), (10_000, "1K<n<10K"), (100_000, "10K<n<100K"), (1_000_000, "100K<n<1M"))

_RECORD = (
    "A record is an HDF5 file in the layout of DSEC: `events/x`, `events/y`, `events/t` (µs after `t_offset`), "
    "`events/p` (1 is brighter), `ms_to_idx`; with labels of every event, poses and ground truth where they are known."
)
_MAKING = (
    "A robot arm picks, tilts and places an object in a physics simulation (MuJoCo); a ray caster gives frames "
    "as often as the motion needs, an event-pixel model makes events of them, and slip is measured in the poses. It "
    "shows no real camera and no real object: measure a detector on real recordings before you trust it."
)


def card(
    name: str, license: str, splits: dict[str, list[dict[str, Any]]], config_toml: str, webdataset: bool, hub: bool
) -> str:
    """The text. splits: rows of each split's table. webdataset: the records are in shards. hub: say what `datasets`
    loads."""
    rows = [row for table in splits.values() for row in table]
    synthetic = bool(config_toml)
    size = next((label for most, label in _SIZES if len(rows) < most), "1M<n<10M")
    tags = ["event-camera", "neuromorphic", "slip-detection", "robotics", *(["webdataset"] if webdataset else [])]
    header = ["---", f"license: {json.dumps(license)}", f"pretty_name: {json.dumps(name)}"]
    header += ["tags:", *(f"- {tag}" for tag in tags), "task_categories:", "- other", "size_categories:", f"- {size}"]
    if hub:
        header += ["configs:", "- config_name: samples", "  default: true", "  data_files:"]
        for split in splits:
            header += [f"  - split: {split}", f"    path: {split}.jsonl"]
    header.append("---")
    kind = "Synthetic event-camera data" if synthetic else "Event-camera recordings"
    lines = [
        *header,
        f"# {name}",
        "",
        f"{kind} for slip detection in a gripper, published by evslip {__version__}.",
        "",
        "| split | samples | slip | hold | unlabelled | events | bytes |",
        "|---|---|---|---|---|---|---|",
        *(_counts(split, table) for split, table in splits.items()),
        "",
        "## Files",
        "",
        "- `SPLIT.jsonl`: a line a sample, see below.",
        "- `data/SPLIT-NNNNN.tar`: WebDataset shards of KEY.h5 and KEY.json."
        if webdataset
        else "- `data/SPLIT/KEY.h5`: a record each.",
        "- `croissant.json`: this description for machines.",
        *(["- `config.toml`: the parameters that the samples were drawn from."] if synthetic else []),
        "",
        _RECORD,
        "",
        "```python",
        *_example(next(iter(splits), "train"), webdataset),
        "```",
        "",
        "## Columns",
        "",
        "| column | meaning |",
        "|---|---|",
        *(f"| {column} | {meaning} |" for column, (_, meaning) in COLUMNS.items()),
        "",
    ]
    if synthetic:
        lines += ["## How it was made", "", _MAKING, "", "```toml", config_toml.strip(), "```", ""]
    return "\n".join(lines)


def _counts(split: str, rows: list[dict[str, Any]]) -> str:
    labels = [row["label"] for row in rows]
    counts = [labels.count(label) for label in ("slip", "hold", "unlabelled")]
    sums = [sum(row[name] for row in rows) for name in ("events", "bytes")]
    return f"| {split} | {len(rows):,} | " + " | ".join(f"{n:,}" for n in (*counts, *sums)) + " |"


def _example(split: str, webdataset: bool) -> list[str]:
    if webdataset:
        return [
            "import h5py, io, webdataset",
            f'for sample in webdataset.WebDataset("data/{split}-00000.tar", shardshuffle=False):',
            '    events = h5py.File(io.BytesIO(sample["h5"]))["events"]',
        ]
    return [
        "import h5py, json",
        f'for line in open("{split}.jsonl"):',
        '    events = h5py.File(json.loads(line)["file"])["events"]',
    ]
