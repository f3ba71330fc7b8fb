"""Parameters to trajectory: plan the motion, run the physics."""

from evslip.config.params import Params
from evslip.physics import scene_model
from evslip.physics.motion.servo_plan import plan
from evslip.physics.stepping import SteppedSimulation
from evslip.physics.trajectory import Trajectory
from evslip.physics.vibration.displacement import with_vibration
from evslip.utils.errors import ConfigError


def check_reach(params: Params) -> None:
    """Raise PlanRejected if the robot cannot do the motion of these parameters."""
    plan(params, scene_model.build(params))


def simulate(params: Params) -> Trajectory:
    """Run the pick-and-place of one sample at 1 kHz; bit-identical for equal parameters on one machine.

    Raises ConfigError for what are no parameters, PlanRejected for a motion that the robot cannot do, and GraspFailed
    when the physics diverges.
    """
    if not isinstance(params, Params):
        raise ConfigError(f"params: {type(params).__name__}, expected Params, as draw gives them")
    simulation = SteppedSimulation(params, trembling=False)
    simulation.advance(simulation.end_us)
    return with_vibration(simulation.trajectory())
