"""Free memory: the limits of control groups of both versions, and of those around them."""

from __future__ import annotations

from pathlib import Path

import pytest

from dembark.common import memory


def make(folder: Path, limit: str, used: str, names: tuple[str, str]) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in zip(names, (limit, used), strict=True):
        (folder / name).write_text(text + "\n")


SECOND, FIRST = ("memory.max", "memory.current"), ("memory.limit_in_bytes", "memory.usage_in_bytes")


def least(tmp_path: Path, groups: str) -> float:
    (tmp_path / "groups").write_text(groups)
    found = []
    for limit, used in memory._limits(tmp_path / "groups", tmp_path / "fs"):
        if limit.exists() and limit.read_text().strip() != "max":
            found.append(float(limit.read_text()) - float(used.read_text()))
    return min(found, default=float("inf"))


@pytest.mark.parametrize(("groups", "top", "names"), [
    ("0::/slurm/job_1/step_0\n", "fs", SECOND), ("3:cpu,cpuacct:/elsewhere\n4:memory:/slurm/job_1/step_0\n", "fs/memory", FIRST)])
def test_the_narrowest_limit_counts(tmp_path: Path, groups: str, top: str, names: tuple[str, str]) -> None:
    root = tmp_path / top
    make(root / "slurm/job_1/step_0", "max" if names is SECOND else str(2**63 - 4096), "5e8", names)
    make(root / "slurm/job_1", "4e9", "1e9", names)
    make(root / "slurm", "64e9", "2e9", names)
    assert least(tmp_path, groups) == 3e9


def test_a_container_sees_its_own_group_at_the_top(tmp_path: Path) -> None:
    """Its name is that of the host, where nothing is mounted."""
    make(tmp_path / "fs", "2e9", "5e8", SECOND)
    assert least(tmp_path, "0::/docker/0123\n") == 1.5e9
    assert least(tmp_path, "") == 1.5e9


def test_memory_without_limits_is_that_of_the_system() -> None:
    assert 1e6 < memory.free_memory() < 1e14
