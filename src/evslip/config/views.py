"""The cameras of a sample that has several."""

from typing import Any

from evslip.config.config import Config
from evslip.config.params import Params
from evslip.config.sections.camera import CAMERAS
from evslip.utils.errors import ConfigError


def camera_names(params: Params | Config) -> tuple[str, ...]:
    """Names of the cameras; none where there is but one, which has no name, and where one of them is chosen."""
    chosen = isinstance(params, Params) and params.seen_by
    return () if chosen else tuple(name for name in CAMERAS if getattr(params.camera, name) is not None)


def seen_by(params: Params, camera: str) -> Params:
    """Parameters of a sample with the section camera that one of its cameras has. The tables of both stay in it, whole:
    what one camera looks through, the other sees, too."""
    if camera not in CAMERAS or getattr(params.camera, camera) is None:
        raise ConfigError(f"camera: {camera!r} is unknown; {_names(params)}")
    shared = params.camera
    views: dict[str, Any] = {name: _whole(shared, getattr(shared, name)) for name in CAMERAS}
    own = shared.model_copy(update=dict(views[camera]) | views)
    return params.model_copy(update={"camera": own, "seen_by": camera})


def each_view(params: Params) -> tuple[Params, ...]:
    """Parameters of a sample as each of its cameras has them; of one camera as they are."""
    return tuple(seen_by(params, name) for name in camera_names(params)) or (params,)


def one_camera(params: Params) -> None:
    """Raise ConfigError where a sample has several cameras and none is chosen."""
    if camera_names(params):
        raise ConfigError(f"camera: {_names(params)}, of which one has to be chosen")


def _names(params: Params) -> str:
    names = [name for name in CAMERAS if getattr(params.camera, name) is not None]
    return f"the sample has the cameras {', '.join(names)}" if names else "the sample has one camera, without a name"


def _whole(shared: Any, view: Any) -> Any:
    return view.model_copy(update={name: getattr(shared, name) for name, value in view if value is None})
