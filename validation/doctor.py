"""What is installed, in which version, what is missing and what to do about it."""

from __future__ import annotations

import os
import platform
import shutil
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from dembark.common.checkout import checkout
from dembark.common.errors import DembarkError
from dembark.common.extras import install_line
from dembark.common.units import size_text
from dembark.validation import engines, provenance
from dembark.validation.case import folders

# By the extra that installs them; "" is without any.
_PACKAGES = {"": ("numpy", "scipy", "pandas", "MDAnalysis", "filelock", "jinja2", "pint", "rich", "typer"),
             "fields": ("xarray", "h5netcdf", "h5py", "pyvista"), "report": ("matplotlib", "weasyprint"),
             "campaigns": ("SALib", "emcee", "scikit-learn")}


@dataclass(frozen=True)
class Finding:
    """One thing that was looked for; `advice` says what to do when it was not found."""

    what: str
    found: str | None
    required: bool = True
    advice: str = ""


def _asked(what: str, question: Callable[[], str], required: bool = True) -> Finding:
    try:
        return Finding(what, question(), required)
    except DembarkError as error:
        return Finding(what, None, required, str(error))


def _engine(name: str) -> str:
    if later := engines.engine_class(name).pending():
        return later
    engine = engines.find(name)
    return f"{engine.version} ({engine.executable})"


def _packages(extra: str, names: tuple[str, ...]) -> Finding:
    """The packages of an extra with their versions; not found when one is absent."""
    versions = {name: provenance.package_version(name) for name in names}
    absent = [name for name, version in versions.items() if version is None]
    title = f"Python packages for {extra}" if extra else "Python packages"
    found = None if absent else ", ".join(f"{name} {version}" for name, version in versions.items())
    right = install_line(extra) if extra else "run 'make'"
    return Finding(title, found, not extra, f"{', '.join(absent)} missing: {right}")


def _parts(facts: engines.EngineFacts) -> list[Finding]:
    """What the engine lacks that its users may know from other builds; nothing where it is not installed."""
    try:
        lacking = "" if engines.engine_class(facts.name).pending() else ", ".join(engines.find(facts.name).missing_parts())
    except DembarkError:
        return []
    advice = f"built without {lacking}; no case needs them; {facts.own_build}"
    return [Finding(f"parts of {facts.title}", None, False, advice)] if lacking else []


def _decks() -> str:
    found, roots = folders.discover(), [folders.shipped_root(), *folders.own_roots()]
    where = " and ".join(map(str, roots))
    if not found:
        raise DembarkError(f"no case in {where}", "", "set DEMBARK_CASES to the folder that holds your case folders")
    return f"{', '.join(found)} in {where}"


def examine() -> list[Finding]:
    """All findings: Python and its packages, the engines, the cases, and what is useful but not required."""
    mpirun, commit = shutil.which("mpirun"), provenance.commit()
    free = shutil.disk_usage(Path.cwd()).free
    return [
        Finding("Python", platform.python_version() if sys.version_info >= (3, 11) else None, advice="Python 3.11 or newer is needed"),
        *(_packages(extra, names) for extra, names in _PACKAGES.items()),
        *(finding for facts in map(engines.facts, engines.names())
          for finding in (_asked(facts.program, partial(_engine, facts.name), bool(checkout()) and not facts.optional), *_parts(facts))),
        _asked("cases", _decks),
        Finding("mpirun", mpirun, False, "install openmpi-bin to use --ranks"),
        Finding("Slurm", shutil.which("sbatch"), False, "only on clusters; campaigns run here without it"),
        Finding("commit", commit["commit"] and commit["commit"][:12] + (" with changes" if commit["dirty"] else ""), False,
                "not a Git checkout: results will not state a commit"),
        Finding("machine", f"{os.cpu_count()} cores, {size_text(free)} free in this folder", False),
    ]
