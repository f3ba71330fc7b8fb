"""Verbs about event cameras and their recordings."""

from pathlib import Path

from tyro.conf import Positional

from evslip.cli.options import describe
from evslip.console import console


def events(
    frames: Positional[Path],
    out: Positional[Path],
    *,
    fps: float | None = None,
    camera: str = "davis346",
    seed: int = 0,
    noise_map: Path | None = None,
) -> None:
    """Turn frames that a camera or another renderer made into events.

    Args:
        frames: Folder of images, or a video file.
        out: File to write; its suffix says the format.
        fps: Frames a second; a video knows its own.
        camera: Preset of the event camera.
        seed: Seed of its noise.
        noise_map: File made by `evslip calibrate-noise`: each pixel is as noisy as that of the real sensor.
    """
    from evslip.codecs import check_suffix, write_events
    from evslip.events import EventCamera, load_noise_map
    from evslip.events.sources import frame_size, frames_from

    check_suffix(out, writing=True)
    source = frames_from(frames, fps)
    size = frame_size(frames)
    noise = None if noise_map is None else load_noise_map(noise_map)
    stream = EventCamera(camera, size=size, seed=seed, intensity="uint8", noise_map=noise).run(source)
    write_events(out, stream, size)
    console.print(f"{out}: {describe(stream, size)}")


def calibrate_noise(recording: Positional[Path], out: Positional[Path]) -> None:
    """Measure the noise of each pixel of a real sensor, from a recording of a still scene in constant light.

    Args:
        recording: File of events; several minutes long, since rare events need time.
        out: File to write, .npz: for `evslip events --noise-map`, or the camera's parameter noise_map.
    """
    from evslip.codecs import read_recording
    from evslip.events.calibrate import check_noise_suffix, measure_noise, save_noise_map

    check_noise_suffix(out)
    record = read_recording(recording)
    rates = measure_noise(record.events, record.size)
    save_noise_map(out, rates)
    on, off = rates.mean((1, 2))
    busiest = float(rates.sum(0).max())
    console.print(f"{recording}: {describe(record.events, record.size)}")
    console.print(f"{out}: {on:.3g} ON and {off:.3g} OFF events/s a pixel; the busiest pixel has {busiest:.3g}/s")
    silent = float((rates.sum(0) == 0).mean())
    if silent > 0.5:
        console.print(f"{silent:.0%} of the pixels never fired: record for longer to measure them")


def import_(recording: Positional[Path], out: Positional[Path]) -> None:
    """Bring a real recording into evslip's own format.

    Args:
        recording: File of an event camera, such as AEDAT4.
        out: HDF5 file to write.
    """
    from evslip.codecs import import_recording

    record = import_recording(recording, out)
    console.print(f"{out}: {describe(record.events, record.size)}")
