"""Event camera: frames in, events out."""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from evslip.events.biases import WHITE_LUX, Bias, circuit, pixel_parameters
from evslip.events.frame import NO_BODY, Frame
from evslip.events.pixel_model import FOREIGN, own_parameters
from evslip.events.pixels.accurate import AccuratePixels
from evslip.events.presets import named, named_readout, resolve
from evslip.events.readout.settings import Readout, with_changes
from evslip.events.sensor.frame_buffer import FrameBuffer
from evslip.events.sensor.frame_checks import checked_image, checked_mask, checked_time, timed
from evslip.events.sensor.optics import INTENSITIES, Intensity
from evslip.events.sensor.ordering import in_time_order, unpack
from evslip.events.sensor.sensor import Sensor
from evslip.events.sensor.threads import FrameProcessor
from evslip.events.stream import Events, concatenate, empty_events
from evslip.events.v2e.pixels import V2EPixels
from evslip.utils.errors import ConfigError, DataError

if TYPE_CHECKING:
    from evslip.events.readout.counts import ReadoutCounts
    from evslip.events.readout.sensor_readout import SensorReadout

CHUNK_FRAMES, CHUNK_BYTES = 32, 1 << 25
"""`run` works on so many frames at once, or on as many as fit into so many bytes."""
MOST_NOISE = 1 << 24
"""Noise events between two frames, or of those that are worked on at once: they take 0.8 GB."""

Mode = Literal["accurate", "v2e"]
MODES = ("accurate", "v2e")
Device = Literal["cpu", "cuda"]
DEVICES = ("cpu", "cuda")
Timed = tuple[float, np.ndarray] | tuple[float, np.ndarray, np.ndarray | None] | Frame


class EventCamera:
    """Simulates the pixels of an event camera.

    `step` takes one frame and returns the events since the frame before; `run` takes a whole sequence. Between frames
    the logarithm of intensity is taken as linear in time, so frames should be close enough that edges move by less than
    about a pixel from one to the next. The output depends on the frames, the parameters and the seed: not on threads,
    nor on how frames are grouped into calls.

    preset: a name of `presets.PRESETS`, or the path of a .toml file, see `preset_file`.
    size: (width, height) in pixels.
    seed: 0 to 2**64 - 1; 0 is a seed like any other.
    mode: "accurate": the rules of `pixel`; "v2e": those of v2e, see `v2e`.
    intensity: "linear": images are linear luminance with white = 1, floats that may exceed 1. "uint8": images of 0 to
        255 in uint8 or floats, mapped to log intensity by v2e's lin-log curve. "srgb": the same images, first decoded
        to linear luminance.
    threads: in accurate mode, rows are shared among so many threads.
    device: "cuda" computes accurate mode on an NVIDIA GPU; the events are those of "cpu", but for single times that
        differ by a microsecond.
    readout: how events are read out, and what is lost on the way: a `Readout`, or some of its fields by name, in place
        of the preset's. Events that come out later than the last frame wait for the next one; see `waiting`.
    parameters: any field of `presets.PixelModel`, in place of the preset's.

    Raises ConfigError for a wrong argument, MissingExtraError for device "cuda" where there is none.
    """

    def __init__(
        self,
        preset: str = "davis346",
        *,
        size: tuple[int, int] = (346, 260),
        seed: int = 0,
        mode: Mode = "accurate",
        intensity: Intensity = "linear",
        threads: int = 1,
        device: Device = "cpu",
        readout: Readout | Mapping[str, float] | None = None,
        **parameters: Any,
    ):
        _one_of("mode", mode, MODES)
        _one_of("intensity", intensity, INTENSITIES)
        _one_of("device", device, DEVICES)
        require_whole("seed", seed, 0, 2**64 - 1)
        require_whole("threads", threads, 1, 1024)
        if not isinstance(size, tuple | list | np.ndarray) or len(size) != 2:
            raise ConfigError(f"camera size: {size!r} is wrong, expected (width, height)")
        for name, length in zip(("width", "height"), size, strict=True):
            require_whole(name, length, 1, 65535)
        width, height = size
        self.shape = (int(height), int(width))
        self.mode: Mode = mode
        self.intensity: Intensity = intensity
        self.seed = int(seed)
        self.threads = int(threads)
        self.model = resolve(preset, parameters, self.shape)
        self.readout = with_changes(named_readout(preset), {} if readout is None else readout)
        self._noise_hz = self.model.noise_hz(self.shape[0] * self.shape[1])
        self._waiting = 0.0  # noise events of the frames in the buffer
        asked = [name for name in FOREIGN[mode] if name in parameters]
        if asked:
            other = "accurate" if mode == "v2e" else "v2e"
            raise ConfigError(f"camera parameter {asked[0]}: mode {mode!r} has none; it belongs to mode {other!r}")
        self._sensor: Sensor
        if mode == "v2e" and device == "cuda":
            raise ConfigError("camera device: mode 'v2e' has no 'cuda'; expected device='cpu' or mode='accurate'")
        if mode == "v2e":
            self._sensor = V2EPixels(self.model, self.shape, self.seed, intensity)
        elif device == "cuda":
            # numba's CUDA takes a moment to import, and asks for a driver.
            from evslip.events.pixels.cuda import CudaPixels

            self._sensor = CudaPixels(self.model, self.shape, self.seed, intensity)
        else:
            self._sensor = AccuratePixels(self.model, self.shape, self.seed, intensity, self.threads)
        self._buffer = FrameBuffer(self.shape, np.dtype(np.uint8), 0)
        self._readout = self._idle_readout()

    @classmethod
    def from_biases(
        cls,
        biases: Mapping[str, Bias] | None = None,
        preset: str = "davis346",
        *,
        white_lux: float = WHITE_LUX,
        **arguments: Any,
    ) -> "EventCamera":
        """A DAVIS346 with these bias currents, see `biases`: thresholds, bandwidth, refractory period and leak follow
        from them; what biases do not set is the preset's.

        biases: by name (DiffBn, OnBn, OffBn, PrBp, PrSFBp, RefrBp) a code (coarse, fine) as libcaer and DV show it, or
            a current in amperes; those not given are `biases.DAVIS346_BIASES`.
        white_lux: illumination of the scene, in lux; it sets how fast the photoreceptor is.
        arguments: as of EventCamera; parameters given replace those that follow from the biases.

        The pixels have one pole of low-pass, the circuit three: the slowest is kept, see `biases.pixel_parameters`.
        Raises ConfigError naming the bias.
        """
        found = pixel_parameters(circuit(biases or {}, white_lux), named(preset))
        foreign = set(FOREIGN["v2e"] if arguments.get("mode") == "v2e" else ())
        foreign |= {"theta_on", "theta_off"} if "theta" in arguments else set()
        parameters: dict[str, Any] = {name: value for name, value in found.items() if name not in foreign}
        return cls(preset, **parameters | arguments)

    @property
    def theta_on(self) -> np.ndarray:
        """ON threshold of each pixel in ln units, of shape (height, width)."""
        return self._sensor.threshold_on.copy()

    @property
    def theta_off(self) -> np.ndarray:
        """OFF threshold of each pixel in ln units, of shape (height, width)."""
        return self._sensor.threshold_off.copy()

    @property
    def readout_counts(self) -> "ReadoutCounts | None":
        """Counts of what became of the events since the camera was made or reset; None if the readout is off."""
        return None if self._readout is None else self._readout.counts

    def waiting(self) -> Events:
        """Events that have not come out of the readout yet, as they would if none followed. They stay there."""
        return empty_events() if self._readout is None else self._readout.waiting()

    def reset(self) -> None:
        """Forget all frames; the next one is a first frame again, and the same frames give the same events."""
        self._buffer.clear()
        self._readout = self._idle_readout()

    def state(self) -> dict[str, Any]:
        """Settings and state of the camera, as plain values and arrays; see `from_state`."""
        buffer = self._buffer
        return {
            "model": asdict(self.model),
            "size": (self.shape[1], self.shape[0]),
            "seed": self.seed,
            "mode": self.mode,
            "intensity": self.intensity,
            "last_us": buffer.last_us,
            "last_bodies": buffer.frames.bodies[0].reshape(self.shape).copy() if buffer.labelled else None,
            "memory": self._sensor.memory(),
            "readout": asdict(self.readout),
            "readout_memory": None if self._readout is None else self._readout.memory(),
        }

    @classmethod
    def from_state(cls, state: dict[str, Any], threads: int = 1, device: Device = "cpu") -> "EventCamera":
        """A camera that continues exactly where the one stood whose `state()` this is."""
        names = ("size", "seed", "mode", "intensity")
        model = own_parameters(state["model"], state["mode"])
        settings = {"threads": threads, "device": device, "readout": state.get("readout")}
        camera = cls("clean", **settings, **{name: state[name] for name in names}, **model)
        if state["last_us"] is not None:
            camera._buffer.begin(state["last_us"], None, state["last_bodies"])
            camera._sensor.restore(state["memory"])
            if camera._readout is not None:
                camera._readout.restore(state["readout_memory"])
        return camera

    def step(self, t_us: float, image: np.ndarray, bodies: np.ndarray | None = None) -> Events:
        """Events between the frame before and this one; none for the first frame, which the pixels settle on.

        t_us: time in microseconds, later than the last; fractions are welcome.
        image: of shape (height, width), in the camera's intensity scale.
        bodies: index into `frame.BODIES` of what each pixel sees, uint8 of shape (height, width). An event takes
            the label of the frame nearer in time.
        Raises DataError for input that cannot be meant; the camera is then as it was before the call.
        """
        self._take(t_us, image, bodies, 1, self._process)
        return self._read_out(self._process())

    def run(self, frames: Iterable[Timed]) -> Events:
        """Events of a sequence of (t_us, image), (t_us, image, bodies) or Frame, as from `step` one by one.

        Works through the sequence as it comes and keeps only events; the arrays may be reused once the next frame is
        asked for. With more than one thread, frames are asked for while those before them are still worked on.
        Continues where the last call ended. When a frame raises, the camera stands after the one before it. Raises
        DataError.
        """
        with self._processor() as processor:

            def process() -> None:
                self._buffer = processor.process(self._buffer)

            try:
                for t_us, image, bodies in timed(frames):
                    self._take(t_us, image, bodies, CHUNK_FRAMES, process)
                    if processor.wants(self._buffer):
                        process()
            finally:
                process()
                made = self._read_out(_in_a_row(processor.events()))
        return made

    def _take(self, t_us: float, image: Any, bodies: Any, length: int, process: Callable[[], object]) -> None:
        """Put a frame into the buffer, after processing what is there of another type."""
        time_us, image, bodies = self._checked(t_us, image, bodies)
        noise = self._noise_until(time_us)
        self._waiting = noise + (self._waiting if self._buffer.count else 0.0)
        if self._waiting > MOST_NOISE:
            process()
            self._waiting = noise
        length = max(1, min(length, CHUNK_BYTES // image.nbytes))
        if self._buffer.dtype != image.dtype or self._buffer.length < length:
            if self._buffer.count > 0:
                process()
            self._buffer = FrameBuffer(self.shape, image.dtype, length).follow(self._buffer)
        if self._buffer.begun:
            self._buffer.add(time_us, image, bodies)
        else:
            if self._readout is not None:
                self._readout.begin(time_us)
            self._buffer.begin(time_us, image, bodies)
            # A copy is contiguous and writable: one type for the compiler, whatever the caller's array is.
            self._sensor.begin(np.array(image, order="C"), time_us)

    def _idle_readout(self) -> "SensorReadout | None":
        if not self.readout.is_on:
            return None
        # Nothing is compiled, or loaded, for a readout that is off.
        from evslip.events.readout.sensor_readout import SensorReadout

        return SensorReadout(self.readout, self.shape, self.seed)

    def _read_out(self, events: Events) -> Events:
        """Events that leave the readout up to the last frame, given the events that fired since the frames before."""
        if self._readout is None or self._buffer.last_us is None:
            return events
        return self._readout.read(events, math.floor(self._buffer.last_us))

    def _process(self) -> Events:
        """Events of all frames in the buffer, which then begins anew."""
        with self._processor() as processor:
            self._buffer = processor.process(self._buffer)
            return processor.events()[0]

    def _processor(self) -> FrameProcessor:
        return FrameProcessor(self._sensor.tasks, self._arranged, self.threads)

    @staticmethod
    def _arranged(raw: np.ndarray, labelled: bool) -> Events:
        """Raw events of a sensor in order; with a column of bodies if they are known."""
        times, words = in_time_order(raw)
        x, y, p, body, cause = unpack(words)
        return Events(times, x, y, p, body if labelled else None, cause)

    def _noise_until(self, time_us: float) -> float:
        """Noise events since the last frame, about."""
        last_us = self._buffer.last_us
        return 0.0 if last_us is None else self._noise_hz * (time_us - last_us) / 1e6

    def _checked(self, t_us: Any, image: Any, bodies: Any) -> tuple[float, np.ndarray, np.ndarray | None]:
        """A frame in the units of the kernel. Raises DataError."""
        last_us = self._buffer.last_us
        time_us = checked_time(t_us, last_us)
        if (noise := self._noise_until(time_us)) > MOST_NOISE:
            raise DataError(
                f"frame time {time_us:.10g} us: {noise / 1e6:,.0f} million noise events since the frame at "
                f"{last_us:.10g} us, expected at most {MOST_NOISE / 1e6:.0f}: frames that come closer, or less noise"
            )
        if bodies is not None:
            bodies = checked_mask(bodies, self.shape, time_us)
        return time_us, checked_image(image, self.shape, self.intensity, time_us), bodies


def _in_a_row(parts: list[Events]) -> Events:
    """Events of buffers one after the other; with bodies if any has them."""
    if any(part.body is not None for part in parts):
        parts = [p if p.body is not None else p.replace(body=np.full(p.count, NO_BODY, np.uint8)) for p in parts]
    return concatenate(parts)


def _one_of(name: str, value: Any, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise ConfigError(f"camera {name}: {value!r} is unknown; expected one of {', '.join(choices)}")


def require_whole(name: str, value: Any, low: int, high: float = math.inf) -> None:
    """Raise ConfigError unless an argument of a camera is a whole number within limits, both included."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or not low <= value <= high:
        upto = "" if high == math.inf else f" to {high}"
        raise ConfigError(f"camera {name}: {value!r} is wrong, expected a whole number from {low}{upto}")
