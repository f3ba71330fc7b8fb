"""What a motion must keep above the table."""

import numpy as np

from evslip.config.params import Params
from evslip.utils.errors import PlanRejected


def require_above(least_m: float, t_s: np.ndarray, height_m: np.ndarray, name: str, remedy: str) -> None:
    """Raise PlanRejected if a part so named, at heights (n,) above the table at times (n,), gets below `least_m`."""
    worst = int(height_m.argmin())
    if height_m[worst] < least_m:
        depth = f"{-1e3 * height_m[worst]:.1f} mm into the table at {t_s[worst]:.2f} s"
        raise PlanRejected("collision", f"motion: puts {name} {depth}; {remedy}")


def require_camera_above(params: Params, t_s: np.ndarray, height_m: np.ndarray, remedy: str) -> None:
    """Raise PlanRejected if a camera, at heights (n,) above the table at times (n,), goes into it."""
    require_above(0.0, t_s, height_m, f"the {params.seen_by} camera" if params.seen_by else "the camera", remedy)
