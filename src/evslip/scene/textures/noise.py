"""Random fields that tile: smooth noise, its sums over octaves, cells, scattered spots."""

import numpy as np

from evslip.scene.textures.canvas import SIZE, U, V, fraction, whole

SMALL = np.float32(9.0)


def grains(rng: np.random.Generator, columns: int, rows: int) -> np.ndarray:
    """Independent values in [-0.5, 0.5), float32 of shape (rows, columns)."""
    return rng.random((rows, columns), np.float32) - np.float32(0.5)


def fractal(
    rng: np.random.Generator,
    across: int,
    down: int,
    octaves: int = 9,
    gain: float = 0.7,
    spread: float = 1.0,
    size: tuple[int, int] = (SIZE, SIZE),
) -> np.ndarray:
    """Sum of noises, each twice as fine and `gain` as strong as the one before: mean about 0.5, most within [0, 1].

    `across` and `down` (powers of two) are the random values along each side of the coarsest; `size` is (columns,
    rows), powers of two. A gain of 1 gives every octave the same variance, as in photographs; 0.5 is a cloud. Each
    octave is drawn on its own lattice and refined with the ones before it, so that all cost little more than the last.
    """
    columns, rows = size
    weight = np.float32(1.0)
    total = grains(rng, across, down)
    variance = 1.0
    for _ in range(octaves - 1):
        if across >= columns and down >= rows:
            break
        across, down = min(2 * across, columns), min(2 * down, rows)
        total = refine(total, across, down)
        weight *= np.float32(gain)
        total += grains(rng, across, down) * weight
        variance += float(weight) ** 2
    while across < columns or down < rows:
        across, down = min(2 * across, columns), min(2 * down, rows)
        total = refine(total, across, down)
    # Uniform grains smoothed by the spline keep about 0.16 of standard deviation; 0.5 +- 0.2 is wanted.
    return np.float32(0.5) + total * np.float32(1.3 * spread / variance**0.5)


def refine(values: np.ndarray, columns: int, rows: int) -> np.ndarray:
    """Twice as many values along each side that is still too short, by quadratic splines; wraps."""
    if values.shape[0] < rows:
        values = _double(values)
    return _double(values.T).T if values.shape[1] < columns else values


def _double(values: np.ndarray) -> np.ndarray:
    fine = np.empty((2 * values.shape[0], values.shape[1]), np.float32)
    main = values * np.float32(0.75)
    side = values * np.float32(0.25)
    np.add(main, np.roll(side, 1, 0), out=fine[0::2])
    np.add(main, np.roll(side, -1, 0), out=fine[1::2])
    return fine


def cells(
    rng: np.random.Generator, across: int, down: int | None = None, jitter: float = 1.0, du: object = 0, dv: object = 0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Voronoi cells of across x down jittered points, wrapped: nearest and second nearest distance, in cells, and a
    random value of each cell. `du`, `dv` displace the places, in shares of the side."""
    down = down or across
    x_of = (rng.random((down, across), np.float32) - np.float32(0.5)) * np.float32(jitter) + np.float32(0.5)
    y_of = (rng.random((down, across), np.float32) - np.float32(0.5)) * np.float32(jitter) + np.float32(0.5)
    value_of = rng.random(across * down, np.float32)
    x, y = (U + du) * np.float32(across), (V + dv) * np.float32(down)
    i, j = whole(x), whole(y)
    x, y = fraction(x), fraction(y)
    near, second = np.full(x.shape, SMALL), np.full(x.shape, SMALL)
    label = np.zeros(x.shape, np.int32)
    x_of, y_of = x_of.ravel(), y_of.ravel()
    columns = [(i + di) % across for di in (-1, 0, 1)]
    for dj in (-1, 0, 1):
        row = (j + dj) % down * across
        for di in (-1, 0, 1):
            cell = row + columns[di + 1]
            dx, dy = x_of[cell] + np.float32(di) - x, y_of[cell] + np.float32(dj) - y
            distance = dx * dx + dy * dy
            is_nearer = distance < near
            second = np.minimum(second, np.maximum(distance, near))
            label[is_nearer] = cell[is_nearer]
            near = np.minimum(near, distance)
    return np.sqrt(near), np.sqrt(second), value_of[label]


def leaves(
    rng: np.random.Generator, count: int, length: float, width: float, is_pointed: bool = True
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Leaves (or strips) strewn over each other: what they cover (0 to 1), a random value of the topmost, and the place
    across it from -1 to 1. `length` and `width`, from the middle to the ends, are in shares of the side."""
    cover = np.zeros((SIZE, SIZE), np.float32)
    value = np.zeros((SIZE, SIZE), np.float32)
    place = np.zeros((SIZE, SIZE), np.float32)
    for column, row, tone, turn, scale in rng.random((count, 5), np.float32):
        x, y = _direction(turn)
        size = np.float32(0.6) + np.float32(0.6) * scale
        half, side = np.float32(length) * size, np.float32(width) * size
        reach = [int(SIZE * (half * abs(a) + side * abs(b))) + 2 for a, b in ((x, y), (y, x))]
        dx, dy = (np.arange(-r, r + 1, dtype=np.float32) / np.float32(SIZE) for r in reach)
        along = (dx * x + dy[:, None] * y) / half
        across = (dy[:, None] * x - dx * y) / side
        if is_pointed:
            inside = 1 - along * along - np.abs(across) * (1 + np.float32(0.5) * along)
        else:
            inside = 1 - np.maximum(np.abs(along), np.abs(across))
        ink = np.clip(inside * np.float32(8), 0, 1)
        columns, rows = (
            (int(at * SIZE) + np.arange(-r, r + 1)) % SIZE for at, r in zip((column, row), reach, strict=True)
        )
        at = rows[:, None], columns
        solid = ink > 0.5
        cover[at] = np.maximum(cover[at], ink)
        value[at] = np.where(solid, tone, value[at])
        place[at] = np.where(solid, across, place[at])
    return cover, value, place


def _direction(turn: np.float32) -> tuple[np.float32, np.float32]:
    """A unit vector; turn from 0 to 1 goes once around, not quite evenly."""
    quarter = np.float32(4) * turn
    side, share = int(quarter) % 4, quarter - np.floor(quarter)
    x, y = 1 - share, share
    x, y = ((x, y), (-y, x), (-x, -y), (y, -x))[side]
    norm = np.sqrt(x * x + y * y)
    return x / norm, y / norm
