"""LeRobot's format v3.0: what is in the files, by its specification, and by other libraries."""

import json
from dataclasses import replace
from pathlib import Path

import av
import numpy as np
import pytest

from evslip.config.loading import dump_config, load_config
from evslip.data import building, record_file, requested
from evslip.data.dataset import open_dataset
from evslip.events.stream import Events
from evslip.exchange.publishing import lerobot
from evslip.exchange.publishing.lerobot_episode import episode_of
from evslip.exchange.publishing.publication import Publication
from evslip.exchange.publishing.publish import publish
from evslip.exchange.sample_bag import frames_of
from evslip.generation.generate import generate
from evslip.utils.errors import ConfigError, DataError
from sample_records import CONFIG

parquet = pytest.importorskip("pyarrow.parquet")
FPS = 10


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("lerobot") / "made"
    generate(load_config("demo", {"camera.width": 40, "camera.height": 31}), root, 2, workers=1)
    return root


@pytest.fixture(scope="module")
def out(made: Path) -> Path:
    assert publish(made, made.parent / "out", Publication(name="Slips", lerobot=True, fps=FPS)) == 2
    return made.parent / "out"


def test_the_description_agrees_with_the_files(out: Path):
    info = json.loads((out / "meta" / "info.json").read_text())
    assert info["codebase_version"] == "v3.0" and info["fps"] == FPS and info["total_episodes"] == 2
    first = 0
    episodes = parquet.read_table(out / "meta" / "episodes" / "chunk-000" / "file-000.parquet").to_pylist()
    for number, episode in enumerate(episodes):
        rows = parquet.read_table(
            out
            / info["data_path"].format(chunk_index=episode["data/chunk_index"], file_index=episode["data/file_index"])
        )
        assert set(rows.column_names) == {name for name, f in info["features"].items() if f["dtype"] != "video"}
        assert (episode["dataset_from_index"], episode["dataset_to_index"]) == (first, first + rows.num_rows)
        assert rows["index"].to_pylist() == list(range(first, first + rows.num_rows))
        assert rows["frame_index"].to_pylist() == list(range(rows.num_rows))
        assert set(rows["episode_index"].to_pylist()) == {number}
        for name, feature in info["features"].items():
            if feature["dtype"] != "video":
                values = np.array(rows[name].to_pylist())
                assert values.shape[1:] == (tuple(feature["shape"]) if feature["shape"] != [1] else ())
        video = info["video_path"].format(
            video_key=lerobot.CAMERA, chunk_index=0, file_index=episode[f"videos/{lerobot.CAMERA}/file_index"]
        )
        with av.open(str(out / video)) as container:
            pictures = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
        assert len(pictures) == rows.num_rows == episode["length"]
        assert list(pictures[0].shape) == info["features"][lerobot.CAMERA]["shape"] == [32, 40, 3]
        first += rows.num_rows
    assert info["total_frames"] == first


def test_rows_are_those_of_the_record(made: Path, out: Path):
    record = open_dataset(made)[1]
    assert record.trajectory is not None and record.truth is not None
    rows = parquet.read_table(out / "data" / "chunk-000" / "file-001.parquet")
    t_us = record.truth.span_us[0] + np.round(np.arange(rows.num_rows) * 1e6 / FPS).astype(int)
    at = np.searchsorted(record.trajectory.t_us, t_us)
    np.testing.assert_array_equal(np.array(rows["observation.state"].to_pylist()), record.trajectory.joints[at])
    force = record.trajectory.pad_force_n.mean(1)[at]
    np.testing.assert_allclose(rows["observation.grip_force"].to_numpy(), force, rtol=1e-6)
    counts = np.array(rows[lerobot.EVENTS].to_pylist())
    k = rows.num_rows // 2
    part = record.events.between(int(t_us[k]) - 100_000, int(t_us[k]))
    for polarity in (False, True):
        here = part.select((part.p == polarity) & (part.x // 4 == 5) & (part.y // 4 == 3))
        assert counts[k, int(polarity), 3, 5] == min(255, here.count)


@pytest.mark.parametrize("fps", [30, 60])
def test_each_event_is_counted_once(made: Path, fps: int):
    """Also where a frame does not last a whole number of microseconds."""
    record = open_dataset(made)[0]
    assert record.truth is not None
    start, end = record.truth.span_us
    t_us = np.arange(start, end)
    one = np.zeros(len(t_us), np.uint16)
    events = Events(t_us, one, one, one > 0)
    some = np.flatnonzero(((t_us - start + 2) * fps) % 10**6 < 4 * fps)  # near the frames
    episode = episode_of(replace(record, events=events.select(some)), fps)
    expected = np.diff(np.searchsorted(t_us[some], episode.t_us))
    np.testing.assert_array_equal(episode.events.sum((1, 2, 3))[1:], expected)


def test_a_sample_without_a_frame_is_named(made: Path):
    record = open_dataset(made)[0]
    assert record.truth is not None
    with pytest.raises(DataError, match=f"{record.name}: the grip is never closed"):
        episode_of(replace(record, truth=record.truth._replace(span_us=(0, 0))), FPS)


def test_sums_over_all_rows_are_told(out: Path):
    stats = json.loads((out / "meta" / "stats.json").read_text())
    tables = [parquet.read_table(path) for path in sorted((out / "data").rglob("*.parquet"))]
    force = np.concatenate([table["observation.grip_force"].to_numpy() for table in tables])
    told = stats["observation.grip_force"]
    assert told["count"] == [len(force)]
    for name, value in {"min": force.min(), "max": force.max(), "mean": force.mean(), "std": force.std()}.items():
        assert told[name][0] == pytest.approx(value, rel=1e-3)
    assert np.array(stats[lerobot.CAMERA]["mean"]).shape == (3, 1, 1)
    assert np.array(stats[lerobot.EVENTS]["max"]).shape == (2, 8, 10)


def test_statistics_of_each_episode_are_beside_it(out: Path):
    info = json.loads((out / "meta" / "info.json").read_text())
    episodes = parquet.read_table(out / "meta" / "episodes" / "chunk-000" / "file-000.parquet").to_pylist()
    for number, episode in enumerate(episodes):
        rows = parquet.read_table(out / "data" / "chunk-000" / f"file-{number:03d}.parquet")
        for name in info["features"]:
            assert episode[f"stats/{name}/count"] == [rows.num_rows]
        force = rows["observation.grip_force"].to_numpy()
        for name in ("min", "max", "mean", "std"):
            told = episode[f"stats/observation.grip_force/{name}"]
            assert told[0] == pytest.approx(getattr(force, name)(), rel=1e-3)
        events = np.array(rows[lerobot.EVENTS].to_pylist())
        np.testing.assert_array_equal(episode[f"stats/{lerobot.EVENTS}/max"], events.max(0))
        assert np.array(episode[f"stats/{lerobot.CAMERA}/mean"]).shape == (3, 1, 1)
    assert episodes[0]["stats/index/max"] != episodes[1]["stats/index/max"]


def test_tasks_are_the_index_of_a_table_of_pandas(out: Path):
    table = parquet.read_table(out / "meta" / "tasks.parquet")
    assert json.loads(table.schema.metadata[b"pandas"])["index_columns"] == ["__index_level_0__"]
    assert table["__index_level_0__"].to_pylist() == [lerobot.TASK]
    assert "LeRobot" in (out / "README.md").read_text()


def test_the_action_of_the_closed_loop_is_the_force_that_was_commanded(made: Path, tmp_path: Path):
    record = open_dataset(made)[0]
    assert record.trajectory is not None and record.truth is not None
    target = np.random.default_rng(0).uniform(1, 9, len(record.trajectory.t_us)).astype(np.float32)
    played = replace(record, trajectory=record.trajectory._replace(target_force_n=target))
    (tmp_path / "played").mkdir()
    record_file.write(tmp_path / "played" / "a.h5", played)
    assert publish(tmp_path / "played", tmp_path / "out", Publication(lerobot=True, fps=FPS)) == 1
    rows = parquet.read_table(tmp_path / "out" / "data" / "chunk-000" / "file-000.parquet")
    t_us = record.truth.span_us[0] + np.round(np.arange(rows.num_rows) * 1e6 / FPS).astype(int)
    np.testing.assert_array_equal(rows["action"].to_numpy(), target[np.searchsorted(record.trajectory.t_us, t_us)])
    info = json.loads((tmp_path / "out" / "meta" / "info.json").read_text())
    assert info["features"]["action"] == {"dtype": "float32", "shape": [1], "names": ["grip_force_n"]}
    assert "grip force that is commanded" in (tmp_path / "out" / "README.md").read_text()
    record_file.write(tmp_path / "played" / "b.h5", record)
    with pytest.raises(DataError, match="commanded in some samples"):
        publish(tmp_path / "played", tmp_path / "other", Publication(lerobot=True, fps=FPS))
    assert not (tmp_path / "other").exists()


def test_pictures_of_the_videos_are_those_of_the_samples(made: Path, out: Path):
    # The codec may err by so many grey levels on average: other episodes' frames, and shifted ones, differ by more.
    most_error, firsts = 2.0, []
    for number, record in enumerate(open_dataset(made)):
        (path,) = out.glob(f"videos/*/chunk-000/file-{number:03d}.mp4")
        rows = parquet.read_table(out / "data" / "chunk-000" / f"file-{number:03d}.parquet")
        with av.open(str(path)) as container:
            frames = list(container.decode(video=0))
        assert len(frames) == rows.num_rows
        stamps = [float(frame.pts * frame.time_base) for frame in frames]
        np.testing.assert_allclose(stamps, rows["timestamp"].to_numpy(), atol=1e-6)
        drawn = [image for _, image in frames_of(record, FPS)]
        assert len(drawn) == len(frames)
        for frame, image in zip((frames[0], frames[-1]), (drawn[0], drawn[-1]), strict=True):
            found = frame.to_ndarray(format="rgb24")[: image.shape[0], : image.shape[1]].astype(int)
            colour = image if image.ndim == 3 else np.repeat(image[..., None], 3, 2)
            assert np.abs(found - colour).mean() < most_error
            assert np.abs(np.roll(found, 1, 1) - colour).mean() > most_error
        firsts.append(drawn[0].astype(int))
    assert np.abs(firsts[0] - firsts[1]).mean() > most_error


def test_no_frame_of_a_video_is_made_of_later_ones(out: Path):
    for path in out.rglob("*.mp4"):
        with av.open(str(path)) as container:
            stamps = [packet.pts for packet in container.demux(video=0) if packet.pts is not None]
        assert stamps == sorted(stamps)


def test_the_hub_reads_the_card(out: Path):
    hub = pytest.importorskip("huggingface_hub", reason="reads the card as the Hub's library does")
    card = hub.DatasetCard.load(out / "README.md")
    assert card.data.license == "cc-by-4.0" and card.data.pretty_name == "Slips"
    assert card.data.task_categories == ["robotics"] and "LeRobot" in card.data.tags
    assert list(out.glob(card.data.configs[0]["data_files"]))


def test_what_cannot_be_is_said(made: Path, out: Path, tmp_path: Path):
    with pytest.raises(DataError, match="a new folder"):
        publish(made, out, Publication(lerobot=True))
    with pytest.raises(ConfigError, match="fps"):
        Publication(lerobot=True, fps=0)
    with pytest.raises(ConfigError, match="neither webdataset"):
        Publication(lerobot=True, webdataset=True)
    recorded = tmp_path / "made"
    building.create(recorded, dump_config(CONFIG))
    requested.request(recorded, "train", 1)
    with pytest.raises(DataError, match=r"no finished sample"):
        publish(recorded, tmp_path / "out", Publication(lerobot=True))
    assert not (tmp_path / "out").exists()
