"""A hand that holds an object while someone pulls at it: the loop that goes on in real time."""

import queue
import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from evslip.control.candidates import Candidates
from evslip.control.controllers import make_controller
from evslip.control.controllers.constant import Constant
from evslip.control.controllers.controller import NO_ANSWER, Controller, Setup
from evslip.control.controllers.slip_signal import MODEL, SlipSignal
from evslip.rendering.camera import hand_camera
from evslip.rendering.poses import matrices
from evslip.utils.console import console
from evslip.utils.errors import EvslipError
from evslip.view.play.messages import Message
from evslip.view.play.settings import CONTROLLER, MANUAL, checked

STEP_US = 20_000
SHOWN_US = 40_000
"""Simulated time between two messages."""
PULL_N, MOST_PULL_N = 0.005, 2.0
"""Force of a pull a pixel, and at most."""
WET, WEIGHT_KG, PUSH_N, PUSH_US = 0.5, 0.05, 1.0, 150_000
"""Buttons: factor of the friction, mass that is put on, and a push along the image for a time."""
BEHIND_S = 0.25
"""Where the simulation is later than the clock by so much, time goes slower."""
LOST_S = 1.0
"""Pause after an object is lost."""


class World:
    """Plays episodes one after the other and publishes what is seen in them. Commands may come from any thread."""

    def __init__(self, config: str = "play", controller: str = "detector", model: str = MODEL, split: str = "train"):
        """config: preset or file; controller: of `settings.SETTINGS`; model: detector whose answers are shown, and
        which the controllers use. Raises ConfigError, DataError."""
        self._candidates, self._model = Candidates(config, split=split), model
        self._controller_name = CONTROLLER.checked("controller", controller)
        self._commands: queue.SimpleQueue[dict[str, Any]] = queue.SimpleQueue()
        self._latest: tuple[int, bytes] = (0, b"")
        self._paused, self._is_told, self.viewers = False, True, 0
        self._begin(0)

    def command(self, given: dict[str, Any]) -> None:
        """Take what a page sends, see `checked`. Raises ConfigError for what makes no sense."""
        self._commands.put(checked(given))

    def since(self, sequence: int) -> tuple[int, bytes] | None:
        """The latest message and its number, if it is another one than the one with this number."""
        latest = self._latest
        return None if latest[0] == sequence else latest

    def run(self, stop: threading.Event) -> None:
        """Go on in real time until `stop` is set; wait while nobody looks."""
        begun_s, begun_us = time.monotonic(), self._episode.t_us
        while not stop.is_set():
            if self.viewers == 0 or self._paused:
                self._guarded(self._obey)
                if not self._is_told:
                    self._publish()
                stop.wait(0.05)
                begun_s, begun_us = time.monotonic(), self._episode.t_us
                continue
            before = self._episode
            self._guarded(self.step)
            if self._episode.is_lost:
                stop.wait(LOST_S)
            if self._episode is not before:
                begun_s, begun_us = time.monotonic(), self._episode.t_us
            ahead_s = (self._episode.t_us - begun_us) / 1e6 - (time.monotonic() - begun_s)
            if ahead_s > 0:
                stop.wait(ahead_s)
            elif ahead_s < -BEHIND_S:
                begun_s, begun_us = time.monotonic(), self._episode.t_us

    def _guarded(self, act: Callable[[], None]) -> None:
        """Do something, or say what was wrong and go on with the next object: such as physics that diverge where the
        pull is too hard."""
        params = self._episode.params
        try:
            act()
        except EvslipError as error:
            console.print(f"{params.split}/{params.index}: {error}", style="red", soft_wrap=True)
            self._do_press("next")

    def step(self) -> None:
        """A step of control; at the end of an episode, the next one's begin."""
        self._obey()
        episode = self._episode
        if episode.is_over:
            self._begin(episode.params.index + 1)
            return
        self._pull()
        force_n = (
            self._force_n if self._controller_name == MANUAL else self._controller.step(episode.events, episode.senses)
        )
        episode.advance(episode.t_us + STEP_US, force_n)
        self._asked.clear()
        if self._controller_name != MANUAL:
            self._force_n = episode.target_n
        # What a detector that does not control answers is shown as well.
        own = None if self._controller_name == MANUAL else self._controller.answer
        self._answer = self._signal.push(episode.events, episode.t_us) if own is None else own
        self._shown.take(episode, self._answer, self._signal.has_speeds)
        if episode.t_us - self._shown.since_us >= SHOWN_US or episode.is_over:
            self._publish()

    def _begin(self, index: int) -> None:
        """The next object that can be held, from an index on."""
        self._episode = episode = self._candidates.playable(index, STEP_US, sees=True)
        self._params = episode.params
        self._factors, self._pulled, self._pushed_until = {"lamp": 1.0, "room": 1.0}, np.zeros(2), -1
        self._push, self._force_n = np.zeros(2), episode.target_n
        self._answer, self._asked = NO_ANSWER, dict[str, float]()
        self._control(self._controller_name)
        self._shown = Message(episode.t_us)

    def _setup(self) -> Setup:
        episode = self._episode
        own = self._candidates.size, STEP_US, episode.t_us, episode.target_n, *episode.allowed_n
        return Setup(*own, lambda: episode.truth)

    def _control(self, name: str) -> None:
        uses_model = name.startswith("detector")
        self._controller_name = name
        self._controller: Controller = (
            Constant() if name == MANUAL else make_controller(name, **({"model": self._model} if uses_model else {}))
        )
        self._controller.reset(self._setup())
        # Anew, too: it has not seen the events of the time in which a controller had a detector of its own.
        self._signal = SlipSignal(self._model, self._setup(), None, 1)

    def _obey(self) -> None:
        """Do what was asked for since the last step."""
        while True:
            try:
                given = self._commands.get_nowait()
            except queue.Empty:
                return
            self._is_told = False
            for name, value in given.items():
                getattr(self, f"_do_{name}")(value)

    def _do_set(self, values: dict[str, Any]) -> None:
        for name, value in values.items():
            if name == "controller":
                self._control(value)
            elif name == "force_n":
                self._force_n = value
            elif name == "mass_g":
                self._disturb(mass_kg=value / 1e3)
            elif name == "friction":
                self._disturb(friction=value)
            elif name != "sensor":
                self._factors[name] = value
        if values.keys() & {"lamp", "room", "sensor"}:
            self._look_anew(values.get("sensor", self._params.sensor.preset))

    def _disturb(self, mass_kg: float | None = None, friction: float | None = None) -> None:
        self._episode.simulation.disturb(mass_kg, friction)
        given = {"mass_kg": mass_kg, "friction": friction}
        self._asked |= {name: value for name, value in given.items() if value is not None}

    def _condition(self, name: str) -> float:
        """Mass or friction as it was asked for last: the simulation tells of it after its next sample only."""
        return self._asked[name] if name in self._asked else float(getattr(self._episode.simulation, name))

    def _look_anew(self, sensor: str) -> None:
        first, now = self._episode.params, self._params
        changes = {
            "light": {"luminance_cd_m2": self._factors["lamp"] * first.light.luminance_cd_m2},
            "background": {"luminance_cd_m2": self._factors["room"] * first.background.luminance_cd_m2},
            "sensor": {"preset": sensor},
        }
        sections = {name: getattr(now, name).model_copy(update=change) for name, change in changes.items()}
        self._params = now.model_copy(update=sections)
        self._episode.look_anew(self._params)

    def _do_pull(self, way_px: tuple[float, float]) -> None:
        self._pulled = PULL_N * np.array(way_px)

    def _do_press(self, button: str) -> None:
        if button == "wet":
            self._disturb(friction=WET * self._condition("friction"))
        elif button == "weight":
            self._disturb(mass_kg=self._condition("mass_kg") + WEIGHT_KG)
        elif button == "next":
            self._begin(self._episode.params.index + 1)
        else:
            self._push = PUSH_N * np.array([{"left": -1.0, "right": 1.0}.get(button, 0.0), float(button == "down")])
            self._pushed_until = self._episode.t_us + PUSH_US

    def _do_pause(self, paused: bool) -> None:
        self._paused = paused

    def _pull(self) -> None:
        """Set the force on the object: of the pointer, and of a push."""
        episode = self._episode
        force = self._pulled + (self._push if episode.t_us < self._pushed_until else 0.0)
        size = float(np.hypot(*force))
        force = force * min(1.0, MOST_PULL_N / max(size, 1e-9))
        hand = episode.simulation.trajectory(episode.t_us).gripper_pose[-1]
        axes = matrices(hand[3:].astype(float)) @ hand_camera(self._params).rotation
        episode.simulation.disturb(push_n=axes[:, 0] * force[0] - axes[:, 1] * force[1])

    def _publish(self) -> None:
        self._latest = self._latest[0] + 1, self._shown.packed(self._episode, self._state())
        self._shown, self._is_told = Message(self._episode.t_us), True

    def _state(self) -> dict[str, Any]:
        episode = self._episode
        return {
            "settings": {
                "controller": self._controller_name,
                "force_n": round(self._force_n, 3),
                "mass_g": round(1e3 * self._condition("mass_kg"), 1),
                "friction": round(self._condition("friction"), 4),
                **self._factors,
                "sensor": self._params.sensor.preset,
            },
            "title": f"{episode.params.split}/{episode.params.index}: {episode.params.object.shape}, "
            f"{episode.params.motion.kind}",
            "paused": self._paused,
            "lost": episode.is_lost,
            "alarm": self._answer.alarm,
        }
