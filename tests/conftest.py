"""Settings of all tests."""

import os

from hypothesis import settings

# On a developer's machine every run explores other examples; in CI a red run shall mean that the change broke it.
settings.register_profile("ci", derandomize=True)
if os.environ.get("CI"):
    settings.load_profile("ci")
