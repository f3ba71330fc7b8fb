"""Dimensions, mass and centre of mass that drawn ones come to."""

from typing import Any

from evslip.scene.shapes import shape_class, shape_of_spec
from evslip.scene.shapes.shape import SIDES
from evslip.utils.errors import ConfigError


def resolve_object(spec: Any) -> Any:
    """The object's section of the parameters with the dimensions that its shape comes to, and its density replaced by a
    mass. Raises ConfigError for a mesh that cannot be used, sizes and masses out of range, and a centre of mass that no
    filling of the object has, or with which it would fall over."""
    drawn = (spec.width_m, spec.depth_m, spec.height_m)
    # Of computed sides a nanometre beyond a limit is none. Drawn ones stay: their last bits tell the splits apart.
    settled = (side if side in drawn else round(side, 9) for side in shape_class(spec).sides(spec))
    sides: dict[str, float] = dict(zip(SIDES, settled, strict=True))
    _check(spec, f"object.{'mesh' if spec.shape == 'mesh' else 'shape'}", sides)
    spec = spec.model_copy(update=sides)
    shape = shape_of_spec(spec)
    if spec.density_kg_m3 is not None:
        mass = {"mass_kg": spec.density_kg_m3 * shape.volume_moments().volume_m3}
        _check(spec, "object.density_kg_m3", mass)
        spec = spec.model_copy(update={**mass, "density_kg_m3": None})
    centre = shape.centre_of_mass_m()
    millimetres = ", ".join(f"{1e3 * value:.1f}" for value in centre)
    if not shape.inside(centre):
        half = ", ".join(f"{1e3 * value:.1f}" for value in shape.half_m)
        raise ConfigError(
            f"object.com_x_m, com_y_m, com_z_m: put the centre of mass at ({millimetres}) mm from the object's middle, "
            f"outside the object, which reaches to +-({half}) mm"
        )
    if not shape.stands(centre):
        raise ConfigError(
            f"object.com_x_m, com_y_m: the object falls over: its centre of mass, ({millimetres}) mm from its "
            "middle, is not above its base; expected an object that stands, with z up"
        )
    return spec


def _check(spec: Any, source: str, values: dict[str, float]) -> None:
    for name, value in values.items():
        limits = next(m for m in type(spec).model_fields[name].metadata if hasattr(m, "high"))
        if not limits.low <= value <= limits.high:
            reason = f"; {limits.reason}" if limits.reason else ""
            raise ConfigError(
                f"{source}: gives object.{name} {value:.4g}, expected {limits.low:g} to {limits.high:g}{reason}"
            )
