"""The scene of `evslip.rendering`, drawn again in the plainest way: many rays a pixel, many rays to the lamp.

Shares no code with the renderer but the camera and the ambient light; the gripper appears only through its shadow.
"""

import numpy as np

from evslip import textures
from evslip.camera import Camera
from evslip.params import Params
from evslip.rendering.ambient import Ambient

LUMA = np.array([0.2126, 0.7152, 0.0722])


def luminance(
    params: Params, camera: Camera, frame: tuple, body: tuple, boxes: tuple, ambient: Ambient, *, rays: int = 4,
    lamp_rays: int = 9, gloss: tuple[float, float] = (0.1, 0.2),
) -> np.ndarray:  # fmt: skip
    """cd/m2 of shape (height, width). frame, body: position and rotation of camera and object in the world; boxes:
    turns, places and halves of the gripper's shadow boxes in camera axes; gloss: of surface and object."""
    rng = np.random.default_rng(0)
    c, turn = frame
    step = (np.arange(rays) + 0.5) / rays
    x = (np.arange(camera.width)[:, None] + step).ravel()
    y = (np.arange(camera.height)[:, None] + step).ravel()
    px, py = np.meshgrid((x - camera.width / 2) / camera.focal_px, (camera.height / 2 - y) / camera.focal_px)
    rays_local = np.stack([px, py, -np.ones_like(px)], -1).reshape(-1, 3)
    d = rays_local @ turn.T
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    result = _sky(params, c, d)
    light = params.light
    azimuth, polar = np.radians([light.azimuth_deg, light.polar_deg])
    lamp = light.distance_m * np.array(
        [np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)]
    )
    half = np.array([params.object.width_m, params.object.depth_m, params.object.height_m]) / 2
    t_box, face = _slab(*_local(c, d, *body), half)
    hit_box = np.isfinite(t_box)
    t_floor = np.where(d[:, 2] < 0, -c[2] / np.minimum(d[:, 2], -1e-12), np.inf)
    on_floor = ~hit_box & (np.linalg.norm(c + np.where(np.isfinite(t_floor), t_floor, 0)[:, None] * d, axis=1)
                           < params.background.radius_m) & np.isfinite(t_floor)  # fmt: skip
    casters = [(body[0], body[1], half)]
    casters += [(c + turn @ place, turn @ axes, size) for axes, place, size in zip(*boxes, strict=True)]

    p = c + t_floor[on_floor, None] * d[on_floor]
    uv = np.stack([p[:, 0], -p[:, 1]], 1) / params.surface.tile_m
    albedo = _texture(params.surface.texture, uv)
    normal = np.broadcast_to([0.0, 0.0, 1.0], p.shape)
    result[on_floor] = _reflect(
        albedo, ambient.surface, p, normal, d[on_floor], lamp, params, casters, lamp_rays, gloss[0], rng
    )

    p = c + t_box[hit_box, None] * d[hit_box]
    local = (p - body[0]) @ body[1]
    side = face[hit_box]
    axis = np.abs(side).astype(int) - 1
    local_normal = np.zeros_like(p)
    local_normal[np.arange(len(p)), axis] = np.sign(side)
    up = np.where((axis == 2)[:, None], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0])
    right = np.cross(up, local_normal)
    u = np.sum(local * right, 1) / np.abs(np.sum(half * 2 * right, 1)) + 0.5
    v = 0.5 - np.sum(local * up, 1) / np.abs(np.sum(half * 2 * up, 1))
    albedo = _texture(params.object.texture, np.clip(np.stack([u, v], 1), 0, 0.999999))
    normal = local_normal @ body[1].T
    n1 = np.concatenate([normal, np.ones((len(p), 1))], 1)
    around = np.einsum("ni,ij,nj->n", n1, ambient.matrix, n1)
    result[hit_box] = _reflect(
        albedo, around, p, normal, d[hit_box], lamp, params, casters[1:], lamp_rays, gloss[1], rng
    )
    shape = camera.height, rays, camera.width, rays
    return result.reshape(shape).mean((1, 3))


def _sky(params, c, d):
    b = d @ c
    t = -b + np.sqrt(b * b - (c @ c - params.background.radius_m**2))
    p = c + t[:, None] * d
    image = textures.load(params.background.texture, is_background=True) @ LUMA
    azimuth, elevation = np.arctan2(p[:, 1], p[:, 0]), np.arctan2(p[:, 2], np.hypot(p[:, 0], p[:, 1]))
    if image.shape[1] == 2 * image.shape[0]:  # a panorama: the whole sphere, the horizon in the middle
        u, v = azimuth / (2 * np.pi), 0.5 - elevation / np.pi
    else:
        repeats = max(1, round(360 / params.background.tile_deg))
        u, v = azimuth / (2 * np.pi) * repeats, -elevation / (2 * np.pi) * repeats
    return params.background.luminance_cd_m2 * _lookup(image, u, v)


def _texture(name, uv):
    return _lookup(textures.load(name) @ LUMA, uv[:, 0], uv[:, 1])


def _lookup(image, u, v):
    rows, columns = image.shape
    return image[np.floor(v * rows).astype(int) % rows, np.floor(u * columns).astype(int) % columns]


def _local(origin, d, position, rotation):
    return (origin - position) @ rotation, d @ rotation


def _slab(origin, d, half):
    """Distance to a box about the origin (inf: missed) and the face hit: +-1, +-2, +-3."""
    safe = np.where(np.abs(d) < 1e-12, 1e-12, d)
    near = np.minimum((-half - origin) / safe, (half - origin) / safe)
    far = np.maximum((-half - origin) / safe, (half - origin) / safe)
    t0, t1 = near.max(-1), far.min(-1)
    axis = near.argmax(-1)
    sign = -np.sign(np.take_along_axis(safe, axis[:, None], 1)[:, 0])
    return np.where((t0 < t1) & (t1 > 0), t0, np.inf), sign * (axis + 1)


def seen_share(points, lamp, radius, casters, count, rng):
    """Share of rays from points (n, 3) to the lamp's disc that pass all boxes."""
    towards = lamp - points
    first = np.cross(towards, [0.3, 0.5, 0.81])
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(first, towards)
    second /= np.linalg.norm(second, axis=1, keepdims=True)
    share = np.zeros(len(points))
    phase = rng.random((len(points), 2))
    for k in range(count):
        r = radius * np.sqrt((k + phase[:, 0]) / count)
        a = 2.399963 * k + 2 * np.pi * phase[:, 1]
        ray = towards + (r * np.cos(a))[:, None] * first + (r * np.sin(a))[:, None] * second
        clear = np.ones(len(points), bool)
        for position, rotation, half in casters:
            t, _ = _slab(*_local(points, ray, position, rotation), half)
            clear &= ~(t < 1)
        share += clear
    return share / count


def _reflect(albedo, around, p, normal, d, lamp, params, casters, lamp_rays, gloss, rng):
    light = params.light
    towards = lamp - p
    distance = np.linalg.norm(towards, axis=1, keepdims=True)
    towards = towards / distance
    cosine = np.maximum(np.sum(normal * towards, 1), 0)
    lit = light.luminance_cd_m2 * light.radius_m**2 / distance[:, 0] ** 2 * cosine
    on = lit > 0
    lit[on] *= seen_share(p[on] + 1e-7 * normal[on], lamp, light.radius_m, casters, lamp_rays, rng)
    half_way = towards - d
    half_way /= np.linalg.norm(half_way, axis=1, keepdims=True)
    shine = np.maximum(np.sum(normal * half_way, 1), 0) ** 32
    return albedo * (around + lit) + gloss * shine * lit
