"""The kinds of object. A new one is a class in a file of its own and one line in SHAPES."""

from functools import lru_cache
from importlib import import_module
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from evslip.scene.shapes.shape import Shape
    from evslip.scene.shapes.surface import Surface

SHAPES = {
    "cuboid": "evslip.scene.shapes.cuboid:Cuboid",
    "cylinder": "evslip.scene.shapes.cylinder:Cylinder",
    "mesh": "evslip.scene.shapes.mesh:MeshShape",
}
"""Name -> module:class. A shape is made from the object's section of the parameters."""


class HasObject(Protocol):
    """A sample's parameters, as far as shapes know of them."""

    @property
    def object(self) -> Any:
        """The section of the object."""


def shape_of(params: HasObject) -> "Shape":
    """The object's shape. Raises ConfigError for a mesh that cannot be used."""
    return shape_of_spec(params.object)


def surface_of(params: HasObject) -> "Surface":
    """Surface of the object, as triangles in its frame. Raises ConfigError for a mesh that cannot be used."""
    return shape_of(params).surface()


def shape_class(spec: Any) -> "type[Shape]":
    """The class of the shape that the object's section of the parameters names."""
    module, _, name = SHAPES[spec.shape].partition(":")
    return getattr(import_module(module), name)


def shape_of_spec(spec: Any) -> "Shape":
    """The shape of an object's section of the parameters; raises as `shape_of`."""
    return _made(spec, stamp_of_shape(spec))


def stamp_of_shape(spec: Any) -> tuple[int, int] | None:
    """Stamp of the shape's file: what is kept for a section holds while it is the same. None: the shape has no file."""
    return shape_class(spec).stamp(spec)


@lru_cache(maxsize=4)
def _made(spec: Any, stamp: tuple[int, int] | None) -> "Shape":
    del stamp
    return shape_class(spec)(spec)
