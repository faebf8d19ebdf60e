"""The settled bed that engines are measured on, and one timed run of an engine."""

from __future__ import annotations

import hashlib
import json
import math
import os
import re
import shutil
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from benchmarks.frame import CACHE, HERE, Sample, say
from dembark.common.errors import DembarkError, RunError
from dembark.validation.engines import Engine, call

# A line of LIGGGHTS's and of LAMMPS's timings: elapsed time, and with `timer full` its share of processor time in per cent.
_LOOPS = (r"^Loop time of (\S+)() on ", r"^Loop time of (\S+) on .*\n\n(?:Performance.*\n)?(\S+)% CPU use")
_PAIRS = (r"^Pair  time \(%\) = (\S+)() ", r"^Pair +\| \S+ +\| (\S+) +\| \S+ +\| +\S+ \| +(\S+) \|")


@dataclass(frozen=True)
class Bed:
    """Settled spheres in a data file: most have the `diameter` (m), the others are `ratio` times as large; the base is `width` (m) wide."""

    path: Path
    diameter: float = 0.005
    ratio: float = 1.0
    width: float = 0.1

    @property
    def step(self) -> float:
        """s; it grows with the diameter, as the time of a contact does."""
        return 0.004 * self.diameter

    @property
    def variables(self) -> dict[str, object]:
        """Of replay.in and replay_lammps.in."""
        return {"bed": self.path, "skin": 0.2 * self.diameter, "step": self.step}


def read_log(text: str, wall_clock: bool = True) -> Sample:
    """`loop` and `pair`, seconds of the last run in a log of LIGGGHTS, or of LAMMPS (elapsed, or processor time); RunError without one."""
    lammps = "MPI task timing breakdown" in text
    loops, pairs = (re.findall(patterns[lammps], text, re.MULTILINE) for patterns in (_LOOPS, _PAIRS))
    if not loops or len(loops) != len(pairs):
        errors = re.findall(r"^ERROR.*$", text, re.MULTILINE)
        raise RunError("the engine did not finish a timed run", errors[-1] if errors else "its log holds no timings")
    loop, pair = (float(time) * (0.01 * float(part) if part and not wall_clock else 1.0) for time, part in (loops[-1], pairs[-1]))
    return {"loop": loop, "pair": pair}


def stock_liggghts() -> Path:
    """The stock engine; DembarkError when there is none."""
    found = os.environ.get("STOCK_LIGGGHTS") or shutil.which("liggghts")
    if not found:
        raise DembarkError("stock liggghts not found", "on PATH", "install Debian's package liggghts or set STOCK_LIGGGHTS")
    return Path(found)


def with_clock() -> list[str]:
    """Words before LIGGGHTS that make MPI's timer a processor-time clock; what does so is compiled once."""
    library, source = CACHE / "cpu_clock.so", HERE / "cpu_clock.c"
    CACHE.mkdir(parents=True, exist_ok=True)
    if not library.exists() or library.stat().st_mtime < source.stat().st_mtime:
        subprocess.run(["cc", "-O2", "-shared", "-fPIC", str(source), "-o", str(library)], check=True)
    return ["env", f"LD_PRELOAD={library}"]


def pinned(cores: int = 1) -> list[str]:
    """Words before a command that bind it to the last `cores` of this process: the others are for whatever else the machine does."""
    chosen = sorted(os.sched_getaffinity(0))[-cores:]
    return ["taskset", "--cpu-list", ",".join(map(str, chosen))] if shutil.which("taskset") else []


def run_deck(program: Sequence[str | Path], deck: str, variables: Mapping[str, object], environment: Mapping[str, str],
             wall_clock: bool = True) -> Sample:
    """One run of a deck of this folder, in a scratch folder, by the words `program`; see `read_log`."""
    words = [word for key, value in variables.items() for word in ("-var", key, str(value))]
    with tempfile.TemporaryDirectory(prefix="dembark-bench-") as name:
        done = call([*program, "-in", HERE / deck, "-log", "log", *words], Path(name), environment, timeout=3600)
        log = Path(name, "log")
        text = log.read_text(encoding="utf-8", errors="replace") if log.exists() else done.stdout + done.stderr
    if done.returncode:
        raise RunError(f"{deck} ended with exit code {done.returncode}", *re.findall(r"^ERROR.*$", text + done.stdout, re.MULTILINE)[-1:])
    return read_log(text, wall_clock)


def run_yade(engine: Engine, bed: Bed, law: str, relax: int, steps: int, loop: str = "InteractionLoop", threads: int = 1) -> Sample:
    """One run of yade_bed.py with contact law `law` (`stock`, `dembark`, or a pre-sliding curve of it) in an engine `loop`."""
    options = {"bed": bed.path, "width": bed.width, "step": bed.step, "law": law, "loop": loop, "relax": relax, "steps": steps,
               "samples": 1}
    words: list[str | Path] = [*pinned(threads), engine.executable, f"-j{threads}", "-n", "-x", HERE / "yade_bed.py"]
    with tempfile.TemporaryDirectory(prefix="dembark-bench-") as name:
        done = call([*words, *(f"{key}={value}" for key, value in options.items())], Path(name), engine.environment(threads), timeout=3600)
    lines = [line for line in done.stdout.splitlines() if line.startswith("{")]
    if done.returncode or not lines:
        last = (done.stderr or done.stdout).strip().splitlines()[-1:] or ["without a message"]
        raise RunError(f"YADE ended with exit code {done.returncode} in the benchmark of law {law}", last[0])
    found = json.loads(lines[-1])
    if not found.pop("contacts"):
        raise RunError(f"the bed in YADE has no contacts under law {law}", "the grains have left it")
    return dict(found)


def bed_of(count: int, ratio: float) -> tuple[Bed, dict[str, object]]:
    """The bed of `count` spheres, without its path, and the variables of settle.in. Of two sizes each has half of the volume."""
    if ratio == 1.0:
        return Bed(Path()), {"count": count}
    large = max(1, round(count / (1.0 + ratio**3)))
    diameter = 0.02 / ratio
    # As wide as it is high, but not narrower than three large ones; spheres fill 0.62 of it.
    volume = math.pi / 6.0 * diameter**3 * (count - large + large * ratio**3) / 0.62
    width = round(max(volume ** (1.0 / 3.0), 0.06), 4)
    high = 4.0 * volume / width**2 + 0.03
    bed = Bed(Path(), diameter, ratio, width)
    return bed, {"count": count, "large": large, "ratio": ratio, "diameter": diameter, "width": width, "high": high, "top": 1.1 * high,
                 "step": bed.step, "steps": round((high / 0.3 + 0.2) / bed.step)}


def settled_bed(count: int, ratio: float = 1.0) -> Bed:
    """Data file of `count` settled spheres, made by stock LIGGGHTS once and kept."""
    deck = HERE / "settle.in"
    bed, variables = bed_of(count, ratio)
    key = hashlib.sha256(deck.read_bytes() + repr(variables).encode()).hexdigest()[:12]
    bed = replace(bed, path=CACHE / f"bed-{key}.data")
    if bed.path.exists():
        return bed
    say(f"settling {count} spheres with stock LIGGGHTS, once (2-3 minutes)")
    with tempfile.TemporaryDirectory(prefix="dembark-bench-") as name:
        words = [word for key, value in variables.items() for word in ("-var", key, str(value))]
        call([*pinned(), stock_liggghts(), "-in", deck, "-log", "log", *words], Path(name), os.environ, timeout=3600)
        dump = Path(name, "bed.dump")
        rows = dump.read_text(encoding="utf-8").splitlines()[9:] if dump.exists() else []
    if len(rows) != count:
        raise RunError(f"{len(rows)} of {count} spheres are in the settled bed", "see benchmarks/settle.in")
    lines = ["settled bed", "", f"{count} atoms", "1 atom types", "", f"0 {bed.width} xlo xhi", f"0 {bed.width} ylo yhi",
             f"{-bed.diameter} {variables.get('top', 0.5)} zlo zhi", "", "Atoms", ""]
    for row in rows:
        number, radius, *place = row.split()
        lines.append(f"{number} 1 {2.0 * float(radius)!r} 2500 {' '.join(place)}")
    keep(bed.path, "\n".join(lines) + "\n")
    return bed


def keep(path: Path, text: str) -> None:
    """Write a bed, complete or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix(".part")
    part.write_text(text, encoding="utf-8")
    part.replace(path)
