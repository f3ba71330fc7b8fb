"""Settings of all tests."""

import os

from hypothesis import settings

if "PYTEST_XDIST_WORKER" in os.environ:
    # As many tests run at once as there are cores: threads that wait must not spin on the cores that others need.
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")

# Commands that a busy machine makes slow shall write what they write elsewhere: no lines about their progress.
os.environ.setdefault("EVSLIP_PROGRESS_S", "3600")

# No example fails for its time, which says how busy the machine is. On a developer's machine every run explores others;
# in CI a red run shall mean that the change broke it.
settings.register_profile("evslip", deadline=None, derandomize=bool(os.environ.get("CI")))
settings.load_profile("evslip")
