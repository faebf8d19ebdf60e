"""What a result needs to be trusted years later: commit, versions, compiler flags, machine."""

from __future__ import annotations

import os
import platform
import re
import shutil
import socket
import subprocess
from datetime import UTC, datetime
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

from dembark.common.checkout import checkout
from dembark.validation.engines import Engine


def _git(root: Path, *words: str) -> str | None:
    if not shutil.which("git"):
        return None
    done = subprocess.run(["git", "-C", str(root), *words], capture_output=True, text=True, check=False)
    return done.stdout.strip() if done.returncode == 0 else None


@cache
def commit() -> dict[str, Any]:
    """`commit` (None outside a Git checkout) and `dirty` (tracked files differ from it)."""
    root = checkout()
    head = _git(root, "rev-parse", "HEAD") if root else None
    dirty = bool(_git(root, "status", "--porcelain", "--untracked-files=no")) if root and head else None
    return {"commit": head, "dirty": dirty}


def measured() -> dict[str, Any]:
    """When, and by which commit, something is measured; the runs themselves may be older."""
    return {**commit(), "at": datetime.now(UTC).isoformat(timespec="seconds")}


def package_version(name: str) -> str | None:
    """Installed version of a Python distribution; None when it is not there."""
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


def cpu() -> str:
    """Name of the processor."""
    try:
        found = re.search(r"^model name\s*:\s*(.+)$", Path("/proc/cpuinfo").read_text(encoding="utf-8"), re.MULTILINE)
    except OSError:
        found = None
    return found.group(1) if found else platform.processor() or platform.machine()


def build_flags(engine: Engine) -> dict[str, str]:
    """Compiler, build type and flags of dembark's part of `engine`, from the CMake cache of its build; empty when there is none."""
    for path in (folder / "CMakeCache.txt" for folder in engine.build_folders()):
        if path.is_file():
            wanted = r"^(CMAKE_(?:CXX_COMPILER|BUILD_TYPE|CXX_FLAGS|CXX_FLAGS_RELEASE)):[A-Z]+=(.*)$"
            return dict(re.findall(wanted, path.read_text(encoding="utf-8", errors="replace"), re.MULTILINE))
    return {}


def collect(engine: Engine) -> dict[str, Any]:
    """Facts about code, engine and machine, ready for JSON."""
    return {
        **commit(),
        "versions": {"dembark": package_version("dembark"), engine.name: engine.version, "python": platform.python_version(),
                     **{name: package_version(name) for name in ("numpy", "scipy", "MDAnalysis")}},
        "engine": str(engine.executable), "engine_identity": engine.identity, "flags": build_flags(engine),
        "host": socket.gethostname(), "os": platform.platform(), "cpu": cpu(), "cores": os.cpu_count(),
    }
