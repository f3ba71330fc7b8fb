"""Whether other people's libraries open what `evslip publish` wrote, and read the same events.

python benchmarks/interop.py PUBLISHED [SHARDED]
python benchmarks/interop.py --lerobot EPISODES

Needs no evslip: run it in an environment of its own with
    pip install h5py tonic evlib mlcroissant webdataset datasets pillow
or, for EPISODES, with
    pip install h5py pyarrow huggingface_hub rerun-sdk lerobot
PUBLISHED: folder of `evslip publish DIR PUBLISHED --huggingface`. SHARDED: of `--webdataset`. EPISODES: of `--lerobot`.
Prints what agreed; exit code 1 if anything did not. A library that is not installed is named and left out.
"""

import argparse
import importlib.util
import io
import json
import os
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

h5py: Any = importlib.import_module("h5py")  # its stubs know no dataset from a group
Columns = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("published", type=Path, nargs="?")
    parser.add_argument("sharded", type=Path, nargs="?")
    parser.add_argument("--lerobot", type=Path)
    arguments = parser.parse_args()
    os.environ["HF_HUB_OFFLINE"] = "1"
    if arguments.lerobot is not None:
        sys.exit(check_episodes(arguments.lerobot))
    if arguments.published is None:
        parser.error("expected PUBLISHED, or --lerobot EPISODES")
    files = sorted(arguments.published.glob("data/*/*.h5"))
    rows = [json.loads(line) for table in sorted(arguments.published.glob("*.jsonl")) for line in table.open()]
    failures = 0 if len(files) == len(rows) else 1
    print(f"{len(files)} records, {len(rows)} rows, {sum(row['events'] for row in rows):,} events")
    readers = {"tonic": by_tonic, "evlib": by_evlib}
    for name, read in readers.items():
        if importlib.util.find_spec(name) is None:
            print(f"{name}: not installed")
            continue
        wrong = [file.name for file in files if not equal(read(file), by_h5py(file))]
        print(f"{name}: {len(files) - len(wrong)} of {len(files)} records as h5py reads them")
        failures += len(wrong)
    for name, check in {"mlcroissant": check_croissant, "datasets": check_datasets}.items():
        if importlib.util.find_spec(name) is None:
            print(f"{name}: not installed")
        else:
            found = check(arguments.published)
            print(f"{name}: {found} of {len(rows)} rows")
            failures += found != len(rows)
    if arguments.sharded is not None and importlib.util.find_spec("webdataset") is not None:
        found = check_shards(arguments.sharded)
        print(f"webdataset: {found} of {len(rows)} records")
        failures += found != len(rows)
    sys.exit(1 if failures else 0)


def by_h5py(path: Path) -> Columns:
    """t, x, y, p."""
    with h5py.File(path) as file:
        x, y, t, p = (file[f"events/{name}"][()] for name in "xytp")
        return t.astype(np.int64) + file["t_offset"][()], x, y, p > 0


def by_tonic(path: Path) -> Columns:
    """With the code of tonic.datasets.DSEC that reads a recording's file, without its download."""
    from tonic.datasets import DSEC  # pyright: ignore[reportMissingImports]

    with tempfile.TemporaryDirectory() as folder:
        home = Path(folder) / "recording" / "events_left"
        home.mkdir(parents=True)
        (home / "events.h5").symlink_to(path.resolve())
        reader = DSEC.__new__(DSEC)
        reader.location_on_system, reader.recording_selection = folder, ["recording"]
        reader.data_selection, reader.target_selection = ["events_left"], []
        reader.transform = reader.target_transform = reader.transforms = None
        (data,), _ = reader[0]
    events = data["events_left"]
    with h5py.File(path) as file:
        np.testing.assert_array_equal(data["ms_to_idx"], file["ms_to_idx"][()])
    return events["t"].astype(np.int64), events["x"], events["y"], events["p"] > 0


def by_evlib(path: Path) -> Columns:
    import evlib  # pyright: ignore[reportMissingImports]

    table = evlib.load_events(str(path), sort=False).collect()
    t_us = table["t"].dt.total_microseconds().to_numpy()
    with h5py.File(path) as file:  # evlib does not add it
        t_us = t_us + (file["t_offset"][()] if len(t_us) and t_us[0] != by_h5py(path)[0][0] else 0)
    return t_us, table["x"].to_numpy(), table["y"].to_numpy(), table["polarity"].to_numpy() > 0


def check_croissant(folder: Path) -> int:
    import mlcroissant  # pyright: ignore[reportMissingImports]

    dataset = mlcroissant.Dataset(jsonld=str(folder / "croissant.json"))
    return sum(len(list(dataset.records(record_set.id))) for record_set in dataset.metadata.record_sets)


def check_datasets(folder: Path) -> int:
    import datasets  # pyright: ignore[reportMissingImports]

    with tempfile.TemporaryDirectory() as cache:
        return sum(len(split) for split in datasets.load_dataset(str(folder), cache_dir=cache).values())


def check_shards(folder: Path) -> int:
    import webdataset  # pyright: ignore[reportMissingImports]

    found = 0
    for shard in sorted(folder.glob("data/*.tar")):
        for sample in webdataset.WebDataset(str(shard), shardshuffle=False):
            with h5py.File(io.BytesIO(sample["h5"])) as file:
                found += len(file["events/t"]) == json.loads(sample["json"])["events"]
    return found


def check_episodes(folder: Path) -> int:
    """Read a data set in LeRobot's format with the libraries that know it; 1 if anything differs."""
    import pyarrow.parquet as parquet

    tables = [parquet.read_table(path) for path in sorted(folder.glob("data/*/*.parquet"))]
    rows = [row for table in tables for row in table.to_pylist()]
    print(f"{len(tables)} episodes, {len(rows)} rows of {len(tables[0].column_names)} columns")
    failures = 0
    for name, check in {
        "huggingface_hub": check_card,
        "rerun": lambda folder: by_rerun(folder, tables),
        "lerobot": lambda folder: by_lerobot(folder, rows),
    }.items():
        if importlib.util.find_spec(name) is None:
            print(f"{name}: not installed")
            continue
        agrees, said = check(folder)
        print(f"{name}: {said}")
        failures += not agrees
    return int(failures > 0)


def check_card(folder: Path) -> tuple[bool, str]:
    """Whether the Hub's library takes the card, and finds the files that it names."""
    from huggingface_hub import DatasetCard  # pyright: ignore[reportMissingImports]

    about = DatasetCard.load(folder / "README.md").data
    files = list(folder.glob(about.configs[0]["data_files"]))
    return bool(files) and "LeRobot" in about.tags, f"license {about.license}, {len(files)} files"


def by_rerun(folder: Path, tables: list[Any]) -> tuple[bool, str]:
    """Rerun's reader, whose features are numbers and video."""
    from rerun.experimental import LeRobotReader  # pyright: ignore[reportMissingImports]

    reader, compared, packets, agree = LeRobotReader(folder), set(), 0, True
    for episode in reader.episodes():
        found: dict[str, list[Any]] = {}
        for chunk in reader.stream(episode):
            batch = chunk.to_record_batch()
            for name in ("Scalars:scalars", "VideoStream:sample"):
                if name in batch.schema.names:
                    found.setdefault(chunk.entity_path[1:], []).extend(batch.column(name).to_pylist())
        for name, values in found.items():
            if name in tables[episode].column_names:
                own = np.array(tables[episode][name].to_pylist()).reshape(len(values), -1)
                agree &= np.array_equal(np.array(values).reshape(own.shape), own)
                compared.add(name)
            else:
                packets += len(values)
    agree &= packets == sum(table.num_rows for table in tables)
    return agree, f"{', '.join(sorted(compared))} {'equal' if agree else 'differ'}; {packets} frames of video"


def by_lerobot(folder: Path, rows: list[dict[str, Any]]) -> tuple[bool, str]:
    """LeRobot's own reader: every column of every row, the statistics, and a frame with its picture if it can."""
    import pyarrow.parquet as parquet
    from lerobot.datasets.compute_stats import aggregate_stats  # pyright: ignore[reportMissingImports]
    from lerobot.datasets.lerobot_dataset import LeRobotDataset  # pyright: ignore[reportMissingImports]

    data = LeRobotDataset(folder.name, root=folder)
    agree = len(data) == len(rows) and all(
        np.allclose(np.asarray(data.hf_dataset[k][name]), np.asarray(value))
        for k, row in enumerate(rows)
        for name, value in row.items()
    )
    episodes: list[dict[str, dict[str, Any]]] = []
    for row in parquet.read_table(next(folder.glob("meta/episodes/*/*.parquet"))).to_pylist():
        stats = [(*key.split("/")[1:], np.array(value)) for key, value in row.items() if key.startswith("stats/")]
        episodes.append({name: {k: v for n, k, v in stats if n == name} for name, *_ in stats})
    whole = aggregate_stats(episodes)
    for name, stats in data.meta.stats.items():
        agree &= all(np.allclose(whole[name][key], value, rtol=1e-4, atol=1e-4) for key, value in stats.items())
    try:
        picture = f"a picture of shape {tuple(data[0]['observation.images.camera'].shape)}"
    except Exception as error:  # its decoders need libraries of their own
        picture = f"no picture: {type(error).__name__}: {' '.join(str(error).split())[:80]}"
    return agree, f"{len(rows)} rows and the statistics {'equal' if agree else 'differ'}; {picture}"


def equal(one: Columns, other: Columns) -> bool:
    """Whether all events are the same."""
    return all(len(a) == len(b) and bool((a == b).all()) for a, b in zip(one, other, strict=True))


if __name__ == "__main__":
    main()
