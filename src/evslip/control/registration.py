"""Names under which Gymnasium makes the environments."""

import gymnasium

ENVIRONMENTS = {"evslip/Hold-v0": "HoldEnv", "evslip/Lift-v0": "LiftEnv"}
"""Classes of `evslip.control.environment` by name."""


def register() -> None:
    """Let `gymnasium.make` know the environments."""
    for name, kind in ENVIRONMENTS.items():
        if name not in gymnasium.registry:
            gymnasium.register(id=name, entry_point=f"evslip.control.environment:{kind}")
