"""Snakemake profiles: folders with `config.yaml`, and `preamble.sh` with what a site's shells need before anything runs."""

from __future__ import annotations

import os
import shlex
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from dembark.common.errors import DembarkError
from dembark.validation.case.parameters import nearest

# Names the preamble to the jobs, whose commands read it first (see the Snakefile).
PREAMBLE_VARIABLE = "DEMBARK_PREAMBLE"
CONFIGURATION = "config.yaml"
_SHIPPED = ("local", "slurm")


@dataclass(frozen=True)
class ExecutorProfile:
    """A profile folder that was read and checked: `settings` are the keys of its config.yaml."""

    folder: Path
    settings: Mapping[str, Any]

    @property
    def executor(self) -> str:
        """Name of Snakemake's executor: `local`, `slurm`, ..."""
        return str(self.settings.get("executor", "local"))

    @property
    def defaults(self) -> dict[str, Any]:
        """Resources of jobs that name none themselves."""
        return dict(self.settings.get("default-resources") or {})

    def environment(self) -> dict[str, str]:
        """This process's environment after the profile's preamble; DembarkError when the preamble fails."""
        preamble = self.folder / "preamble.sh"
        if not preamble.is_file():
            return dict(os.environ)
        # Sites' scripts are not written for `set -u`; what they print must not get into the list of variables.
        script = f"set -e; . {shlex.quote(str(preamble))} >&2; env -0"
        done = subprocess.run(["bash", "-c", script], capture_output=True, text=True, errors="replace", stdin=subprocess.DEVNULL,
                              timeout=120, check=False)
        if done.returncode:
            last = done.stderr.strip().splitlines()[-1:] or [f"exit code {done.returncode}"]
            raise DembarkError(f"{preamble} fails", last[0], "mend it, or try it in a shell")
        variables = dict(entry.split("=", 1) for entry in done.stdout.split("\0") if "=" in entry)
        return variables | {PREAMBLE_VARIABLE: str(preamble)}


def find(name: str) -> ExecutorProfile:
    """The profile `local`, `slurm`, or that of a folder with a config.yaml; DembarkError for anything else or a mistake in it."""
    if name in _SHIPPED:
        return load(Path(__file__).with_name(name))
    if not (Path(name) / CONFIGURATION).is_file():
        raise DembarkError(f"--executor {name} is neither local, nor slurm, nor the folder of a Snakemake profile", nearest(name, _SHIPPED),
                           f"a profile is a folder with a {CONFIGURATION}, such as a copy of {Path(__file__).with_name('site')}")
    return load(Path(name))


def load(folder: Path) -> ExecutorProfile:
    """Read and check `folder`/config.yaml; DembarkError says in one line what is wrong."""
    path = folder.resolve() / CONFIGURATION
    try:
        settings = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, yaml.YAMLError) as error:
        raise DembarkError(f"{path} cannot be read", str(error)) from None
    if not isinstance(settings, dict):
        raise DembarkError(f"{path} holds no keys", "", "write 'executor: slurm' and so on, one a line")
    _check(path, settings)
    return ExecutorProfile(path.parent, settings)


def _check(path: Path, settings: Mapping[str, Any]) -> None:
    for key in ("groups", "group-components"):
        if key in settings:
            # A group asks for the sum of its jobs' times; when sbatch refuses that, no error reaches the user.
            raise DembarkError(f"{key} in {path}", "jobs in groups may be rejected by sbatch without a word", "take it away")
    defaults = settings.get("default-resources") or {}
    if not isinstance(defaults, dict):
        raise DembarkError(f"default-resources in {path}", repr(defaults), "one 'name: value' a line below it")
    for key, value in [*settings.items(), *defaults.items()]:
        if isinstance(value, str) and value.startswith("<") and value.endswith(">"):
            raise DembarkError(f"{key}: {value} in {path}", "is a place for your own value", "fill it in, or take the line away")
