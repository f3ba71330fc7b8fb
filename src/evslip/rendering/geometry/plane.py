"""Places where rays meet a plane, and how large a pixel is there."""

import math

import numpy as np

from evslip.rendering.scratch import HALF, ONE, ZERO, f32, kernel
from evslip.rendering.slots import (
    MAJOR_U,
    MAJOR_V,
    MINOR_U,
    MINOR_V,
    RAY_X,
    RAY_Y,
    ROOM,
    U,
    V,
    W,
)

GRAZING = f32(-1e-5)


def describe(origin: np.ndarray, axes: np.ndarray, turn: np.ndarray, camera: np.ndarray) -> np.ndarray:
    """A plane as the passes take it, float32 (12,): the normal and both axes in camera axes (9), the height of the
    origin over the camera along the normal (1), the camera in the plane's u, v (2).

    axes: u, v and the normal in the world as columns; turn, camera: the camera's axes as columns, and its place.
    """
    across, seen_from = turn.T @ axes, axes.T @ (camera - origin)
    parts = across[:, 2], across[:, 0], across[:, 1], [-seen_from[2]], seen_from[:2]
    return np.concatenate(parts).astype(np.float32)


@kernel
def meet_plane(S, n, plane, pixel):
    """U, V, W = the points where the rays meet a plane; MAJOR, MINOR = a pixel's footprint, MAJOR away from the camera.

    pixel: width of a pixel at unit distance. The footprint is of the ROOM that the pixel has left.
    """
    n0, n1, n2 = plane[0], plane[1], plane[2]
    u0, u1, u2 = plane[3], plane[4], plane[5]
    v0, v1, v2 = plane[6], plane[7], plane[8]
    height, camera_u, camera_v = plane[9], plane[10], plane[11]
    for i in range(n):
        x, y = S[RAY_X + i], S[RAY_Y + i]
        facing = min(n0 * x + n1 * y - n2, GRAZING)
        ray_u = u0 * x + u1 * y - u2
        ray_v = v0 * x + v1 * y - v2
        distance = height / facing
        sideways = ray_u * ray_u + ray_v * ray_v
        width = distance * pixel * S[ROOM + i]
        length = -width * math.sqrt(sideways + facing * facing) / facing
        along = length / math.sqrt(sideways + f32(1e-12))
        across = along * width / length
        S[U + i], S[V + i], S[W + i] = camera_u + distance * ray_u, camera_v + distance * ray_v, ZERO
        S[MAJOR_U + i], S[MAJOR_V + i] = along * ray_u, along * ray_v
        S[MINOR_U + i], S[MINOR_V + i] = -across * ray_v, across * ray_u


@kernel
def meet_face(S, n, plane, pixel, half_u, half_v):
    """Slots of `meet_plane`, of the face |u| <= half_u, |v| <= half_v; MAJOR and MINOR are a pixel's own sides.

    The footprint stays within the face: a thin one takes its mean.
    """
    n0, n1, n2 = plane[0], plane[1], plane[2]
    u0, u1, u2 = plane[3], plane[4], plane[5]
    v0, v1, v2 = plane[6], plane[7], plane[8]
    height, camera_u, camera_v = plane[9], plane[10], plane[11]
    for i in range(n):
        x, y = S[RAY_X + i], S[RAY_Y + i]
        inverse = ONE / min(n0 * x + n1 * y - n2, GRAZING)
        ray_u = (u0 * x + u1 * y - u2) * inverse
        ray_v = (v0 * x + v1 * y - v2) * inverse
        step = height * inverse * pixel * S[ROOM + i]
        right_u, right_v = step * (u0 - ray_u * n0), step * (v0 - ray_v * n0)
        up_u, up_v = step * (u1 - ray_u * n1), step * (v1 - ray_v * n1)
        room_u = max(half_u - HALF * (abs(right_u) + abs(up_u)), ZERO)
        room_v = max(half_v - HALF * (abs(right_v) + abs(up_v)), ZERO)
        S[U + i] = min(max(camera_u + height * ray_u, -room_u), room_u)
        S[V + i] = min(max(camera_v + height * ray_v, -room_v), room_v)
        S[W + i] = ZERO
        S[MAJOR_U + i], S[MAJOR_V + i], S[MINOR_U + i], S[MINOR_V + i] = right_u, right_v, up_u, up_v
