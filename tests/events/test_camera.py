import copy
import pickle
import subprocess
import sys
import time

import numpy as np
import pytest

import evslip
from evslip.events import PRESETS, EventCamera, EventCameras, concatenate
from evslip.events.batch import camera_seed
from evslip.events.frame import BACKGROUND, GRIPPER, NO_BODY, OBJECT, Frame
from evslip.events.sensor.frame_buffer import FrameBuffer
from evslip.events.sensor.threads import FrameProcessor
from evslip.events.stream import FIELDS, Events, empty_events
from evslip.generation.sensor import camera_for
from evslip.utils import seeds
from evslip.utils.errors import ConfigError, DataError

WIDTH, HEIGHT = 37, 23


@pytest.fixture(scope="module")
def clip() -> list[Frame]:
    """A bright bar that moves over a textured ground, with masks; 50 frames at irregular times."""
    rng = np.random.default_rng(0)
    ground = rng.uniform(0.02, 0.6, (HEIGHT, WIDTH)).astype(np.float32)
    frames, columns = [], np.arange(WIDTH)
    for number, t_us in enumerate(np.cumsum(rng.integers(300, 8000, 50)).tolist()):
        cover = np.clip(4 - np.abs(columns - 0.6 * number), 0, 1).astype(np.float32)
        bodies = np.where(cover > 0.5, OBJECT, BACKGROUND).astype(np.uint8) * np.ones((HEIGHT, 1), np.uint8)
        frames.append(Frame(t_us, ground * (1 - cover) + 1.4 * cover, bodies))
    return frames


def camera(preset: str = "noisy", **parameters) -> EventCamera:
    return EventCamera(preset, size=(WIDTH, HEIGHT), **parameters)


def equal(a: Events, b: Events) -> bool:
    return all(
        (x is None and y is None) or (x is not None and y is not None and x.dtype == y.dtype and np.array_equal(x, y))
        for x, y in ((getattr(a, name), getattr(b, name)) for name in FIELDS)
    )


@pytest.mark.parametrize("preset", PRESETS)
def test_events_are_sorted_typed_and_inside(preset, clip):
    events = camera(preset).run(clip)
    assert events.count > 1000
    assert [getattr(events, name).dtype for name in FIELDS] == [
        np.int64,
        np.uint16,
        np.uint16,
        bool,
        np.uint8,
        np.uint8,
    ]
    assert np.all(np.diff(events.t_us) >= 0)
    assert events.t_us[0] >= clip[0].t_us
    assert events.t_us[-1] <= clip[-1].t_us
    assert events.x.max() < WIDTH
    assert events.y.max() < HEIGHT


@pytest.mark.parametrize("photoreceptor_noise", [0.0, 0.05])
@pytest.mark.parametrize("preset", PRESETS)
def test_whole_chunked_stepped_and_threaded_are_equal(preset, photoreceptor_noise, clip, monkeypatch):
    def camera(preset, **arguments):
        noise = {} if preset == "clean" else {"photoreceptor_noise": photoreceptor_noise}
        return EventCamera(preset, size=(WIDTH, HEIGHT), **noise, **arguments)

    whole = camera(preset).run(clip)
    for threads in (1, 2):
        stepping = camera(preset, threads=threads)
        steps = [stepping.step(*frame) for frame in clip]
        assert steps[0].count == 0
        assert equal(whole, concatenate(steps))
    assert equal(whole, camera(preset, threads=3).run(clip))
    for size in (1, 7, 64):
        monkeypatch.setattr("evslip.events.camera.CHUNK_FRAMES", size)
        assert equal(whole, camera(preset).run(iter(clip)))
    halves = camera(preset)
    first, second = halves.run(clip[:20]), halves.run(clip[20:])
    assert equal(whole, concatenate([first, second]))


def test_fractional_times_keep_the_order_of_steps(clip):
    frames = [(frame.t_us / 1000 + 0.3, frame.luminance) for frame in clip]
    stepping = camera(theta=0.05)
    steps = [stepping.step(*frame) for frame in frames]
    whole = camera(theta=0.05).run(frames)
    assert whole.body is None
    assert np.array_equal(whole.t_us, np.concatenate([step.t_us for step in steps]))
    assert np.array_equal(whole.x, np.concatenate([step.x for step in steps]))


def test_arrays_may_be_reused_by_the_caller(clip):
    def reused():
        image, bodies = np.empty_like(clip[0].luminance), np.empty_like(clip[0].bodies)
        for frame in clip:
            image[...], bodies[...] = frame.luminance, frame.bodies
            yield frame.t_us, image, bodies

    assert equal(camera().run(clip), camera().run(reused()))


def test_a_broken_source_leaves_the_camera_after_its_last_good_frame(clip):
    def broken():
        yield from clip[:20]
        raise OSError("unplugged")

    sensor, expected = camera(), camera()
    with pytest.raises(OSError, match="unplugged"):
        sensor.run(broken())
    expected.run(clip[:20])
    assert equal(sensor.run(clip[20:]), expected.run(clip[20:]))


def test_seeds_differ_and_repeat(clip):
    runs = [camera(seed=seed).run(clip) for seed in (0, 0, 1, 2**64 - 1)]
    assert equal(runs[0], runs[1])
    assert not equal(runs[0], runs[2])
    assert not equal(runs[0], runs[3])


def test_reset_forgets_everything(clip):
    sensor = camera()
    first = sensor.run(clip)
    with pytest.raises(DataError, match="does not come after"):
        sensor.run(clip)
    sensor.reset()
    assert equal(first, sensor.run(clip))


@pytest.mark.parametrize("threads", [1, 2])
def test_reset_forgets_masks(threads, clip):
    sensor = camera("clean", threads=threads)
    assert sensor.run(clip).body is not None
    sensor.reset()
    assert equal(sensor.run((t_us, image) for t_us, image, _ in clip), camera("clean").run(f[:2] for f in clip))


@pytest.mark.parametrize("mode", ["accurate", "v2e"])
def test_a_camera_continues_from_its_state(mode, clip):
    theta = np.random.default_rng(6).uniform(0.1, 0.3, (HEIGHT, WIDTH))
    whole = camera(mode=mode, seed=5, theta_on=theta, leak_rate_hz=3.0)
    first = camera(mode=mode, seed=5, theta_on=theta, leak_rate_hz=3.0)
    whole.run(clip[:20]), first.run(clip[:20])
    state = pickle.loads(pickle.dumps(first.state()))
    first.run(clip[20:])
    resumed = EventCamera.from_state(state, threads=2)
    assert equal(whole.run(clip[20:]), resumed.run(clip[20:]))
    fresh = EventCamera.from_state(camera(mode=mode).state())
    assert equal(fresh.run(clip), camera(mode=mode).run(clip))


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda camera: pickle.loads(pickle.dumps(camera))])
@pytest.mark.parametrize("preset", ["clean", "davis346", "dvxplorer-lite"])
def test_a_copy_continues_where_the_camera_stands(preset, copied, clip):
    first = camera(preset)
    first.run(clip[:20])
    other = copied(first)
    assert equal(first.run(clip[20:]), other.run(clip[20:]))


def test_a_batch_is_its_cameras(clip):
    batch = EventCameras(3, "noisy", size=(WIDTH, HEIGHT), seed=9, threads=2)
    single = [EventCamera("noisy", size=(WIDTH, HEIGHT), seed=camera_seed(9, i)) for i in range(3)]
    for number in range(10):
        frames = [clip[number + 10 * i] for i in range(3)]
        times = np.array([frame.t_us for frame in frames])
        images, masks = np.stack([frame.luminance for frame in frames]), np.stack([frame.bodies for frame in frames])
        together = batch.step(times, images, masks)
        assert all(equal(a, camera.step(*frame)) for a, camera, frame in zip(together, single, frames, strict=True))
    batch.reset(np.array([False, True, False]))
    assert [events.count > 0 for events in batch.step(10**6, images, masks)] == [True, False, True]
    with pytest.raises(DataError, match="2 given for 3"):
        batch.step(2 * 10**6, images[:2])
    with pytest.raises(DataError, match="expected one time or 3"):
        batch.step(np.array([2e6, 3e6]), images)
    with pytest.raises(ConfigError, match="count"):
        EventCameras(0)


@pytest.mark.parametrize("name, value", [("count", 0), ("threads", 0), ("threads", "2"), ("seed", -1), ("seed", 1.5)])
def test_a_batch_that_cannot_be_is_named(name, value):
    with pytest.raises(ConfigError, match=rf"^camera {name}: {value!r} is wrong, expected a whole number from"):
        EventCameras(**{"count": 2, name: value}, size=(4, 4))


def test_body_is_that_of_the_nearer_frame():
    sensor = EventCamera("clean", size=(1, 1), sigma=0.0, theta=0.2, dark=1e-3)
    masks = [np.full((1, 1), body, np.uint8) for body in (OBJECT, GRIPPER, GRIPPER)]
    images = [np.full((1, 1), np.exp(level) - 1e-3) for level in (-3.0, -2.0, -1.1)]
    events = sensor.run(zip((0, 1000, 2000), images, masks, strict=True))
    assert events.t_us.tolist() == [200, 400, 600, 800, 1000, 1222, 1444, 1667, 1889]
    assert events.body is not None
    assert events.body.tolist() == [OBJECT] * 2 + [GRIPPER] * 7
    # A frame without a mask in between leaves its neighbourhood unknown.
    sensor.reset()
    events = sensor.run(zip((0, 1000, 2000), images, [masks[0], None, masks[2]], strict=True))
    assert events.body is not None
    assert events.body.tolist() == [OBJECT] * 2 + [NO_BODY] * 5 + [GRIPPER] * 2


def test_images_of_other_types_and_layouts_give_the_same_events(clip):
    images = [frame.luminance.astype(np.float16) for frame in clip]
    times = [frame.t_us for frame in clip]
    expected = camera().run(zip(times, images, strict=True))
    turned = [image.astype(">f8") for image in images]
    assert equal(expected, camera().run(zip(times, turned, strict=True)))
    frozen = [np.asfortranarray(image, np.float64) for image in images]
    for image in frozen:
        image.flags.writeable = False
    assert equal(expected, camera().run(zip(times, frozen, strict=True)))


def test_bytes_and_floats_of_bytes_agree():
    rng = np.random.default_rng(2)
    images = [rng.integers(0, 256, (HEIGHT, WIDTH), np.uint8) for _ in range(12)]
    times = np.arange(12) * 1000
    expected = camera("davis346", intensity="uint8").run(zip(times, images, strict=True))
    floats = (image.astype(np.float32) for image in images)
    assert expected.count > 500
    assert equal(expected, camera("davis346", intensity="uint8").run(zip(times, floats, strict=True)))


@pytest.mark.parametrize("preset", ["clean", "dvxplorer"])
def test_threads_take_frames_of_two_types(preset):
    rng = np.random.default_rng(3)
    images = np.clip(128 + np.cumsum(rng.integers(-9, 10, (100, 150, 200)), axis=0), 0, 255).astype(np.uint8)
    mixed = [(1000 * k, image if k // 5 % 2 else image.astype(np.float32)) for k, image in enumerate(images)]
    whole, *others = (
        EventCamera(preset, size=(200, 150), intensity="uint8", threads=threads).run(mixed) for threads in (1, 2, 3)
    )
    assert whole.count > 100_000
    assert all(equal(whole, other) for other in others)


def test_tasks_are_made_when_those_before_are_done():
    made, done = [], []

    def split(buffer):
        assert len(made) == len(done)
        made.append(buffer)
        return [task]

    def task():
        time.sleep(0.1)
        done.append(True)
        return np.empty((0, 2), np.int64)

    buffer = FrameBuffer((1, 16), np.dtype(np.uint8), 2)
    buffer.begin(0.0, np.zeros((1, 16), np.uint8), None)
    with FrameProcessor(split, lambda raw, labelled: empty_events(), 2) as processor:
        for t_us in (1.0, 2.0, 3.0):
            buffer.add(t_us, np.zeros((1, 16), np.uint8), None)
            buffer = processor.process(buffer)
        assert len(processor.events()) == len(done) == 3


def test_bytes_follow_the_linear_logarithm():
    # From 10 to 20 the curve is linear in intensity, from 40 to 80 logarithmic.
    sensor = EventCamera("clean", size=(2, 1), sigma=0.0, theta=0.1, intensity="uint8")
    sensor.step(0, np.array([[10, 40]], np.uint8))
    events = sensor.step(1000, np.array([[20, 80]], np.uint8))
    assert np.bincount(events.x).tolist() == [int(np.log(20) / 20 * 10 / 0.1), int(np.log(2) / 0.1)]


def test_srgb_bytes_are_decoded_to_luminance():
    codes = np.array([[60, 200]], np.uint8)
    linear = ((codes / 255 + 0.055) / 1.055) ** 2.4
    srgb = EventCamera("clean", size=(2, 1), theta=0.02, sigma=0.0, intensity="srgb")
    plain = EventCamera("clean", size=(2, 1), theta=0.02, sigma=0.0)
    srgb.step(0, np.full((1, 2), 255, np.uint8)), plain.step(0, np.ones((1, 2)))
    assert equal(srgb.step(1000, codes), plain.step(1000, linear))


@pytest.mark.parametrize(
    ("frames", "message"),
    [
        (None, "NoneType, expected a sequence"),
        ([None], "one is NoneType"),
        (["ab"], "one is str"),
        ([np.ones((48, 64))], "one is ndarray"),
        ([(0,)], "one is tuple, expected"),
        ([(0, np.ones((48, 64)), None, 3)], "one is tuple, expected"),
    ],
)
def test_what_is_no_sequence_of_frames_is_refused(frames, message):
    with pytest.raises(DataError, match=f"^frames: {message}"):
        EventCamera("clean", size=(64, 48)).run(frames)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda image: image.astype(np.uint8), "uint8.*expected float.*intensity='uint8'"),
        (lambda image: image.astype(np.int64), "int64"),
        (lambda image: image.astype(complex), "complex"),
        (lambda image: image[:-1], r"\(22, 37\).*\(23, 37\)"),
        (lambda image: np.stack([image] * 3, -1), r"\(23, 37, 3\)"),
        (lambda image: np.where(image == image[3, 4], np.nan, image), "NaN"),
        (lambda image: -image, "-1.4"),
        (lambda image: image * np.float32(np.inf), "inf"),
        (lambda image: "no image", "shape"),
    ],
)
def test_images_that_cannot_be_meant_are_refused_and_leave_the_camera_alone(change, message, clip):
    sensor, expected = camera(), camera()
    for frame in clip[:2]:
        sensor.step(*frame), expected.step(*frame)
    with pytest.raises(DataError, match=message) as caught:
        sensor.step(clip[2].t_us, change(clip[2].luminance))
    assert "\n" not in str(caught.value)
    assert equal(sensor.step(*clip[2]), expected.step(*clip[2]))


@pytest.mark.parametrize("t_us", [-1.0, 300, float("nan"), float("inf"), "soon", None, 2.0**60])
def test_times_that_cannot_be_meant_are_refused(t_us, clip):
    sensor = camera()
    sensor.step(300, clip[0].luminance)
    with pytest.raises(DataError, match="time"):
        sensor.step(t_us, clip[1].luminance)


def test_masks_that_cannot_be_meant_are_refused(clip):
    with pytest.raises(DataError, match="bodies"):
        camera().step(0, clip[0].luminance, clip[0].bodies.astype(np.int64))
    with pytest.raises(DataError, match="bodies hold 77, expected 0 to 4, or 255 for none"):
        camera().step(0, clip[0].luminance, np.full_like(clip[0].bodies, 77))


def test_a_threshold_for_both_polarities_replaces_those_of_the_preset():
    sensor = camera(preset="davis346-bright", theta=0.4, sigma=0.0)
    assert (sensor.theta_on == 0.4).all() and (sensor.theta_off == 0.4).all()
    sensor = camera(preset="davis346-bright", theta=0.4, theta_off=0.3, sigma=0.0)
    assert (sensor.theta_on == 0.4).all() and (sensor.theta_off == 0.3).all()


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        (
            {"preset": "davis"},
            "davis346, davis346-bright, davis346-dim, dvxplorer, dvxplorer-lite, prophesee-like, clean, noisy",
        ),
        ({"thetta": 0.1}, "thetta.*theta, sigma"),
        ({"theta": 0.0}, "theta: 0 is out of range"),
        ({"theta": float("nan")}, "theta"),
        ({"theta": "high"}, "theta: 'high'"),
        ({"theta": True}, "theta"),
        ({"theta": None}, "theta"),
        ({"sigma": np.ones((HEIGHT, WIDTH))}, "sigma.*expected a number"),
        ({"theta_on": np.ones((WIDTH, HEIGHT))}, r"theta_on.*\(37, 23\).*\(23, 37\)"),
        ({"theta_on": np.zeros((HEIGHT, WIDTH))}, "theta_on: 0 is out of range"),
        ({"refractory_us": -1}, "refractory_us"),
        ({"noise_map": np.ones((HEIGHT, WIDTH))}, r"noise_map.*\(2, 23, 37\)"),
        ({"noise_map": 1.0}, r"noise_map.*\(2, 23, 37\)"),
        ({"mode": "v2e", "hot_share": 0.1}, "hot_share: mode 'v2e' has none"),
        ({"surround_pixels": 2.0}, "surround_pixels: mode 'accurate' has none"),
        ({"mode": "v2e", "adaptive_us": None}, "adaptive_us"),
        ({"photoreceptor_noise": 0.1, "cutoff_hz": 0}, "set cutoff_hz"),
        ({"mode": "fast"}, "accurate, v2e"),
        ({"intensity": "log"}, "linear, uint8, srgb"),
        ({"seed": -1}, "seed"),
        ({"seed": 0.5}, "seed"),
        ({"size": (346,)}, "size"),
        ({"size": (0, 10)}, "width"),
        ({"threads": 0}, "threads"),
    ],
)
def test_wrong_parameters_are_named(parameters, message):
    arguments = {"preset": "davis346", "size": (WIDTH, HEIGHT)} | parameters
    with pytest.raises(ConfigError, match=message) as caught:
        EventCamera(**arguments)
    assert "\n" not in str(caught.value)


def test_maps_are_taken_as_they_are(clip):
    theta = np.random.default_rng(5).uniform(0.1, 0.4, (HEIGHT, WIDTH))
    sensor = camera(theta_on=theta, theta_off=0.3, sigma=0.0)
    np.testing.assert_array_equal(sensor.theta_on, theta)
    np.testing.assert_array_equal(sensor.theta_off, 0.3)


def test_a_samples_camera_follows_its_parameters():
    config = evslip.load_config("demo", {"sensor.theta": 0.3, "sensor.preset": "clean", "camera.width": 40})
    params = evslip.draw(config, 3)
    sensor = camera_for(params)
    assert sensor.shape == (260, 40)
    assert sensor.model.theta == 0.3
    assert sensor.model.cutoff_hz == 0
    assert sensor.seed == seeds.integer(params.seed, "train", 3, "pixels")


def test_no_frames_no_events():
    assert camera().run([]).count == 0


def test_reading_events_needs_no_compiler():
    code = "import sys, evslip.events.stream, evslip.events; sys.exit('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_frames_between_which_noise_alone_would_fill_the_memory_are_refused():
    camera, image = EventCamera("noisy", size=(64, 48)), np.full((48, 64), 0.5)
    camera.step(0, image)
    with pytest.raises(DataError, match="million noise events since the frame at 0 us"):
        camera.step(1e15, image)
    assert camera.step(1e5, image).count > 0


def test_with_much_noise_fewer_frames_are_worked_on_at_once(monkeypatch):
    whole = EventCamera("noisy", size=(64, 48)).run(noise_alone())
    per_frame = EventCamera("noisy", size=(64, 48)).model.noise_hz(64 * 48) * 0.01
    monkeypatch.setattr("evslip.events.camera.MOST_NOISE", 2.5 * per_frame)
    taken, process = [], FrameProcessor.process

    def counted(self, buffer):
        taken.append(buffer.count)
        return process(self, buffer)

    monkeypatch.setattr(FrameProcessor, "process", counted)
    assert EventCamera("noisy", size=(64, 48)).run(noise_alone()) == whole
    assert sum(taken) == 20 and max(taken) == 2


def noise_alone():
    return ((10_000 * number, np.full((48, 64), 0.5)) for number in range(21))


def test_noise_of_the_photoreceptor_that_never_ends_is_refused():
    camera = EventCamera("clean", size=(640, 480), cutoff_hz=1e6, photoreceptor_noise=1.0)
    camera.step(0, np.full((480, 640), 0.5))
    with pytest.raises(DataError, match="million noise events"):
        camera.step(5000, np.full((480, 640), 0.5))
