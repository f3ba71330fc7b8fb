"""Descriptions of a data set in LeRobot's format: meta/info.json, and the card for the Hugging Face Hub."""

import json
from typing import Any, NamedTuple

from evslip.exchange.publishing.lerobot_episode import BLOCK, COMMAND, SLIP, STATE
from evslip.exchange.publishing.publication import Publication
from evslip.utils.version import __version__

CAMERA, EVENTS = "observation.images.camera", "observation.events"
CHUNK = 1000
"""Files of a folder."""
DATA = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
VIDEO = "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4"


class Shape(NamedTuple):
    """Properties that all episodes of a data set share."""

    size: tuple[int, int]
    """The sensor's (width, height)."""
    action: tuple[str, ...]
    """Names of the action's numbers."""


def info_of(shape: Shape, robot: str, episodes: int, frames: int, fps: int) -> dict[str, Any]:
    """Content of meta/info.json."""
    width, height = shape.size
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
            "action": feature("float32", [len(shape.action)], list(shape.action)),
            "observation.grip_force": feature("float32", [1], ["newtons"]),
            "observation.slip": feature("float32", [len(SLIP)], SLIP),
            EVENTS: feature("uint8", [2, -(-height // BLOCK), -(-width // BLOCK)], ["polarity", "row", "column"]),
            CAMERA: feature("video", [even[1], even[0], 3], ["height", "width", "channels"]) | {"info": video},
            "timestamp": feature("float32", [1]),
            **{name: feature("int64", [1]) for name in ("frame_index", "episode_index", "index", "task_index")},
        },
    }


def card_of(shape: Shape, name: str, how: Publication, episodes: int, frames: int) -> str:
    """Content of README.md: a card for the Hugging Face Hub, where names of licences have small letters."""
    action = "the grip force that is commanded, newtons" if shape.action == COMMAND else "the state of the next frame"
    return f"""---
license: {json.dumps(how.license.lower())}
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
| action | {action} |
| observation.grip_force | mean normal force of both pads, newtons |
| observation.slip | whether the object slips; its rotation (degrees) and slide (mm) in the grip: the truth |
| observation.events | OFF and ON events of each block of {BLOCK} x {BLOCK} pixels since the frame before, at most 255 |
| observation.images.camera | frames of the hand camera |

```python
from lerobot.datasets.lerobot_dataset import LeRobotDataset

dataset = LeRobotDataset("{name}", root="FOLDER")
```
"""
