"""Reading of frames and their times: what they become, and what is refused."""

import io
import os
import struct
import zipfile
import zlib
from typing import Any

import av
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.lib import format as npy
from PIL import Image

from evslip.codecs.clips.grey import encode_srgb, to_grey
from evslip.codecs.clips.sources import STEP_US, frames_from, held, open_clip
from evslip.codecs.clips.times import read_times
from evslip.events import EventCamera
from evslip.events.sensor.optics import decode_srgb
from evslip.utils.errors import ConfigError, DataError

GREY = np.arange(256, dtype=np.uint8).reshape(16, 16)


def colours(grey: np.ndarray) -> np.ndarray:
    return np.repeat(grey[..., None], 3, axis=-1)


@pytest.mark.parametrize("intensity", ["uint8", "srgb", "linear"])
def test_a_grey_in_colour_is_that_grey(intensity):
    plain, coloured = to_grey(GREY, intensity), to_grey(colours(GREY), intensity)
    np.testing.assert_allclose(coloured, plain, rtol=1e-6, atol=2e-4)
    deep = to_grey(GREY.astype(np.uint16) * 257, intensity)
    np.testing.assert_allclose(deep, plain, rtol=1e-6)
    np.testing.assert_allclose(to_grey(colours(GREY).astype(np.uint16) * 257, intensity), plain, rtol=1e-6, atol=2e-4)


def test_luminance_of_a_colour_is_found_in_light_and_luma_in_codes():
    orange = np.array([[[255, 128, 0]]], np.uint8)
    assert to_grey(orange, "uint8")[0, 0] == round(0.299 * 255 + 0.587 * 128)
    light = 0.2126 + 0.7152 * float(decode_srgb(np.array(128.0)))
    assert decode_srgb(to_grey(orange, "srgb"))[0, 0] == pytest.approx(light, rel=1e-5)
    assert to_grey(orange, "linear")[0, 0] == pytest.approx(0.2126 + 0.7152 * 128 / 255, rel=1e-5)
    assert to_grey(np.dstack([orange, [[7]]]).astype(np.uint8), "uint8")[0, 0] == to_grey(orange, "uint8")[0, 0]


@given(st.floats(0, 1))
def test_srgb_codes_are_the_inverse_of_their_decoding(light):
    assert float(decode_srgb(255 * encode_srgb(np.array(light)).astype(np.float64))) == pytest.approx(light, abs=6e-7)


def test_sixteen_bits_make_no_steps(tmp_path):
    ramp = np.linspace(2000, 2400, 400).astype(np.uint16).reshape(20, 20)
    Image.fromarray(ramp).save(tmp_path / "deep.png")
    (image,) = (image for _, image in frames_from(tmp_path, 1.0))
    np.testing.assert_allclose(image, ramp / 257, rtol=1e-6)


def test_colours_of_sixteen_bits_keep_them(tmp_path):
    path = tmp_path / "deep.png"
    codes = np.linspace(2000, 2400, 400).astype(np.uint16).reshape(20, 20)
    with av.open(str(path), "w", format="image2", options={"update": "1"}) as container:
        stream: Any = container.add_stream("png", rate=1)
        stream.width, stream.height, stream.pix_fmt = 20, 20, "rgb48be"
        frame = av.VideoFrame.from_ndarray(np.repeat(codes[..., None], 3, axis=-1), format="rgb48le")
        container.mux(stream.encode(frame.reformat(format="rgb48be")))
        container.mux(stream.encode())
    ((_, image),) = frames_from(tmp_path, 1.0, intensity="linear")
    np.testing.assert_allclose(image, codes / 65535, rtol=1e-5)


def npz(path, **arrays) -> None:
    np.savez(path, **arrays)


def test_arrays_are_read_with_times_and_bodies(tmp_path):
    rng = np.random.default_rng(0)
    luminance = rng.uniform(0, 2, (5, 6, 7)).astype(np.float32)
    bodies = rng.integers(0, 4, (5, 6, 7), np.uint8)
    t_us = np.array([10.5, 20, 40, 41, 1000])
    np.savez_compressed(tmp_path / "clip.npz", luminance=luminance, t_us=t_us, bodies=bodies)
    clip = open_clip(tmp_path / "clip.npz")
    assert (clip.size, clip.count, clip.intensity, clip.labelled) == ((7, 6), 5, "linear", True)
    for number, (time_us, image, mask) in enumerate(clip.frames()):
        assert time_us == t_us[number]
        np.testing.assert_array_equal(image, luminance[number])
        np.testing.assert_array_equal(mask, bodies[number])
    assert [t for t, _ in frames_from(tmp_path / "clip.npz", 100.0)] == [0, 1e4, 2e4, 3e4, 4e4]


def test_seconds_bytes_and_other_byte_orders(tmp_path):
    npz(tmp_path / "clip.npz", frames=np.stack([GREY] * 3).astype(">u2") * 257, t_s=np.array([0.0, 0.5, 1.0]))
    clip = open_clip(tmp_path / "clip.npz")
    assert clip.intensity == "uint8"
    frames = list(clip.frames())
    assert [t for t, _, _ in frames] == [0, 5e5, 1e6]
    np.testing.assert_allclose(frames[0][1], GREY, rtol=1e-6)


FRAMES, TIMES = np.zeros((3, 4, 5), np.uint8), np.arange(3)


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"t_us": TIMES}, "expected one array named frames or luminance; its arrays are t_us"),
        ({"frames": FRAMES, "luminance": FRAMES}, "expected one array"),
        ({"frames": FRAMES[0], "t_us": TIMES}, r"shape \(4, 5\), expected \(frames, height, width\)"),
        ({"frames": FRAMES[:0], "t_us": TIMES[:0]}, "shape"),
        ({"frames": FRAMES.astype(np.int32), "t_us": TIMES}, "type int32"),
        ({"frames": np.array([None] * 3), "t_us": TIMES}, "frames: holds Python objects"),
        ({"frames": FRAMES, "t_us": np.array([0, None, 2])}, "t_us: holds Python objects"),
        ({"frames": FRAMES, "t_us": TIMES.astype(complex)}, "t_us: complex"),
        ({"frames": FRAMES, "t_us": TIMES[:2]}, "2 times were given for 3 frames"),
        ({"frames": FRAMES, "t_us": TIMES[::-1]}, "time of frame 1"),
        ({"frames": FRAMES, "t_us": np.array([0, np.nan, 2])}, "time of frame 1 is nan"),
        ({"frames": FRAMES, "t_us": TIMES, "t_s": TIMES}, "both t_us and t_s"),
        ({"frames": FRAMES, "t_us": TIMES, "bodies": FRAMES[:2]}, "bodies"),
        ({"frames": np.asfortranarray(np.ones((3, 4, 5))), "t_us": TIMES}, "Fortran order"),
    ],
)
def test_arrays_that_cannot_be_meant(arrays, message, tmp_path):
    npz(tmp_path / "clip.npz", **arrays)
    with pytest.raises(DataError, match=message) as caught:
        open_clip(tmp_path / "clip.npz")
    assert str(tmp_path / "clip.npz") in str(caught.value)


def test_arrays_need_times_from_somewhere(tmp_path):
    npz(tmp_path / "clip.npz", frames=FRAMES)
    with pytest.raises(ConfigError, match="fps"):
        open_clip(tmp_path / "clip.npz")


def test_damaged_archives_are_named(tmp_path):
    path = tmp_path / "clip.npz"
    np.savez(path, frames=np.random.default_rng(0).integers(0, 255, (50, 20, 20), np.uint8), t_us=np.arange(50))
    whole = path.read_bytes()
    for content in (b"", b"PK nothing", whole[:100], whole[: len(whole) // 2]):
        path.write_bytes(content)
        with pytest.raises(DataError, match=r"clip\.npz"):
            list(frames_from(path))
    # A flipped bit in the pixels is found by the checksum of the archive.
    path.write_bytes(whole[:5000] + bytes([whole[5000] ^ 1]) + whole[5001:])
    with pytest.raises(DataError, match=r"clip\.npz.*(CRC|damaged)"):
        list(frames_from(path))


def test_an_array_that_claims_more_than_it_holds(tmp_path):
    header = io.BytesIO()
    npy.write_array_header_1_0(header, {"descr": "|u1", "fortran_order": False, "shape": (1000, 4000, 4000)})
    with zipfile.ZipFile(tmp_path / "clip.npz", "w") as archive:
        archive.writestr("frames.npy", header.getvalue() + b"\0" * 100)
    with pytest.raises(DataError, match="shorter than its shape"):
        open_clip(tmp_path / "clip.npz", 10.0)


@pytest.mark.parametrize(
    ("text", "unit", "times_us"),
    [
        ("0\n100\n250.5\n", None, [0, 100, 250.5]),
        ("t_us\n0\n100\n", None, [0, 100]),
        ("\ufefft_s,file\n0.1,a.png\n0.2,b.png\n", None, [1e5, 2e5]),
        ("# seconds, as in IJRR's images.txt\n0.5 images/a.png\n\n0.75 images/b.png\n", "s", [5e5, 7.5e5]),
        ("time_us;x\n-5;1\n5;1\n", None, [-5, 5]),
    ],
)
def test_times_are_read(text, unit, times_us, tmp_path):
    (tmp_path / "times.csv").write_text(text, encoding="utf-8")
    np.testing.assert_allclose(read_times(tmp_path / "times.csv", unit), times_us, rtol=1e-12)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("0\nsoon\n", "line 2 begins with 'soon'"),
        ("frame,t\n0,1\n", "line 1 begins with 'frame'"),
        ("t_us\n", "holds no times"),
        ("0\n5\n5\n", "frame 2, 5 us, does not come after"),
        ("0\n9\n5\n", "frame 2"),
        ("0\nnan\n5\n", "frame 1 is nan"),
        ("0\ninf\n", "frame 1 is inf"),
        ("0.033\n0.066\n0.1\n", "less than a microsecond apart; are they seconds"),
        ("", "empty"),
    ],
)
def test_times_that_cannot_be_meant(text, message, tmp_path):
    (tmp_path / "times.csv").write_text(text)
    with pytest.raises(DataError, match=message):
        read_times(tmp_path / "times.csv")


def test_units_and_sources_of_times_are_checked(tmp_path):
    (tmp_path / "times.csv").write_text("0\n1000\n")
    with pytest.raises(ConfigError, match=r"times-unit.*us, s"):
        read_times(tmp_path / "times.csv", "ms")
    with pytest.raises(DataError, match="nowhere"):
        read_times(tmp_path / "nowhere.csv")
    npz(tmp_path / "clip.npz", frames=FRAMES, t_us=TIMES)
    with pytest.raises(ConfigError, match="both were given"):
        open_clip(tmp_path / "clip.npz", 10.0, times_us=np.arange(3.0))
    with pytest.raises(DataError, match="2 times were given for 3 frames"):
        open_clip(tmp_path / "clip.npz", times_us=np.arange(2.0))
    with pytest.raises(ConfigError, match=r"intensity.*linear, uint8, srgb"):
        open_clip(tmp_path / "clip.npz", intensity="gamma")


def write_video(path, codec="libx264", pix_fmt="yuv420p", options=None) -> None:
    rng = np.random.default_rng(0)
    with av.open(str(path), "w", options=options or {}) as container:
        stream: Any = container.add_stream(codec, rate=50)
        stream.width, stream.height, stream.pix_fmt = 64, 48, pix_fmt
        for number in range(60):
            picture = rng.integers(0, 255, (48, 64, 3), np.uint8)
            picture[:, :16], picture[:, 16:32], picture[:, 32:48] = 255, 0, 3 * number
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        container.mux(stream.encode())


@pytest.mark.parametrize("intensity", ["uint8", "srgb", "linear"])
def test_the_limited_range_of_videos_is_spread(intensity, tmp_path):
    write_video(tmp_path / "clip.mkv")
    images = [image for _, image in frames_from(tmp_path / "clip.mkv", intensity=intensity)]
    white = 1.0 if intensity == "linear" else 255.0
    assert images[30][24, 8] == pytest.approx(white, rel=0.02)
    assert images[30][24, 24] == pytest.approx(0, abs=0.01 * white)
    assert images[30][24, 40] == pytest.approx(90 / 255 * white, rel=0.04)


@pytest.mark.parametrize(
    ("name", "options"), [("clip.mp4", {}), ("clip.mp4", {"movflags": "faststart"}), ("clip.mkv", {})]
)
@pytest.mark.parametrize("share", [0.5, 0.85])
def test_truncated_videos_are_refused(name, options, share, tmp_path):
    path = tmp_path / name
    write_video(path, options=options)
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    with pytest.raises(DataError, match=f"{name}.*truncated"):
        list(frames_from(path))


def test_times_given_for_a_video_must_be_as_many_as_its_frames(tmp_path):
    write_video(tmp_path / "clip.mkv")
    for count in (59, 61):
        with pytest.raises(DataError, match=f"{count} times"):
            list(frames_from(tmp_path / "clip.mkv", times_us=1e3 * np.arange(count)))
    times = [t for t, _ in frames_from(tmp_path / "clip.mkv", times_us=7.0 * np.arange(60))]
    assert times == [7.0 * number for number in range(60)]


def test_held_frames_change_in_a_microsecond():
    frames = [
        (0.0, np.full((1, 1), 0.1), None),
        (1000.0, np.full((1, 1), 0.4), None),
        (5000.0, np.full((1, 1), 0.1), None),
    ]
    shown = list(held(frames))
    assert [t for t, _, _ in shown] == [0, 1000 - STEP_US, 1000, 5000 - STEP_US, 5000]
    sensor = EventCamera("clean", size=(1, 1), sigma=0.0, theta=0.2)
    events = sensor.run(shown)
    assert events.count == 2 * int(np.log(0.401 / 0.101) / 0.2)
    assert set(events.t_us[events.p]) <= {999, 1000}
    assert set(events.t_us[~events.p]) <= {4999, 5000}


def test_frames_too_close_to_be_held_come_as_they_are():
    frames = [(t, np.zeros((1, 1)), None) for t in (0.0, 1.5, 3.0)]
    assert list(held(frames)) == frames


@pytest.mark.parametrize(
    ("side", "message"), [(12_000, "a frame of 12000x12000"), (30_000, "a frame of hundreds of millions of")]
)
def test_frames_too_large_are_refused_by_their_heads(tmp_path, side: int, message: str):
    for number in range(3):
        head = struct.pack(">2I5B", side, side, 8, 0, 0, 0, 0)
        chunks = ((b"IHDR", head), (b"IDAT", b""), (b"IEND", b""))
        data = b"".join(
            struct.pack(">I", len(text)) + kind + text + struct.pack(">I", zlib.crc32(kind + text))
            for kind, text in chunks
        )
        (tmp_path / f"{number}.png").write_bytes(b"\x89PNG\r\n\x1a\n" + data)
    with pytest.raises(DataError, match=rf"0\.png: {message}.* pixels, expected at most 8\.4 million pixels"):
        open_clip(tmp_path, 30.0)


def test_arrays_of_too_large_frames_are_refused_by_their_shape(tmp_path):
    header = io.BytesIO()
    npy.write_array_header_1_0(header, {"descr": "|u1", "fortran_order": False, "shape": (3, 12_000, 12_000)})
    with zipfile.ZipFile(tmp_path / "clip.npz", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("frames.npy", header.getvalue() + bytes(3 * 12_000**2))
    with pytest.raises(DataError, match=r"clip\.npz: a frame of 12000x12000 pixels"):
        open_clip(tmp_path / "clip.npz", 30.0)


def test_a_pipe_is_no_frame(tmp_path):
    os.mkfifo(tmp_path / "0.png")
    for path in (tmp_path, tmp_path / "0.png"):
        with pytest.raises(DataError, match=r"0\.png: is a device, a pipe or a socket"):
            open_clip(path, 30.0)
