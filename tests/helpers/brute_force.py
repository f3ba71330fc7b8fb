"""The scene of `evslip.rendering`, drawn again in the plainest way: many rays a pixel, many rays to the lamp.

Shares no code with the renderer but the camera and the ambient light; the gripper appears only through its shadow.
A body is a function (origins, directions) -> (distances, inf where missed; normals; texture coordinates) in its frame.
"""

from functools import partial

import numpy as np
from numba import njit

from evslip.config.params import Params
from evslip.rendering.camera import Camera, hand_camera
from evslip.rendering.poses import ScenePoses
from evslip.rendering.raycast import renderer
from evslip.rendering.raycast.renderer import Raycaster
from evslip.rendering.shading.ambient import Ambient
from evslip.scene.textures import library

LUMA = np.array([0.2126, 0.7152, 0.0722])


def luminance(
    params: Params,
    camera: Camera,
    frame: tuple,
    body: tuple,
    boxes: tuple,
    ambient: Ambient,
    *,
    rays: int = 4,
    lamp_rays: int = 9,
    gloss: tuple[float, float] = (0.0, 0.0),
    shape=None,
) -> np.ndarray:
    """cd/m2 of shape (height, width). frame, body: position and rotation of camera and object in the world; boxes:
    turns, places and halves of the gripper's shadow boxes in camera axes; gloss: of surface and object; shape: the
    object's body, by default the cuboid of the parameters."""
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
    shape = shape or partial(cuboid, half)
    t_body, local_normal, uv = shape(*_local(c, d, *body))
    hit_body = np.isfinite(t_body)
    t_floor = np.where(d[:, 2] < 0, -c[2] / np.minimum(d[:, 2], -1e-12), np.inf)
    on_floor = (
        ~hit_body
        & (
            np.linalg.norm(c + np.where(np.isfinite(t_floor), t_floor, 0)[:, None] * d, axis=1)
            < params.background.radius_m
        )
        & np.isfinite(t_floor)
    )
    own = [(body[0], body[1], shape)]
    hand = [(c + turn @ place, turn @ axes, partial(cuboid, size)) for axes, place, size in zip(*boxes, strict=True)]

    p = c + t_floor[on_floor, None] * d[on_floor]
    tiles = np.stack([p[:, 0], -p[:, 1]], 1) / params.surface.tile_m
    albedo = _texture(params.surface.texture, tiles)
    normal = np.broadcast_to([0.0, 0.0, 1.0], p.shape)
    result[on_floor] = _reflect(
        albedo, ambient.surface, p, normal, d[on_floor], lamp, params, own + hand, lamp_rays, gloss[0], rng
    )

    p = c + t_body[hit_body, None] * d[hit_body]
    albedo = _texture(params.object.texture, np.clip(uv[hit_body], 0, 0.999999))
    normal = local_normal[hit_body] @ body[1].T
    n1 = np.concatenate([normal, np.ones((len(p), 1))], 1)
    around = np.einsum("ni,ij,nj->n", n1, ambient.matrix, n1)
    result[hit_body] = _reflect(albedo, around, p, normal, d[hit_body], lamp, params, hand, lamp_rays, gloss[1], rng)
    return result.reshape(camera.height, rays, camera.width, rays).mean((1, 3))


def _sky(params, c, d):
    b = d @ c
    t = -b + np.sqrt(b * b - (c @ c - params.background.radius_m**2))
    p = c + t[:, None] * d
    image = library.load(params.background.texture, is_background=True) @ LUMA
    azimuth, elevation = np.arctan2(p[:, 1], p[:, 0]), np.arctan2(p[:, 2], np.hypot(p[:, 0], p[:, 1]))
    if image.shape[1] == 2 * image.shape[0]:  # a panorama: the whole sphere, the horizon in the middle
        u, v = azimuth / (2 * np.pi), 0.5 - elevation / np.pi
    else:
        repeats = max(1, round(360 / params.background.tile_deg))
        u, v = azimuth / (2 * np.pi) * repeats, -elevation / (2 * np.pi) * repeats
    return params.background.luminance_cd_m2 * _lookup(image, u, v)


def _texture(name, uv):
    return _lookup(library.load(name) @ LUMA, uv[:, 0], uv[:, 1])


def _lookup(image, u, v):
    rows, columns = image.shape
    return image[np.floor(v * rows).astype(int) % rows, np.floor(u * columns).astype(int) % columns]


def _local(origin, d, position, rotation):
    return (origin - position) @ rotation, d @ rotation


def cuboid(half, origin, d):
    """A box about the origin, with the whole texture on each side: v downwards along z, on the ends along y."""
    safe = np.where(np.abs(d) < 1e-12, 1e-12, d)
    near = np.minimum((-half - origin) / safe, (half - origin) / safe)
    far = np.maximum((-half - origin) / safe, (half - origin) / safe)
    t0, t1 = near.max(-1), far.min(-1)
    axis = near.argmax(-1)
    t = np.where((t0 < t1) & (t1 > 0), t0, np.inf)
    normal = np.zeros(safe.shape)
    normal[np.arange(len(safe)), axis] = -np.sign(np.take_along_axis(safe, axis[:, None], 1)[:, 0])
    up = np.where((axis == 2)[:, None], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0])
    right = np.cross(up, normal)
    local = origin + np.where(np.isfinite(t), t, 0)[:, None] * d
    u = np.sum(local * right, 1) / np.abs(np.sum(half * 2 * right, 1)) + 0.5
    v = 0.5 - np.sum(local * up, 1) / np.abs(np.sum(half * 2 * up, 1))
    return t, normal, np.stack([u, v], 1)


def cylinder(radius, top, origin, d):
    """Upright about the origin; the texture goes round twice from +x, and fills each end's square."""
    origin = np.broadcast_to(origin, d.shape)
    a, b = np.sum(d[:, :2] ** 2, 1) + 1e-30, np.sum(d[:, :2] * origin[:, :2], 1)
    root = b * b - a * (np.sum(origin[:, :2] ** 2, 1) - radius**2)
    reach = np.sqrt(np.maximum(root, 0))
    z = np.where(np.abs(d[:, 2]) < 1e-12, 1e-12, d[:, 2])
    ends = np.sort(np.stack([(-top - origin[:, 2]) / z, (top - origin[:, 2]) / z]), 0)
    side, cap = (-b - reach) / a, ends[0]
    t0, t1 = np.maximum(side, cap), np.minimum((-b + reach) / a, ends[1])
    t = np.where((root > 0) & (t0 < t1) & (t1 > 0), t0, np.inf)
    local = origin + np.where(np.isfinite(t), t, 0)[:, None] * d
    on_side = side > cap
    flip = -np.sign(z)
    normal = np.where(on_side[:, None], local * (1 / radius, 1 / radius, 0), np.stack([0 * z, 0 * z, flip], 1))
    turn = np.arctan2(local[:, 1], local[:, 0]) / np.pi % 1
    around = np.stack([turn, 0.5 - local[:, 2] / (2 * top)], 1)
    over = np.stack([0.5 + flip * local[:, 0] / (2 * radius), 0.5 - local[:, 1] / (2 * radius)], 1)
    return t, normal, np.where(on_side[:, None], around, over)


def triangles(vertices, faces, uv, normals, origin, d):
    """A triangle mesh with interpolated texture coordinates and normals."""
    t, face, weight = _nearest(np.asarray(vertices)[faces], np.broadcast_to(origin, d.shape).copy(), d)
    hit = face >= 0
    normal = np.einsum("nk,nki->ni", weight, np.where(hit[:, None, None], normals[face], 1.0))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return t, normal, np.einsum("nk,nki->ni", weight, uv[face]) % 1


@njit
def _nearest(corners, origins, d):
    t, face, weight = np.full(len(d), np.inf), np.full(len(d), -1), np.full((len(d), 3), 1 / 3)
    for f in range(len(corners)):
        a, first, second = corners[f, 0], corners[f, 1] - corners[f, 0], corners[f, 2] - corners[f, 0]
        for n in range(len(d)):
            p0 = d[n, 1] * second[2] - d[n, 2] * second[1]
            p1 = d[n, 2] * second[0] - d[n, 0] * second[2]
            p2 = d[n, 0] * second[1] - d[n, 1] * second[0]
            volume = first[0] * p0 + first[1] * p1 + first[2] * p2
            s0, s1, s2 = origins[n, 0] - a[0], origins[n, 1] - a[1], origins[n, 2] - a[2]
            b = (s0 * p0 + s1 * p1 + s2 * p2) / volume if abs(volume) > 1e-18 else -1.0
            if b < 0 or b > 1:
                continue
            q0, q1 = s1 * first[2] - s2 * first[1], s2 * first[0] - s0 * first[2]
            q2 = s0 * first[1] - s1 * first[0]
            c = (d[n, 0] * q0 + d[n, 1] * q1 + d[n, 2] * q2) / volume
            away = (second[0] * q0 + second[1] * q1 + second[2] * q2) / volume
            if c >= 0 and b + c <= 1 and 1e-9 < away < t[n]:
                t[n], face[n] = away, f
                weight[n, 0], weight[n, 1], weight[n, 2] = 1 - b - c, b, c
    return t, face, weight


def seen_share(points, lamp, radius, casters, count, rng):
    """Share of rays from points (n, 3) to the lamp's disc that pass all casters: (position, rotation, body) each."""
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
        for position, rotation, body in casters:
            clear &= ~(body(*_local(points, ray, position, rotation))[0] < 1)
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


def compare(params, traj, at_us, monkeypatch, shape=None):
    """Log error against brute force outside the gripper, without the lens's blur, and the exposed images' RMS error.

    Bodies keep no light from all around away here: `test_render_occlusion` looks at that alone."""
    monkeypatch.setattr(renderer, "SPREAD", np.float32(0))
    monkeypatch.setattr(renderer, "illuminate", partial(_illuminate_openly, renderer.illuminate))
    camera = hand_camera(params)
    poses = ScenePoses(traj, camera, np.array([at_us]))
    raycaster = Raycaster(params, camera, float(poses.travel_m[0]))
    image, bodies = raycaster.draw(poses, 0)
    opening = raycaster._openings.at(float(poses.travel_m[0]))
    truth = luminance(
        params,
        camera,
        (poses.camera_position[0], poses.camera_rotation[0]),
        (poses.object_position[0], poses.object_rotation[0]),
        opening.boxes,
        raycaster.setting.ambient,
        shape=shape,
    )
    free = np.ones(image.size, bool)
    free[opening.layers.pixels] = False
    free = free.reshape(image.shape)
    return np.log(image / truth)[free], (image - truth)[free] / np.median(truth) / 4, bodies[free]


def _illuminate_openly(illuminate, view, sky_turn, setting, casters, blockers, parts, _standing):
    none = type(blockers)(*(part[:0] for part in blockers))
    return illuminate(view, sky_turn, setting, casters, none, parts[:0], none)
