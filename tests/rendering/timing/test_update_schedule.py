import importlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy.ndimage import binary_erosion

from evslip.config.loading import load_config
from evslip.draws.draw import draw
from evslip.events.frame import BACKGROUND, OBJECT, SURFACE
from evslip.rendering import exposure_scale, frame_times, make_renderer, render
from evslip.rendering.camera import hand_camera
from evslip.rendering.poses import ScenePoses
from evslip.rendering.raycast.setting import make_lamp
from evslip.rendering.timing.cell_motion import LAG, LIGHT_LAG, STEADY_PX, cell_motion, divide
from evslip.rendering.timing.foreground import foreground_motion
from evslip.rendering.timing.schedule import object_motion
from evslip.rendering.timing.update_schedule import plan_cells
from made_up import carried, still, turning

render_module = importlib.import_module("evslip.rendering")  # as an attribute of evslip, that name is the function
SPAN = (0, 1_000_000)


@pytest.fixture(autouse=True)
def whole_span(monkeypatch):
    """Made-up trajectories carry no grip, so all of them counts as recorded."""
    monkeypatch.setattr(render_module, "recorded_span", lambda traj: SPAN)


def sample(**scene):
    return draw(load_config("simple", {key.replace("__", "."): value for key, value in scene.items()}), 0)


@settings(max_examples=60)
@given(
    hnp.arrays(float, st.tuples(st.integers(0, 60), st.just(1), st.just(2)), elements=st.floats(0, 1)),
    st.data(),
)
def test_blends_are_parabolas_of_what_the_slots_still_hold(motion, data):
    changes = data.draw(hnp.arrays(bool, len(motion), elements=st.sampled_from([False] * 5 + [True])))
    plan = plan_cells(motion, changes, 0.5)
    place = np.concatenate([np.zeros((1, 1, 2)), np.cumsum(motion + 1e-6, 0)])[:, 0]
    held = np.full((LAG + 2, 2), np.nan)
    for k in range(len(place) + LAG):
        if k < len(place):
            for cell in range(2):
                if plan.slots[k, 0, cell] >= 0:
                    held[plan.slots[k, 0, cell], cell] = place[k, cell]
        done = k - LAG
        for cell in range(2 if done >= 0 else 0):
            before, earlier, after = (held[part[done, 0, cell], cell] for part in plan[1:4])
            share, bend = plan.shares[done, 0, cell]
            at = place[done, cell]
            assert before <= at <= after
            assert before + share * (after - before) + bend * (earlier - before) == pytest.approx(at, abs=1e-5)
            if plan.slots[done, 0, cell] >= 0:
                assert (share, bend, before) == (0, 0, at)
    drawn = plan.slots[:, 0] >= 0
    assert drawn[0].all() and drawn[-1].all()
    assert drawn[:-1][changes].all() and drawn[1:][changes].all()
    for cell in range(2):
        frames = np.flatnonzero(drawn[:, cell])
        assert np.all(np.diff(frames) <= LAG)
        # The farthest between two drawings is half a step more than the limit.
        steps = np.diff(place[frames, cell])
        assert np.all((np.diff(frames) == 1) | (steps <= 0.5 + 0.5 * motion.max(initial=0.0) + 1e-3))


def test_a_parabola_between_even_drawings_is_exact():
    plan = plan_cells(np.full((31, 1, 1), 0.15), np.zeros(31, bool), 0.5)
    drawn = np.flatnonzero(plan.slots[:, 0, 0] >= 0)
    steady = slice(drawn[1], drawn[-2])
    values, found = np.arange(32.0) ** 2, []
    for k in range(32)[steady]:
        before = drawn[drawn <= k][-1]
        after, earlier = drawn[drawn >= k][0], drawn[drawn < before][-1]
        share, bend = plan.shares[k, 0, 0]
        found.append((1 - share - bend) * values[before] + share * values[after] + bend * values[earlier])
    assert found == pytest.approx(values[steady], rel=1e-5)
    assert len(drawn) < 16


@pytest.mark.parametrize("scene", [{}, {"camera__k1": -0.2}, {"light__luminance_cd_m2": 0.0}])
def test_a_film_shows_what_single_frames_show(scene):
    traj = turning(sample(surface__texture="cardboard-0", **scene))
    camera = hand_camera(traj.params, (173, 130))
    times = frame_times(traj, *SPAN, camera=camera)
    poses = ScenePoses(traj, camera, times)
    sequence, single = (make_renderer(None, traj, camera, SPAN) for _ in range(2))
    scale = exposure_scale(single, traj, camera, 0)
    errors, steps, changed, last = [], [], [], None
    frames = list(sequence.draw_sequence(poses, scale))
    assert len(frames) == len(times)
    for k, (luminance, bodies) in enumerate(frames):
        expected, known = single.draw(poses, k, scale)
        errors.append(np.abs(np.log((luminance + 1e-3) / (expected + 1e-3))))
        changed.append(np.mean(bodies != known))
        if last is not None:
            steps.append(np.abs(np.log((expected + 1e-3) / (last + 1e-3))))
        last = expected
    assert errors[0].max() == 0 and errors[-1].max() == 0
    assert 0 < np.mean(errors) < 0.2 * np.mean(steps)
    assert np.percentile(errors, 99.9) < np.percentile(steps, 99.9) / 2
    assert np.max(changed) < 0.01  # along the horizon


def test_cells_move_at_least_as_far_as_what_they_show():
    traj = turning(sample())
    camera = hand_camera(traj.params, (173, 130))
    times = frame_times(traj, 0, 10**6, camera=camera)
    lamp = make_lamp(traj.params)
    (motion, light), cells = (
        cell_motion(ScenePoses(traj, camera, times), camera, traj.params, lamp, True),
        divide(130, 173),
    )
    assert np.all(light <= motion)
    assert motion.shape == (len(times) - 1, cells.rows, cells.columns)
    rows, columns = np.mgrid[:130, :173]
    for k in range(5, len(times) - 1, 9):
        (frame,) = render(traj, times_us=times[k : k + 1], size=(173, 130), outputs=("motion",))
        assert frame.motion is not None
        way = np.hypot(*np.moveaxis(frame.motion, -1, 0)) * (times[k + 1] - times[k]) * 1e-6
        behind = (frame.bodies == SURFACE) | (frame.bodies == BACKGROUND)
        allowed = motion[k, rows // cells.height, columns // cells.width]
        # The motion is shared out evenly among LAG steps, over which it grows here.
        assert np.all(way[behind] < 1.25 * allowed[behind] + 0.02)


def test_cells_around_an_object_that_slides_are_drawn_anew_and_so_is_its_shadow():
    traj = still(sample(light__polar_deg=40.0, light__azimuth_deg=200.0))
    traj.object_pose[:, 2] += np.linspace(0.02, -0.02, len(traj.t_us))
    camera = hand_camera(traj.params)
    times = np.arange(0, 10**6, 20_000)
    motion, _ = cell_motion(ScenePoses(traj, camera, times), camera, traj.params, make_lamp(traj.params), False)
    dark = traj.params.model_copy(update={"light": traj.params.light.model_copy(update={"luminance_cd_m2": 0.0})})
    unlit, _ = cell_motion(ScenePoses(traj, camera, times), camera, dark, make_lamp(dark), False)
    first, second = (next(render(traj, times_us=times[k : k + 1])) for k in (10, 11))
    changed = np.abs(np.log(second.luminance / first.luminance)) > 1e-3
    behind = (first.bodies <= SURFACE) & (second.bodies <= SURFACE)
    cells = divide(camera.height, camera.width)
    at = np.nonzero(changed & behind)
    assert len(at[0]) > 50
    assert np.all(motion[10, at[0] // cells.height, at[1] // cells.width] > 0)
    assert motion[10].min() == 0  # elsewhere nothing moves
    assert np.sum(motion[10] > 0) > np.sum(unlit[10] > 0) > 0


@pytest.mark.parametrize("radius_m", [1.0, 0.1])
def test_what_is_held_is_drawn_seldom_and_shows_what_single_frames_show(radius_m, monkeypatch):
    traj = carried(sample(light__polar_deg=40.0, light__radius_m=radius_m))
    camera = hand_camera(traj.params, (173, 130))
    times = frame_times(traj, *SPAN, camera=camera)
    poses = ScenePoses(traj, camera, times)
    sequence, single = (make_renderer(None, traj, camera, SPAN) for _ in range(2))
    drawn, draw_foreground = [], sequence._draw_foreground
    monkeypatch.setattr(sequence, "_draw_foreground", lambda *args: (drawn.append(args), draw_foreground(*args)))
    errors, steps, last = [], [], None
    for k, (luminance, bodies) in enumerate(sequence.draw_sequence(poses, 1.0)):
        expected, known = single.draw(poses, k)
        assert np.mean(bodies != known) < 0.01
        held = binary_erosion(known >= OBJECT, iterations=3)  # without what the backdrop shines into
        errors.append(np.abs(np.log((luminance + 1e-3) / (expected + 1e-3)))[held])
        if last is not None:
            steps.append(np.abs(np.log((expected + 1e-3) / (last + 1e-3)))[held])
        last = expected
    assert len(times) / LIGHT_LAG <= len(drawn) < 0.6 * len(times)
    errors, steps = np.concatenate(errors), np.concatenate(steps)
    assert 0 < errors.mean() < 0.02 * steps.mean()
    assert np.percentile(errors, 99.9) < np.percentile(steps, 99.9) / 50


def test_an_object_that_slips_is_drawn_whenever_its_edges_have_moved():
    traj = still(sample())
    half = np.radians(2.0) * np.linspace(0, 1, len(traj.t_us)) ** 2
    traj.object_pose[:, 3], traj.object_pose[:, 5] = np.cos(half), np.sin(half)
    camera = hand_camera(traj.params, (173, 130))
    poses = ScenePoses(traj, camera, np.arange(0, SPAN[1], 10_000))
    moved = object_motion(poses, camera, traj.params)
    motion = foreground_motion(poses, camera, traj.params, make_lamp(traj.params))
    drawn = plan_cells(motion, np.zeros(len(motion), bool), 0.5).slots[:, 0, 0] >= 0
    assert drawn[1:-1][moved[:-1] > STEADY_PX].all()
    way = np.concatenate([[0.0], np.cumsum(moved)])[drawn]
    gaps = np.diff(np.flatnonzero(drawn)) > 1
    assert gaps.any() and np.diff(way)[gaps].max() <= 1.5 * STEADY_PX


def test_a_plan_of_one_frame_draws_all_of_it():
    cells = divide(260, 346)
    plan = plan_cells(np.zeros((0, cells.rows, cells.columns)), np.zeros(0, bool), 0.5)
    assert np.all(plan.slots == 0) and np.all(plan.shares == 0)
    assert cells.rows * cells.height >= 260 > (cells.rows - 1) * cells.height
    assert cells.columns * cells.width >= 346 > (cells.columns - 1) * cells.width
