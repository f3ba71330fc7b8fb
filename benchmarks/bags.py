"""Whether other people's libraries read a sample's bag as it is in the record.

python benchmarks/bags.py RECORD [--frames-hz 2] [--modules FOLDER]

Writes the record as .bag, .db3 and .mcap into a temporary folder, and compares what each library reads with the record:
events (time, pixel, polarity), poses, the tree of coordinate frames, the camera, frames, forces and truth. Libraries:
rosbags; mcap with mcap-ros2-support; Rerun's reader of .mcap files (pip install rerun-sdk); and the packages that
Foxglove reads files with, which node finds in FOLDER:

    npm install @mcap/core @foxglove/rosmsg @foxglove/rosmsg2-serialization @foxglove/rosbag

Prints a table; exit code 1 if anything differs. What is not installed is named and left out.
"""

import argparse
import hashlib
import importlib.util
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from evslip.data import record_file
from evslip.data.record import Record
from evslip.exchange.sample_bag import View, frames_of, write_sample
from evslip.physics.robots.description import TCP_M
from evslip.rendering.camera import hand_camera

Contents = dict[str, list[np.ndarray]]
"""Columns of each topic: of events time and pixel with polarity, of coordinate frames one for each, else one."""
EVENTS, IMAGES, LENS, TF = "/event_camera/events", "/event_camera/image_raw", "/event_camera/camera_info", "/tf"
SINGLE = 1e-6
"""Largest difference where a library keeps single precision."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("record", type=Path)
    parser.add_argument("--frames-hz", type=float, default=2.0)
    parser.add_argument("--modules", type=Path, help="folder of Foxglove's packages")
    arguments = parser.parse_args()
    record = record_file.read(arguments.record)
    known = contents_of(record, [image for _, image in frames_of(record, arguments.frames_hz)])
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        paths = {suffix: Path(folder) / f"a{suffix}" for suffix in (".bag", ".db3", ".mcap")}
        for suffix, path in paths.items():
            count = write_sample(path, [View(record, [record.events])], arguments.frames_hz)
            print(f"{suffix}: {count:,} messages, {path.stat().st_size / 1e6:.1f} MB, {record.events.count:,} events")
            rows.append(("rosbags", suffix, differing(known, by_rosbags(path))))
        rows.append(("mcap", ".mcap", differing(known, by_mcap(paths[".mcap"])) if is_there("mcap_ros2") else None))
        pinhole = known | {LENS: [known[LENS][0][:9]]}  # Rerun keeps no distortion
        rows.append(("rerun", ".mcap", differing(pinhole, by_rerun(paths[".mcap"])) if is_there("rerun") else None))
        for suffix in (".bag", ".mcap"):
            wrong = None if arguments.modules is None else not_as_foxglove(known, paths[suffix], arguments.modules)
            rows.append(("Foxglove's packages", suffix, wrong))
    print("\n| library | file | topics as in the record |\n|---|---|---|")
    for library, suffix, wrong in rows:
        said = "not installed" if wrong is None else ", ".join([f"{len(known) - len(wrong)} of {len(known)}", *wrong])
        print(f"| {library} | {suffix} | {said} |")
    sys.exit(1 if any(wrong for *_, wrong in rows) else 0)


def is_there(name: str) -> bool:
    return importlib.util.find_spec(name) is not None


def contents_of(record: Record, images: list[np.ndarray]) -> Contents:
    """The topics of a simulated record, from its own arrays."""
    motion, truth, params, events = record.trajectory, record.truth, record.params, record.events
    if motion is None or truth is None or params is None or motion.camera_displacement is not None:
        sys.exit(f"{record.name}: expected a simulated record whose camera does not tremble")
    camera = hand_camera(params)
    x, y = (record.size[0] - 1) / 2, (record.size[1] - 1) / 2
    lens = [camera.focal_px, 0, x, 0, camera.focal_px, y, 0, 0, 1, *camera.distortion, 0]
    turn = Rotation.from_matrix(camera.rotation @ np.diag([1.0, -1.0, -1.0])).as_quat(scalar_first=True)
    gripper, thing = (pose.astype(np.float64) for pose in (motion.gripper_pose, motion.object_pose))
    slipping = np.zeros(len(truth.t_us), np.uint8)
    for one in truth.episodes:
        slipping[(truth.t_us >= one.start_us) & (truth.t_us < one.end_us)] = 1
    closed = (truth.t_us >= truth.span_us[0]) & (truth.t_us <= truth.span_us[1])
    pixels = events.x.astype("<u4") | events.y.astype("<u4") << 16 | events.p.astype("<u4") << 31
    return {
        "/gripper/pose": [gripper],
        "/object/pose": [thing],
        TF: [gripper, thing, np.tile([*camera.position, *turn], (len(gripper), 1))],
        "/gripper/tool": [np.array([[*TCP_M, 1.0, 0, 0, 0]])],
        LENS: [np.array(lens, np.float64)],
        "/object/held": [truth.held.astype(np.uint8)],
        "/slip/slipping": [slipping],
        "/slip/rotation_deg": [truth.spin_deg[closed].astype("<f4")],
        "/slip/slide_mm": [(np.linalg.norm(truth.slide_m, axis=1) * 1e3)[closed].astype("<f4")],
        "/gripper/grip_force_n": [motion.pad_force_n.mean(1).astype("<f4")],
        "/slip/label": [letters(record.label)],
        "/sample/parameters": [letters(params.model_dump_json())],
        EVENTS: [events.t_us.astype("<f8"), pixels],
        IMAGES: [np.stack(images)] if images else [],
    }


def letters(text: str) -> np.ndarray:
    return np.frombuffer(text.encode(), np.uint8)


def differing(known: Contents, found: Contents) -> list[str]:
    """Topics whose content is not that of the record."""
    return [topic for topic, columns in known.items() if columns and not same(columns, found.get(topic, []))]


def same(one: list[np.ndarray], other: list[np.ndarray]) -> bool:
    """Whether two topics' columns are equal; single precision where either has it."""
    pairs = list(zip(one, other, strict=False))
    slack = [SINGLE * (np.float32 in (a.dtype.type, b.dtype.type)) for a, b in pairs]
    return len(one) == len(other) and all(
        a.size == b.size and np.allclose(a.ravel(), b.ravel(), rtol=atol, atol=atol)
        for (a, b), atol in zip(pairs, slack, strict=True)
    )


def by_rosbags(path: Path) -> Contents:
    from rosbags.highlevel import AnyReader

    with AnyReader([path]) as reader:
        return gathered((c.topic, reader.deserialize(data, c.msgtype)) for c, _, data in reader.messages())


def by_mcap(path: Path) -> Contents:
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        return gathered((channel.topic, content) for _, channel, _, content in reader.iter_decoded_messages())


def gathered(messages: Iterable[tuple[str, Any]]) -> Contents:
    """Columns of messages, as Python's libraries make objects of them."""
    parts: dict[str, list[list[np.ndarray]]] = {}
    for topic, message in messages:
        parts.setdefault(topic, []).append(columns_of(message))
    return {t: [np.concatenate([row[k] for row in rows]) for k in range(len(rows[0]))] for t, rows in parts.items()}


def columns_of(message: Any) -> list[np.ndarray]:
    """Content of one message."""
    if hasattr(message, "time_base"):
        words = np.frombuffer(bytes(message.events), "<u4").reshape(-1, 2)
        return [(message.time_base + words[:, 0].astype(np.int64)) / 1000, words[:, 1]]
    if hasattr(message, "pose"):
        return [placed(message.pose.position, message.pose.orientation)]
    if hasattr(message, "transforms"):
        return [placed(one.transform.translation, one.transform.rotation) for one in message.transforms]
    if hasattr(message, "distortion_model"):
        upper = hasattr(message, "K")
        return [np.array([*(message.K if upper else message.k), *(message.D if upper else message.d)], np.float64)]
    if isinstance(message.data, str):
        return [letters(message.data)]
    if isinstance(message.data, bool):
        return [np.array([message.data], np.uint8)]
    if isinstance(message.data, float):
        return [np.array([message.data], "<f4")]
    return [np.frombuffer(bytes(message.data), np.uint8)]


def placed(place: Any, turn: Any) -> np.ndarray:
    return np.array([place.x, place.y, place.z, turn.w, turn.x, turn.y, turn.z], np.float64)


def not_as_foxglove(known: Contents, path: Path, modules: Path) -> list[str]:
    """Topics that Foxglove's packages do not read as they are in the record."""
    script = Path(__file__).with_suffix(".mjs")
    done = subprocess.run(["node", script, modules, path], capture_output=True, text=True, check=True)
    found = json.loads(done.stdout)
    digests = {t: [hashlib.sha256(np.ascontiguousarray(c).data).hexdigest() for c in known[t]] for t in known}
    return [topic for topic, one in digests.items() if one and found.get(topic) != one]


def by_rerun(path: Path) -> Contents:
    """What Rerun makes of an .mcap file, by its own reader."""
    import pyarrow as pa
    from rerun.chunk import McapReader  # pyright: ignore[reportMissingImports]

    rows: dict[str, list[Any]] = {}
    for chunk in McapReader(path).stream():
        if not chunk.is_static:
            batch = chunk.to_record_batch()
            rows.setdefault(str(chunk.entity_path), []).append(pa.Table.from_batches([batch.replace_schema_metadata()]))
    return {topic: rerun_columns(pa.concat_tables(tables)) for topic, tables in rows.items()}


def rerun_columns(table: Any) -> list[np.ndarray]:
    names = {name.rpartition(":")[2]: name for name in table.column_names}

    def column(name: str) -> list[Any]:
        return [row[0] for row in table[names[name]].to_pylist()]

    if "translations" in names or "translation" in names:
        plural = "s" if "translations" in names else ""
        places, turns = np.array(column(f"translation{plural}")), np.roll(np.array(column(f"quaternion{plural}")), 1, 1)
        poses = np.hstack([places, turns]).astype(np.float32)
        if plural:
            return [poses]
        children = np.array(column("child_frame"))
        return [poses[children == child] for child in ("gripper", "object", "camera")]
    if "image_from_camera" in names:  # column by column
        return [np.array(column("image_from_camera"), np.float32).reshape(-1, 3, 3).transpose(0, 2, 1)]
    if "text" in names:
        return [letters(text) for text in column("text")]
    if "buffer" in names:
        return [np.array(column("buffer"), np.uint8)]
    messages = column("message")
    if "data" in messages[0]:
        return [np.array([message["data"] for message in messages])]
    return gathered(("", argparse.Namespace(**message)) for message in messages)[""]


if __name__ == "__main__":
    main()
