"""Runs scenarios in YADE, all of them in one process."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from functools import cache
from pathlib import Path

import numpy as np

from dembark.validation.engines import Engine, call, find
from rig.motion import Motion
from rig.python_driver import prescribed
from rig.scenarios import Scenario

SCRIPT = Path(__file__).parent / "yade_script.py"


@cache
def engine() -> Engine:
    return find("yade")


def run_script(folder: Path, script: Path, *words: str) -> subprocess.CompletedProcess[str]:
    folder.mkdir(parents=True, exist_ok=True)
    command = [*engine().command(script, {}), *words]
    return call(command, folder, engine().environment())


def run_all(cases: Iterable[Scenario], folder: Path, surfaces: Mapping[str, Mapping[str, object]] | None = None) -> dict[str, Motion]:
    """Motions by name; `surfaces`: what stands in for the floor of some cases (`wall_of` in the script)."""
    cases = list(cases)
    folder.mkdir(parents=True, exist_ok=True)
    records = []
    for number, case in enumerate(cases):
        record = asdict(case) | {"prescribed": case.prescribed, "arrays": str(folder / f"path-{number}.npz"),
                                 "surface": (surfaces or {}).get(case.name, {})}
        if case.prescribed:
            position, velocity, spin = prescribed(case)
            np.savez(record["arrays"], position=position, velocity=velocity, spin=spin)
        records.append(record)
    (folder / "cases.json").write_text(json.dumps(records))
    done = run_script(folder, SCRIPT, "cases.json", "out.npz")
    if "rig: finished" not in done.stdout:
        raise RuntimeError((done.stdout + done.stderr)[-3000:])
    results = {}
    with np.load(folder / "out.npz") as stored:
        for case in cases:
            table = stored[case.name]
            bodies = table[:, 1:].reshape(len(table), len(case.grains), 5, 3)
            results[case.name] = Motion(table[:, 0], *(bodies[:, :, k] for k in range(5)))
    return results
