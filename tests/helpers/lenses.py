"""Lenses that bend the image, for tests of what must follow them."""

BARREL = {"camera.k1": -0.3, "camera.k2": 0.1, "camera.p1": 0.005, "camera.p2": -0.01}
PINCUSHION = {"camera.k1": 0.25, "camera.p2": 0.004}
"""Overrides of a configuration."""
