"""Every parameter of a sample.

The same fields serve twice: in a `Config` a field may hold a distribution, in `Params` it holds the value drawn.
"""

from typing import Annotated, Any, Generic

from pydantic import Field

from evslip.config.distributions import choices, extremes
from evslip.config.nuisances.clutter import ClutterSpec
from evslip.config.nuisances.disturbance import DisturbanceSpec
from evslip.config.nuisances.flicker import FlickerSpec
from evslip.config.nuisances.lens import LensSpec
from evslip.config.nuisances.passers import PassersSpec
from evslip.config.nuisances.vibration import VibrationSpec
from evslip.config.section import LATER, N, S, Section, wrong
from evslip.config.sections.camera import CAMERAS, CameraSpec
from evslip.config.sections.grip import GripSpec
from evslip.config.sections.light import LightSpec
from evslip.config.sections.motion import MotionSpec
from evslip.config.sections.object import ObjectSpec
from evslip.config.sections.readout import ReadoutSpec
from evslip.config.sections.render import RenderSpec
from evslip.config.sections.robot import RobotSpec
from evslip.config.sections.sensor import SensorSpec
from evslip.config.sections.slip import SlipSpec
from evslip.config.sections.surroundings import BackgroundSpec, SurfaceSpec

CAMERA_M = 1.0
"""The camera may be so far from the world's origin."""


class SampleSpec(Section, Generic[N, S]):
    """All of one sample."""

    object: ObjectSpec[N, S]
    grip: GripSpec[N, S]
    surface: SurfaceSpec[N, S]
    background: BackgroundSpec[N, S]
    clutter: Annotated[ClutterSpec[N, S], LATER] = Field(default={}, validate_default=True)
    passers: Annotated[PassersSpec[N, S], LATER] = Field(default={}, validate_default=True)
    light: LightSpec[N, S]
    flicker: Annotated[FlickerSpec[N, S], LATER] = Field(default={}, validate_default=True)
    robot: RobotSpec = RobotSpec()
    motion: MotionSpec[N, S]
    disturbance: Annotated[DisturbanceSpec[N, S], LATER] = Field(default={}, validate_default=True)
    camera: CameraSpec[N, S]
    lens: Annotated[LensSpec[N, S], LATER] = Field(default={}, validate_default=True)
    sensor: SensorSpec[N, S]
    readout: Annotated[ReadoutSpec[N, S], LATER] = Field(default={}, validate_default=True)
    vibration: Annotated[VibrationSpec[N, S], LATER] = Field(default={}, validate_default=True)
    render: RenderSpec[N, S]
    slip: SlipSpec[N, S] = Field(default={}, validate_default=True)

    def __reduce__(self) -> Any:
        """Pickled as JSON: the sections' classes are made of type variables, and have no names to be imported by."""
        return type(self).model_validate_json, (self.model_dump_json(),)

    def _check(self) -> None:
        if self.vibration.tremor_hz is not None and self.robot.kind == "cartesian":
            raise wrong("vibration.tremor_hz", "needs an arm whose joints tremble; a cartesian hand has none")
        if self.robot.gripper == "panda" and self.robot.kind not in ("panda", "cartesian"):
            raise wrong(
                "robot.gripper", "'panda' fits robot.kind = 'panda' or 'cartesian' alone; expected small or large"
            )
        self._check_passers()
        cameras: Any = (self.camera, self.camera.left, self.camera.right)
        mounts = [mount for camera in cameras if camera is not None for mount in choices(camera.mount)]
        if "robot" in mounts and not self.robot.is_file:
            raise wrong("camera.mount", "'robot' is where a robot's file puts it, and robot.kind names none")

    def _check_passers(self) -> None:
        passers: Any = self.passers
        around: Any = self.background.radius_m
        count, width, farthest = (extremes(one)[1] for one in (passers.count, passers.width_m, passers.distance_m))
        least, crosses = extremes(around)[0], count > 0 and "background" in choices(passers.crosses)
        most = least - CAMERA_M - width / 2
        if crosses and farthest > most:
            beyond = f"{farthest:g} puts bodies beyond the background, of background.radius_m {least:g}"
            raise wrong("passers.distance_m", f"{beyond}; expected at most {most:g}")


VIEWS = tuple(("camera", name) for name in CAMERAS)
"""Tables within a section."""
OPTIONAL = tuple(name for name, field in SampleSpec.model_fields.items() if LATER in field.metadata)
"""Sections that came later, and do nothing by default."""


def leaves(spec: SampleSpec) -> dict[str, Any]:
    """Every key of a sample, "section.name", and what it holds, in their order; of one of two cameras
    "camera.left.name"."""
    found = {}
    for section in SampleSpec.model_fields:
        for name, value in getattr(spec, section):
            if (section, name) in VIEWS:
                found |= {f"{section}.{name}.{key}": own for key, own in value or ()}
            else:
                found[f"{section}.{name}"] = value
    return found
