"""Kills a run of the debarking drum a little after half-way and lets it go on from its last saved state; compares it with one left alone.

    python -m benchmarks.drum_resume [--engine liggghts|yade] [--restart-every steps] [--out result.json] [key=value ...]

The default is 200 logs for five revolutions. The engine gets SIGKILL, so nothing it has in memory survives. Compared are, byte for byte,
`time.csv` (energies, forces and totals over the run), `impacts.txt` (one line per impact) and `grains.dump` (the last revolution).
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from dembark.common.choices import Value
from dembark.validation import engines
from dembark.validation.case import deck
from dembark.validation.case.folders import find
from dembark.validation.case.resolve import portable, resolve, settings
from dembark.validation.runs.restarts import newest

FILES = ("time.csv", "impacts.txt", "grains.dump")
DEFAULTS: dict[str, Value] = {"run_in": 0}
RESTART_EVERY = 16100
CERTIFICATE = 1e-10


class Started:
    """A run with the `values` in `folder`, in a process of its own, with `words` such as restart_every; its output goes to engine.log."""

    def __init__(self, engine_name: str, folder: Path, values: Mapping[str, Value], **words: Value) -> None:
        engine, case = engines.find(engine_name), find("debarking_drum")
        self.folder = folder
        self.setup = deck.write(case, engine_name, portable(resolve(case, changes=values)), folder)
        self.log = (folder / "engine.log").open("ab")
        self.process = subprocess.Popen(engine.command(folder / engine.facts.deck, words), cwd=folder, env=engine.environment(),
                                        stdin=subprocess.DEVNULL, stdout=self.log, stderr=subprocess.STDOUT)

    def wait(self) -> None:
        """Until it ends; RuntimeError with its last lines if it failed."""
        code = self.process.wait()
        self.log.close()
        said = (self.folder / "engine.log").read_text(errors="replace")
        if code or "dembark: finished" not in said:
            raise RuntimeError(f"the engine ended with code {code} in {self.folder}:\n{said[-1500:]}")

    def kill_at(self, step: int) -> int:
        """SIGKILL as soon as `time.csv` has a row of `step` or later; the step of its last row, 0 if the run was over before."""
        while self.process.poll() is None:
            if (reached := last_step(self.folder)) >= step:
                self.process.kill()
                self.process.wait()
                self.log.close()
                return reached
            time.sleep(0.01)
        self.log.close()
        return 0


def last_step(folder: Path) -> int:
    """Step of the last complete row of `time.csv`; 0 when there is none."""
    try:
        rows = (folder / "time.csv").read_text().split("\n")[1:-1]
    except OSError:
        return 0
    return int(rows[-1].split(",", 1)[0]) if rows else 0


def compare(engine: str, values: Mapping[str, Value], restart_every: int, base: Path) -> dict[str, Any]:
    """Both runs in folders below `base`; what was found, with `same` telling for each file whether it is the same to the byte."""
    complete, broken = base / "complete", base / "broken"
    for folder in (complete, broken):
        folder.mkdir(parents=True)
    began = time.monotonic()
    run = Started(engine, complete, values, restart_every=restart_every)
    run.wait()
    seconds, steps = time.monotonic() - began, run.setup.steps
    # Not at a saved state: what came after the last one is lost and has to come again.
    killed = Started(engine, broken, values, restart_every=restart_every).kill_at(steps * 11 // 20)
    if not killed:
        raise RuntimeError("the run ended before it could be killed; take a longer one")
    went_on_from = newest(broken, engine)
    (broken / "engine.log").unlink()
    Started(engine, broken, values, restart_every=restart_every, resume="yes").wait()
    table = np.genfromtxt(complete / "time.csv", delimiter=",", names=True)
    return {
        "engine": engine,
        "values": {**values, "restart_every": restart_every},
        "steps": steps,
        "killed_at_step": killed,
        "went_on_from": went_on_from,
        "wall_time": seconds,
        "certificate_max": float(table["certificate"][-1]),
        "impacts": int(table["begun"][-1]),
        "same": {name: (complete / name).read_bytes() == (broken / name).read_bytes() for name in FILES},
    }


def main(words: list[str]) -> int:
    """Exit code 0 when every file is the same and the certificate holds in every step."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--engine", action="append", choices=("liggghts", "yade"), help="default: both")
    parser.add_argument("--restart-every", type=int, default=RESTART_EVERY, help="steps between saved states; default: half a revolution")
    parser.add_argument("--out", type=Path, help="file for the findings as JSON")
    parser.add_argument("values", nargs="*", help="key=value of the case, as in case.toml")
    options = parser.parse_args(words)
    given = settings(options.values)
    found = []
    for engine in options.engine or ("liggghts", "yade"):
        with tempfile.TemporaryDirectory(prefix="dembark-resume-") as folder:
            found.append(compare(engine, DEFAULTS | given, options.restart_every, Path(folder)))
        print(json.dumps(found[-1], indent=1), flush=True)
    if options.out:
        options.out.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    return int(not all(all(one["same"].values()) and one["certificate_max"] <= CERTIFICATE for one in found))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
