"""Object, arm and gripper on a GPU: the passes of the CPU, compiled for CUDA, a thread a pixel or a fragment.

Which pixels show them, and what all of them share, is found on the host.
"""

import numpy as np

from evslip.rendering.geometry.raster import Raster
from evslip.rendering.raycast.cuda_device import Device, cuda, reception_of, upload
from evslip.rendering.raycast.gripper import distance_of, open_fragments, shade_fragments
from evslip.rendering.raycast.setting import Lamp
from evslip.rendering.scratch import LANES, PART, RESULT, SCRATCH, ZERO, f32
from evslip.rendering.shading.box_shading import Cover, Face, FaceTextures, aim_at_face, shade_face, stand, texture_of
from evslip.rendering.shading.illumination import illuminate, lit_by, power_of
from evslip.rendering.shading.mesh_shading import SkinTexture, gather, leave_out, shade_skin
from evslip.rendering.shadows.casters import OBJECT_PART, Casters
from evslip.rendering.viewpoint import View


class CudaSolid:
    """`solid.draw_solid`; equal to it but for rounding."""

    def __init__(self, device: Device, height: int, width: int):
        self._device, self._scratch = device, np.zeros(SCRATCH, np.float32)
        self._image = cuda.device_array((height, width), np.float32)

    def __call__(
        self, out: np.ndarray, keep: np.ndarray, view: View, lamp: Lamp, ambient: np.ndarray, gloss: float,
        half: np.ndarray, textures: FaceTextures, casters: Casters, cover: Cover,
    ) -> None:  # fmt: skip
        """The arguments are those of `solid.draw_solid` without scratch."""
        rows = cover.rows[: cover.visible]
        top, bottom = int(rows[:, 0].min(initial=out.shape[0])), int(rows[:, 1].max(initial=0))
        if top >= bottom:
            return
        number = np.arange(top, bottom)[:, None]
        picture, kept = self._image[top:bottom], cuda.to_device(keep[top:bottom])
        picture.copy_to_device(np.zeros(picture.shape, np.float32))
        cells = self._device.keep("face", textures.cells)
        for k in range(cover.visible):
            face = stand(self._scratch, view, lamp, ambient, half, cover.faces[k], casters)
            # Spans of rows that a face does not reach are of an earlier frame.
            inside = (number >= cover.rows[k, 0]) & (number < cover.rows[k, 1])
            self._device.launch_in_shadow(
                _draw_face, (bottom - top) * -(-out.shape[1] // LANES), face.reception, casters,
                picture, top, out.shape[0], f32(1 / view.focal), power_of(lamp), f32(lamp.radius_m), f32(gloss),
                upload(face[:-2]), bool(face.shaded), cells,
                upload(texture_of(textures, cover.faces[k])), upload(cover.area[k, top:bottom]),
                upload(np.where(inside, cover.spans[k, top:bottom], 0)), kept,
            )  # fmt: skip
        out[top:bottom] += picture.copy_to_host()


@cuda.jit
def _draw_face(
    picture, top, height, pixel, power, radius, gloss, face, shaded, cells, levels, area, spans, keep,
    shadows, room, lists,
):  # fmt: skip
    S = cuda.shared.array(SCRATCH, np.float32)[cuda.threadIdx.x :]
    fetched = cuda.shared.array(LANES, np.uint64)[cuda.threadIdx.x :]
    S[PART] = f32(OBJECT_PART)
    width = picture.shape[1]
    across = (width + LANES - 1) // LANES
    plane, half_u, half_v, per_u, per_v, ambient, nodes = face
    reception = reception_of(shadows, lists[cuda.grid(1)])
    own = Face(plane, half_u, half_v, per_u, per_v, ambient, nodes, reception, shaded)
    for chunk in range(cuda.blockIdx.x, picture.shape[0] * across, cuda.gridDim.x):
        row, column = chunk // across, chunk % across * LANES + cuda.threadIdx.x
        if spans[row, 0] <= column < spans[row, 1] and keep[row, column] > ZERO:
            aim_at_face(S, area[row, column : column + 1], top + row, column, height, width, pixel)
            shade_face(S, 1, fetched, pixel, power, radius, gloss, own, cells, levels, room)
            picture[row, column] += f32(area[row, column]) * keep[row, column] * S[RESULT]


class CudaSkin:
    """`skin.draw_skin`; equal to it but for rounding."""

    def __init__(self, device: Device):
        self._device = device

    def __call__(
        self, out: np.ndarray, keep: np.ndarray, view: View, lamp: Lamp, ambient: np.ndarray, gloss: float,
        texture: SkinTexture, raster: Raster, count: int, casters: Casters, part: int, depth: float,
    ) -> None:  # fmt: skip
        """The arguments are those of `skin.draw_skin` without scratch."""
        if count == 0:
            return
        light = illuminate(view, lamp, ambient, casters, depth)
        leave_out(light.reception, part)
        values, shares = cuda.device_array(count, np.float32), raster.fragment_share[:count]
        cells = self._device.keep(f"skin {part}", texture.cells)
        self._device.launch_in_shadow(
            _draw_fragments, -(-count // LANES), light.reception, casters,
            values, out.shape[1], out.shape[0], float(view.focal), upload(light[:-1]), part, f32(gloss), cells,
            upload(texture.levels), texture.repeats, upload(raster.functions), upload(raster.fragment_face[:count]),
            upload(raster.fragment_place[:count]), upload(shares),
        )  # fmt: skip
        gather(out, keep, raster.fragment_pixel[:count], shares, values.copy_to_host())


@cuda.jit
def _draw_fragments(
    values, width, height, focal, light, part, gloss, cells, levels, repeats, functions, faces, places, shares,
    shadows, room, lists,
):  # fmt: skip
    S = cuda.shared.array(SCRATCH, np.float32)[cuda.threadIdx.x :]
    fetched = cuda.shared.array(LANES, np.uint64)[cuda.threadIdx.x :]
    own = lit_by(light, reception_of(shadows, lists[cuda.grid(1)]))
    texture = SkinTexture(cells, levels, repeats)
    for i in range(cuda.grid(1), values.size, cuda.gridsize(1)):
        shade_skin(
            S, 1, fetched, width, height, focal, own, part, gloss, texture, functions,
            faces[i : i + 1], places[i : i + 1], shares[i : i + 1], room,
        )  # fmt: skip
        values[i] = S[RESULT]


class CudaGripper:
    """`gripper.shade_gripper`; equal to it but for rounding."""

    def __init__(self, device: Device):
        self._device = device

    def __call__(
        self, values: np.ndarray, view: View, lamp: Lamp, ambient: np.ndarray, gloss: float, fragments: np.ndarray,
        albedo: int, casters: Casters,
    ) -> None:  # fmt: skip
        """The arguments are those of `gripper.shade_gripper` without scratch."""
        if len(values) == 0:
            return
        light = illuminate(view, lamp, ambient, casters, distance_of(view, casters))
        result = cuda.device_array(len(values), np.float32)
        self._device.launch_in_shadow(
            _draw_gripper, -(-len(values) // LANES), light.reception, casters,
            result, self._device.keep("gripper", fragments), albedo, upload(light[:-1]), f32(gloss),
        )  # fmt: skip
        result.copy_to_host(values)


@cuda.jit
def _draw_gripper(values, fragments, albedo, light, gloss, shadows, room, lists):
    S = cuda.shared.array(SCRATCH, np.float32)[cuda.threadIdx.x :]
    own = lit_by(light, reception_of(shadows, lists[cuda.grid(1)]))
    for i in range(cuda.grid(1), values.size, cuda.gridsize(1)):
        fragment = fragments[:, i : i + 1]
        open_fragments(S, 1, fragment, own.blockers[0])
        shade_fragments(S, 1, fragment, albedo, own, gloss, room)
        values[i] = S[RESULT]
