"""Two optional pixels of v2e; both change the input of the comparator, `signal`.

Centre-surround (v2e's CSDVS: Delbruck, Li, Graca, McReynolds, Utility and feasibility of a center surround event
camera, ICIP 2022): signal = lp - h, with h the voltage of a resistive grid that every pixel drives,

    tau dh/dt = lp - h + lambda^2 laplace(h),

lambda in pixels; the border mirrors itself. Integrated by Euler steps of a fifth of the shorter of tau and
tau / lambda^2, until the frame's time is over or no pixel changes by more than 1e-5 a step. tau = 0 stands for 1 ns, so
that h settles within every frame.

Adaptive high-pass (v2e's SCIDVS): signal = 2 v, where the high-passed v follows lp but leaks back to zero through a
conductance that grows with v, with an e-fold of 1/0.7 ln units,

    dv = d lp - dt / tau sinh(0.7 v),

one Euler step a frame, which diverges where it takes away more than twice v. Adaptation is why a slow, faint change
fires and a lasting one stops firing.
"""

import math

import numpy as np

from evslip.utils.jit import compiled

GAIN, EFOLD = 2.0, 1 / 0.7
LEAST_TAU_S, STEPS_PER_TAU, SETTLED = 1e-9, 5, 1e-5


@compiled(error_model="numpy")
def diffuse(center: np.ndarray, surround: np.ndarray, share: float, coupling: float, most_steps: int) -> int:
    """Euler steps of the grid, in place; share = step / tau, coupling = share lambda^2. Returns their number."""
    height, width = center.shape
    before = np.empty_like(surround)
    for step in range(most_steps):
        before[...] = surround
        most = 0.0
        for y in range(height):
            above, below = before[max(y - 1, 0)], before[min(y + 1, height - 1)]
            for x in range(width):
                here = before[y, x]
                left, right = before[y, max(x - 1, 0)], before[y, min(x + 1, width - 1)]
                change = share * (center[y, x] - here) + coupling * (above[x] + below[x] + left + right - 4.0 * here)
                surround[y, x] = here + change
                most = max(most, abs(change))
        if most <= SETTLED:
            return step + 1
    return most_steps


@compiled(error_model="numpy")
def adapt(center: np.ndarray, before: np.ndarray, high: np.ndarray, tau_s: np.ndarray, dt: np.floating) -> bool:
    """One step of v, `high`, in place, as lp goes from `before` to `center`. Returns whether none diverges."""
    height, width = center.shape
    holds = True
    for y in range(height):
        for x in range(width):
            leak = dt * (1 / tau_s[y, x] * math.sinh(high[y, x] / EFOLD))
            holds &= abs(leak) <= 2.0 * abs(high[y, x])
            high[y, x] += center[y, x] - before[y, x] - leak
    return holds


def steps_of(dt_s: float, tau_s: float, pixels: float) -> tuple[float, float, int]:
    """share, coupling and most_steps of `diffuse` for a frame."""
    tau_s = max(tau_s, LEAST_TAU_S)
    tau_grid_s = tau_s / pixels**2
    most_steps = math.ceil(dt_s / min(tau_s, tau_grid_s) * STEPS_PER_TAU)
    step_s = dt_s / most_steps
    return step_s / tau_s, step_s / tau_grid_s, most_steps
