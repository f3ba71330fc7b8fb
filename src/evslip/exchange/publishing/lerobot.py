"""A data set in LeRobot's format v3.0 (https://huggingface.co/docs/lerobot/lerobot-dataset-v3): Parquet, MP4, meta/."""

import json
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from evslip.data.recordings import open_samples
from evslip.exchange.publishing.lerobot_episode import Episode, episode_of
from evslip.exchange.publishing.lerobot_meta import CAMERA, CHUNK, DATA, EVENTS, VIDEO, Shape, card_of, info_of
from evslip.exchange.publishing.lerobot_stats import Stats
from evslip.exchange.publishing.publication import Publication
from evslip.utils import atomic
from evslip.utils.errors import DataError, MissingExtraError
from evslip.utils.progress import over

TASK = "Hold the object without a slip."


def publish_lerobot(source: str | Path, out: Path, how: Publication) -> int:
    """Write the samples of a data set as episodes, a file of rows and one of video each, to a new folder, whole or not
    at all. Returns their number. Raises DataError, StorageError, MissingExtraError."""
    try:
        import pyarrow as pa
        import pyarrow.parquet as parquet
    except ModuleNotFoundError:
        raise MissingExtraError("LeRobot's format needs pyarrow: pip install 'evslip[lerobot]'") from None
    samples = open_samples(source).seen_by(how.camera)
    if not samples.listing:
        raise DataError(f"{source}: holds no finished sample")
    rows, first, stats, shape, robots = [], 0, Stats(), None, set()
    with atomic.staged_folder(out) as folder:
        for number, record in enumerate(over("publish", samples)):
            episode = episode_of(record, how.fps)
            shape = _same_shape(shape, Shape(record.size, episode.action_names), source)
            assert record.params is not None  # episode_of has asked for a simulated record
            robots.add(Path(record.params.robot.kind).stem)  # it may be a file
            columns = _columns(episode, how.fps, number, first)
            places = {"chunk_index": number // CHUNK, "file_index": number % CHUNK}
            path = folder / DATA.format(**places)
            path.parent.mkdir(parents=True, exist_ok=True)
            parquet.write_table(_table(columns), path)
            _write_video(folder / VIDEO.format(video_key=CAMERA, **places), episode.images, how.fps)
            own = Stats()
            for one in (own, stats):
                one.add(columns, episode.images)
            rows.append(_episode_row(number, first, len(episode.t_us), how.fps) | own.row())
            first += len(episode.t_us)
        meta = folder / "meta"
        (meta / "episodes" / "chunk-000").mkdir(parents=True)
        parquet.write_table(pa.Table.from_pylist(rows), meta / "episodes" / "chunk-000" / "file-000.parquet")
        _write_tasks(meta / "tasks.parquet")
        assert shape is not None  # there is a sample
        info = info_of(shape, ", ".join(sorted(robots)), len(rows), first, how.fps)
        for name, value in {"info.json": info, "stats.json": stats.table()}.items():
            (meta / name).write_text(json.dumps(value, indent=4) + "\n", encoding="utf-8")
        (folder / "README.md").write_text(card_of(shape, how.name_of(source), how, len(rows), first), encoding="utf-8")
    return len(rows)


def _same_shape(before: Shape | None, shape: Shape, source: object) -> Shape:
    if before is not None and before.size != shape.size:
        raise DataError(
            f"{source}: sensors of {before.size} and of {shape.size} pixels; expected one size in all samples"
        )
    if before is not None and before.action != shape.action:
        raise DataError(
            f"{source}: the grip force was commanded in some samples and not in others; expected those of `evslip "
            "control --records` alone, or of `evslip generate`"
        )
    return shape


def _columns(episode: Episode, fps: int, number: int, first: int) -> dict[str, np.ndarray]:
    count = len(episode.t_us)
    frames = np.arange(count, dtype=np.int64)
    return {
        "observation.state": episode.state,
        "action": episode.action,
        "observation.grip_force": episode.grip_force,
        "observation.slip": episode.slip,
        EVENTS: episode.events,
        "timestamp": (frames / fps).astype(np.float32),
        "frame_index": frames,
        "episode_index": np.full(count, number, np.int64),
        "index": first + frames,
        "task_index": np.zeros(count, np.int64),
    }


def _table(columns: dict[str, np.ndarray]) -> Any:
    import pyarrow as pa

    def column(values: np.ndarray) -> Any:
        found = pa.array(np.ascontiguousarray(values).reshape(-1))
        lengths = values.shape[1:]
        if len(lengths) == 1:
            return pa.FixedSizeListArray.from_arrays(found, lengths[0])
        for length in reversed(lengths):  # lists in lists, as of Hugging Face's Array3D
            offsets = pa.array(np.arange(0, len(found) + 1, length, dtype=np.int32))
            found = pa.ListArray.from_arrays(offsets, found)
        return found

    return pa.table({name: column(values) for name, values in columns.items()})


def _write_video(path: Path, images: list[np.ndarray], fps: int) -> None:
    import av

    path.parent.mkdir(parents=True, exist_ok=True)
    height, width = images[0].shape[:2]
    with av.open(str(path), "w") as container:
        stream: Any = container.add_stream("libx264", rate=Fraction(fps))
        # Sides of this pixel format are even; a row or a column more repeats the last.
        stream.width, stream.height, stream.pix_fmt = width + width % 2, height + height % 2, "yuv420p"
        # No frame is made of later ones: readers that stream a video want it so.
        stream.options = {"crf": "18", "g": "2", "bf": "0"}
        for image in images:
            colour = image if image.ndim == 3 else np.repeat(image[..., None], 3, 2)
            padded = np.pad(colour, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")
            container.mux(stream.encode(av.VideoFrame.from_ndarray(np.ascontiguousarray(padded), format="rgb24")))
        container.mux(stream.encode())


def _episode_row(number: int, first: int, count: int, fps: int) -> dict[str, Any]:
    chunk, file = number // CHUNK, number % CHUNK
    return {
        "episode_index": number,
        "tasks": [TASK],
        "length": count,
        "data/chunk_index": chunk,
        "data/file_index": file,
        "dataset_from_index": first,
        "dataset_to_index": first + count,
        f"videos/{CAMERA}/chunk_index": chunk,
        f"videos/{CAMERA}/file_index": file,
        f"videos/{CAMERA}/from_timestamp": 0.0,
        f"videos/{CAMERA}/to_timestamp": count / fps,
        "meta/episodes/chunk_index": 0,
        "meta/episodes/file_index": 0,
    }


def _write_tasks(path: Path) -> None:
    """The one task, as pandas writes a table whose index are the tasks."""
    import pyarrow as pa
    import pyarrow.parquet as parquet

    index = "__index_level_0__"
    described = [
        {"name": "task_index", "field_name": "task_index", "pandas_type": "int64", "numpy_type": "int64"},
        {"name": None, "field_name": index, "pandas_type": "unicode", "numpy_type": "object"},
    ]
    about = {"index_columns": [index], "column_indexes": [], "columns": [one | {"metadata": None} for one in described]}
    table = pa.table({"task_index": pa.array([0], pa.int64()), index: pa.array([TASK])})
    parquet.write_table(table.replace_schema_metadata({"pandas": json.dumps(about)}), path)
