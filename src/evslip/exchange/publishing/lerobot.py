"""A data set in LeRobot's format v3.0 (https://huggingface.co/docs/lerobot/lerobot-dataset-v3): Parquet, MP4, meta/."""

import json
import shutil
import uuid
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from evslip.data.recordings import open_samples
from evslip.exchange.publishing.lerobot_episode import BLOCK, SLIP, STATE, Episode, episode_of
from evslip.exchange.publishing.publication import Publication
from evslip.utils import atomic
from evslip.utils.errors import DataError, MissingExtraError
from evslip.utils.version import __version__

TASK = "Hold the object without a slip."
CAMERA, EVENTS = "observation.images.camera", "observation.events"
CHUNK = 1000
"""Files of a folder."""
DATA = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
VIDEO = "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4"


def publish_lerobot(source: str | Path, out: Path, how: Publication, progress: Callable[[], None]) -> int:
    """Write the samples of a data set as episodes, a file of rows and one of video each, to a new folder, whole or not
    at all. Returns their number. Raises DataError, StorageError, MissingExtraError."""
    try:
        import pyarrow.parquet as parquet
    except ModuleNotFoundError:
        raise MissingExtraError("LeRobot's format needs pyarrow: pip install 'evslip[lerobot]'") from None
    samples = open_samples(source).seen_by(how.camera)
    if not samples.listing:
        raise DataError(f"{source}: holds no finished sample")
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise DataError(f"{out}: is there already; expected a new folder")
    temporary = out.with_name(f".{out.name}.{uuid.uuid4().hex[:8]}.tmp")
    rows, first, stats, size, robots = [], 0, _Stats(), (0, 0), set()
    try:
        with atomic.storage_errors(out):
            for number, record in enumerate(samples):
                episode, size = episode_of(record, how.fps), _same_size(size, record.size, source)
                assert record.params is not None  # episode_of has asked for a simulated record
                robots.add(record.params.robot.kind)
                columns = _columns(episode, how.fps, number, first)
                places = {"chunk_index": number // CHUNK, "file_index": number % CHUNK}
                path = temporary / DATA.format(**places)
                path.parent.mkdir(parents=True, exist_ok=True)
                parquet.write_table(_table(columns), path)
                _write_video(temporary / VIDEO.format(video_key=CAMERA, **places), episode.images, how.fps)
                own = _Stats()
                for one in (own, stats):
                    one.add(columns, episode.images)
                rows.append(_episode_row(number, first, len(episode.t_us), how.fps) | own.row())
                first += len(episode.t_us)
                progress()
            meta = temporary / "meta"
            (meta / "episodes" / "chunk-000").mkdir(parents=True)
            _write_rows(meta / "episodes" / "chunk-000" / "file-000.parquet", rows)
            _write_tasks(meta / "tasks.parquet")
            info = _info(", ".join(sorted(robots)), len(rows), first, how.fps, size)
            for name, value in {"info.json": info, "stats.json": stats.table()}.items():
                (meta / name).write_text(json.dumps(value, indent=4) + "\n", encoding="utf-8")
            name = how.name or Path(source).resolve().name
            (temporary / "README.md").write_text(_card(name, how, len(rows), first), encoding="utf-8")
            if out.exists():
                out.rmdir()
            temporary.rename(out)
            atomic.sync_folder(out.parent)
    except BaseException:
        shutil.rmtree(temporary, ignore_errors=True)
        raise
    return len(rows)


def _same_size(before: tuple[int, int], size: tuple[int, int], source: object) -> tuple[int, int]:
    if before not in ((0, 0), size):
        raise DataError(f"{source}: sensors of {before} and of {size} pixels; expected one size in all samples")
    return size


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
        stream.options = {"crf": "18", "g": "2"}
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


def _write_rows(path: Path, rows: list[dict[str, Any]]) -> None:
    import pyarrow as pa
    import pyarrow.parquet as parquet

    parquet.write_table(pa.Table.from_pylist(rows), path)


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


def _info(robot: str, episodes: int, frames: int, fps: int, size: tuple[int, int]) -> dict[str, Any]:
    width, height = size
    even = width + width % 2, height + height % 2

    def feature(dtype: str, shape: list[int], names: list[str] | None = None) -> dict[str, Any]:
        return {"dtype": dtype, "shape": shape, "names": names}

    video = {
        "video.height": even[1],
        "video.width": even[0],
        "video.codec": "h264",
        "video.pix_fmt": "yuv420p",
        "video.is_depth_map": False,
        "video.fps": fps,
        "video.channels": 3,
        "has_audio": False,
    }
    return {
        "codebase_version": "v3.0",
        "robot_type": robot,
        "total_episodes": episodes,
        "total_frames": frames,
        "total_tasks": 1,
        "chunks_size": CHUNK,
        "data_files_size_in_mb": 100,
        "video_files_size_in_mb": 200,
        "fps": fps,
        "splits": {"train": f"0:{episodes}"},
        "data_path": DATA,
        "video_path": VIDEO,
        "features": {
            "observation.state": feature("float32", [len(STATE)], STATE),
            "action": feature("float32", [len(STATE)], STATE),
            "observation.grip_force": feature("float32", [1], ["newtons"]),
            "observation.slip": feature("float32", [len(SLIP)], SLIP),
            EVENTS: feature("uint8", [2, -(-height // BLOCK), -(-width // BLOCK)], ["polarity", "row", "column"]),
            CAMERA: feature("video", [even[1], even[0], 3], ["height", "width", "channels"]) | {"info": video},
            "timestamp": feature("float32", [1]),
            **{name: feature("int64", [1]) for name in ("frame_index", "episode_index", "index", "task_index")},
        },
    }


class _Stats:
    """Least, largest, mean and standard deviation of each feature; of pictures for each colour, in units of white."""

    def __init__(self) -> None:
        self._sums: dict[str, list[Any]] = {}

    def add(self, columns: dict[str, np.ndarray], images: list[np.ndarray]) -> None:
        """The rows of an episode."""
        for name, values in columns.items():
            self._add(name, values.reshape(len(values), -1).astype(np.float64), values.shape[1:] or (1,), len(values))
        grey = [np.stack([i] * 3, -1) if i.ndim == 2 else i for i in images]
        pixels = np.concatenate([image.reshape(-1, 3)[::16] for image in grey]) / 255.0
        self._add(CAMERA, pixels, (3, 1, 1), len(images))

    def _add(self, name: str, rows: np.ndarray, shape: tuple[int, ...], frames: int) -> None:
        new = [rows.min(0), rows.max(0), rows.sum(0), (rows**2).sum(0), len(rows), frames, shape]
        old = self._sums.get(name)
        if old is not None:
            new[:2] = np.minimum(old[0], new[0]), np.maximum(old[1], new[1])
            new[2:6] = [a + b for a, b in zip(old[2:6], new[2:6], strict=True)]
        self._sums[name] = new

    def table(self) -> dict[str, Any]:
        """All of them."""
        told = {}
        for name, (low, high, total, squares, number, frames, shape) in self._sums.items():
            mean = total / number
            deviation = np.sqrt(np.maximum(squares / number - mean**2, 0.0))
            four = {"min": low, "max": high, "mean": mean, "std": deviation}
            told[name] = {key: values.reshape(shape).tolist() for key, values in four.items()} | {"count": [frames]}
        return told

    def row(self) -> dict[str, Any]:
        """All of them as columns of meta/episodes."""
        return {f"stats/{name}/{key}": value for name, stats in self.table().items() for key, value in stats.items()}


def _card(name: str, how: Publication, episodes: int, frames: int) -> str:
    return f"""---
license: {json.dumps(how.license)}
pretty_name: {json.dumps(name)}
task_categories:
- robotics
tags:
- LeRobot
- event-camera
- slip-detection
configs:
- config_name: default
  data_files: data/*/*.parquet
---
# {name}

{episodes} simulated episodes ({frames:,} frames at {how.fps} a second) of a gripper that holds an object, in
LeRobot's format v3.0, written by evslip {__version__}.

| feature | meaning |
|---|---|
| observation.state | joint angles (radians), travel of both fingers (metres) |
| action | the state of the next frame |
| observation.grip_force | mean normal force of both pads, newtons |
| observation.slip | whether the object slips; its rotation (degrees) and slide (mm) in the grip: the truth |
| observation.events | OFF and ON events of each block of {BLOCK} x {BLOCK} pixels since the frame before, at most 255 |
| observation.images.camera | frames of the hand camera |

```python
from lerobot.datasets.lerobot_dataset import LeRobotDataset

dataset = LeRobotDataset("{name}", root="FOLDER")
```
"""
