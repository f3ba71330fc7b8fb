"""A watertight mesh from a file."""

from typing import Any

from evslip.errors import ConfigError
from evslip.shapes.mesh_file import load_mesh
from evslip.shapes.shape import Shape
from evslip.shapes.surface import Surface, box_uv, corner_normals


class MeshShape(Shape):
    def __init__(self, spec: Any):
        super().__init__(spec)
        if spec.mesh is None:
            raise ConfigError('object.mesh: is missing; object.shape = "mesh" needs the path of a mesh file')
        self._file = load_mesh(spec.mesh)
        low, high = self._file.vertices.min(axis=0), self._file.vertices.max(axis=0)
        self.vertices = (self._file.vertices - (low + high) / 2) * (2 * self.half_m / (high - low))

    def surface(self) -> Surface:
        """With the file's own texture coordinates, or else those of a cuboid around it."""
        faces, uv = self._file.faces, self._file.uv
        uv = box_uv(self.vertices, faces) if uv is None else uv
        return Surface(self.vertices, faces, uv, corner_normals(self.vertices, faces))
