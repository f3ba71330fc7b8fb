"""Settings of all tests."""

import os
import signal

import pytest
from hypothesis import settings

if "PYTEST_XDIST_WORKER" in os.environ:
    # As many tests run at once as there are cores: threads that wait must not spin on the cores that others need.
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")

# Commands that a busy machine makes slow shall write what they write elsewhere: no lines about their progress.
os.environ.setdefault("EVSLIP_PROGRESS_S", "3600")

# A shell's background job ignores SIGINT, and so would the commands that tests interrupt.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# No example fails for its time, which says how busy the machine is. On a developer's machine every run explores others;
# in CI a red run shall mean that the change broke it.
settings.register_profile("evslip", deadline=None, derandomize=bool(os.environ.get("CI")))
settings.load_profile("evslip")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Files with slow tests come first: begun last, they would keep one worker busy while the others have nothing."""
    slow = {item.path for item in items if item.get_closest_marker("slow") is not None}
    items.sort(key=lambda item: item.path not in slow)
