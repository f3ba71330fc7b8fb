"""Number of samples that a split was asked for: a small file that also vouches for the configuration."""

import hashlib
import json
import zlib
from pathlib import Path
from typing import Any, TypeGuard

from evslip.data.layout import CONFIG, plan_path, sha256_of, sweep
from evslip.utils import atomic
from evslip.utils.errors import StorageError
from evslip.utils.seeds import SPLITS


def request(root: Path, split: str, count: int) -> None:
    """Note that a split shall have at least `count` samples. Raises StorageError."""
    path = plan_path(root, split)
    with atomic.alone_in(root):
        if count > requested_count(root, split):
            try:
                atomic.write_bytes(path, _encoded(count, sha256_of(root / CONFIG)))
            except StorageError:
                # As in `building.add`: another machine's sweep may have taken our file; then its request is in place.
                if count > requested_count(root, split):
                    raise
        sweep(path)


def requested_count(root: Path, split: str) -> int:
    """Number of samples that a split was asked for; 0 without a plan that can be read."""
    count = _read(root, split).get("count")
    return count if _is_count(count) else 0


def vouches_for(root: Path, config_toml: str) -> bool:
    """Whether a whole plan says that the data set was made with this text of a configuration, and none says another."""
    plans = [plan for split in SPLITS if _is_whole(plan_path(root, split), plan := _read(root, split))]
    digest = hashlib.sha256(config_toml.encode()).hexdigest()
    return {plan["config_sha256"] for plan in plans} == {digest}


def problems(root: Path, split: str, is_needed: bool) -> list[str]:
    """Problems of a plan and, by the hash in it, with the configuration; one line a problem."""
    path = plan_path(root, split)
    if not path.is_file():
        return [f"{path}: missing"] if is_needed else []
    data, plan = path.read_bytes(), _read(root, split)
    count = plan.get("count")
    if _is_count(count) and data == json.dumps({"count": count}).encode() + b"\n":  # as the first versions wrote it
        return []
    if not _is_whole(path, plan):
        return [f"{path}: damaged"]
    if plan["config_sha256"] != sha256_of(root / CONFIG):
        return [f"{root / CONFIG}: damaged, its sha256 is not the one in {path.name}"]
    return []


def _is_count(count: Any) -> TypeGuard[int]:
    return isinstance(count, int) and not isinstance(count, bool) and count >= 0


def _is_whole(path: Path, plan: dict[str, Any]) -> bool:
    """Whether a plan's file is, to the byte, what `request` writes."""
    count = plan.get("count")
    return _is_count(count) and path.read_bytes() == _encoded(count, plan.get("config_sha256"))


def _encoded(count: int, config_sha256: str | None) -> bytes:
    plan = {"count": count, "config_sha256": config_sha256}
    return json.dumps({**plan, "crc32": zlib.crc32(json.dumps(plan).encode())}).encode() + b"\n"


def _read(root: Path, split: str) -> dict[str, Any]:
    path = plan_path(root, split)
    try:
        plan = json.loads(path.read_bytes() if path.is_file() else b"")
    except (OSError, ValueError, RecursionError):
        return {}
    return plan if isinstance(plan, dict) else {}
