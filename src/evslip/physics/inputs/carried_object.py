"""The object in the model, whose mass, friction and load may change from step to step."""

from copy import copy

import mujoco

from evslip.physics.inputs.disturbance import Conditions
from evslip.physics.scene_model import OBJECT


class CarriedObject:
    """The object of one model. What stays constant is never written."""

    def __init__(self, model: mujoco.MjModel):
        self._model, self.body = model, model.body(OBJECT).id
        self._mass_kg, self._friction = float(model.body_mass[self.body]), float(model.pair_friction[0, 0])
        self._inertia = model.body_inertia[self.body].copy()
        self._rest_kg = model.body_subtreemass[0] - self._mass_kg
        self._now = self._mass_kg, self._friction

    def moved_to(self, model: mujoco.MjModel) -> "CarriedObject":
        """This object, as it is now, in a copy of its model."""
        moved = copy(self)
        moved._model = model
        return moved

    def apply(self, data: mujoco.MjData, conditions: Conditions, step: int) -> None:
        mass_kg, friction = now = float(conditions.mass_kg[step]), float(conditions.friction[step])
        if now != self._now:
            self._now = now
            model = self._model
            model.body_mass[self.body] = model.body_subtreemass[self.body] = mass_kg
            model.body_subtreemass[0] = self._rest_kg + mass_kg
            model.body_inertia[self.body] = self._inertia * (mass_kg / self._mass_kg)
            # The inverse masses stay as they were: MuJoCo makes the pads' compliance of them, which does not depend on
            # the object.
            model.pair_friction[:, :2] = friction
        push = conditions.push_n[step]
        if push.any() or data.xfrc_applied[self.body].any():
            data.xfrc_applied[self.body, :3] = push
