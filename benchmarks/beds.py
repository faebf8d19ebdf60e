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
_SECTIONS = (r"^{} +time \(%\) = (\S+)() ", r"^{} +\| \S+ +\| (\S+) +\| \S+ +\| +\S+ \| +(\S+) \|")
# Grains of a rank, and copies of its neighbours' grains: the mean over the ranks, and the most.
_COUNTS = {"own": r"^Nlocal: +(\S+) ave", "most": r"^Nlocal: .* (\S+) max", "halo": r"^Nghost: +(\S+) ave"}


@dataclass(frozen=True)
class Bed:
    """Settled spheres in a data file: most have the `diameter` (m), the others are `ratio` times as large; the base is `width` (m) wide.
    Or spheres that flow in a drum about z of the radius `drum` (m)."""

    path: Path
    diameter: float = 0.005
    ratio: float = 1.0
    width: float = 0.1
    drum: float = 0.0

    @property
    def step(self) -> float:
        """s; it grows with the diameter, as the time of a contact does."""
        return 0.004 * self.diameter

    @property
    def skin(self) -> float:
        """m, by which grains may move before lists of neighbours are built anew."""
        return 0.2 * self.diameter

    @property
    def variables(self) -> dict[str, object]:
        """Of replay.in and replay_lammps.in."""
        return {"bed": self.path, "skin": self.skin, "step": self.step}


def read_log(text: str, wall_clock: bool = True) -> Sample:
    """Of the last run in a log of LIGGGHTS, or of LAMMPS (elapsed, or processor time): `loop`, `pair` and `comm` in s, and where they are
    there the numbers of grains `own`, `most` and `halo`; RunError without a run."""
    lammps = "MPI task timing breakdown" in text
    patterns = {"loop": _LOOPS[lammps], "pair": _SECTIONS[lammps].format("Pair"), "comm": _SECTIONS[lammps].format("Comm")}
    times = {name: re.findall(pattern, text, re.MULTILINE) for name, pattern in patterns.items()}
    if not times["loop"] or len({len(found) for found in times.values()}) > 1:
        errors = re.findall(r"^ERROR.*$", text, re.MULTILINE)
        raise RunError("the engine did not finish a timed run", errors[-1] if errors else "its log holds no timings")
    last = {name: found[-1] for name, found in times.items()}
    counts = {name: re.findall(pattern, text, re.MULTILINE)[-1:] for name, pattern in _COUNTS.items()}
    return {name: float(time) * (0.01 * float(part) if part and not wall_clock else 1.0) for name, (time, part) in last.items()} | {
        name: float(found[0]) for name, found in counts.items() if found}


def stock_liggghts() -> Path:
    """The stock engine; DembarkError when there is none."""
    found = os.environ.get("STOCK_LIGGGHTS") or shutil.which("liggghts")
    if not found:
        raise DembarkError("stock liggghts not found", "on PATH", "install Debian's package liggghts or set STOCK_LIGGGHTS")
    return Path(found)


def with_clock(wall_clock: bool = False) -> list[str]:
    """Words before an engine with MPI that make its ranks account for themselves, and MPI's timer a processor-time clock unless
    `wall_clock`; what does so is compiled once."""
    library, source = CACHE / "rank.so", HERE / "rank.c"
    CACHE.mkdir(parents=True, exist_ok=True)
    if not library.exists() or library.stat().st_mtime < source.stat().st_mtime:
        subprocess.run(["cc", "-O2", "-shared", "-fPIC", str(source), "-o", str(library)], check=True)
    return ["env", f"LD_PRELOAD={library}", *(["WALL_CLOCK=1"] if wall_clock else [])]


def account(folder: Path) -> Sample:
    """What the ranks under `with_clock` left in `folder`: the highest peak of `resident` memory (B), `messages` and `bytes` of a rank."""
    ranks = [[float(word) for word in path.read_text(encoding="utf-8").split()] for path in folder.glob("rank-*")]
    peaks, messages, sizes = zip(*ranks, strict=True) if ranks else ([0.0], [0.0], [0.0])
    return {"resident": 1024.0 * max(peaks), "messages": sum(messages) / len(messages), "bytes": sum(sizes) / len(sizes)}


def pinned(cores: int = 1) -> list[str]:
    """Words before a command that bind it to the last `cores` of this process: the others are for whatever else the machine does."""
    chosen = sorted(os.sched_getaffinity(0))[-cores:]
    return ["taskset", "--cpu-list", ",".join(map(str, chosen))] if shutil.which("taskset") else []


def run_deck(program: Sequence[str | Path], deck: str, variables: Mapping[str, object], environment: Mapping[str, str],
             wall_clock: bool = True) -> Sample:
    """One run of a deck of this folder, in a scratch folder, by the words `program`; see `read_log` and `account`."""
    words = [word for key, value in variables.items() for word in ("-var", key, str(value))]
    with tempfile.TemporaryDirectory(prefix="dembark-bench-") as name:
        done = call([*program, "-in", HERE / deck, "-log", "log", *words], Path(name), {**environment, "RANKS": name},
                    timeout=7200)
        log, ranks = Path(name, "log"), account(Path(name))
        text = log.read_text(encoding="utf-8", errors="replace") if log.exists() else done.stdout + done.stderr
    if done.returncode:
        raise RunError(f"{deck} ended with exit code {done.returncode}", *re.findall(r"^ERROR.*$", text + done.stdout, re.MULTILINE)[-1:])
    return {**read_log(text, wall_clock), **ranks}


def run_yade(engine: Engine, bed: Bed, law: str, relax: int, steps: int, loop: str = "InteractionLoop", threads: int = 1) -> Sample:
    """One run of yade_bed.py with contact law `law` (`stock`, `dembark`, or a pre-sliding curve of it) in an engine `loop`."""
    options = {"bed": bed.path, "step": bed.step, "law": law, "loop": loop, "relax": relax, "steps": steps,
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


def bed_of(count: int, ratio: float, base: float = 0.1) -> tuple[Bed, dict[str, object]]:
    """The bed of `count` spheres, without its path, and the variables of settle.in. Of one size its base is `base` (m) wide, of two sizes
    each has half of the volume."""
    if ratio == 1.0:
        return Bed(Path(), width=base), {"count": count} | ({"width": base} if base != 0.1 else {})
    large = max(1, round(count / (1.0 + ratio**3)))
    diameter = 0.02 / ratio
    # As wide as it is high, but not narrower than three large ones; spheres fill 0.62 of it.
    volume = math.pi / 6.0 * diameter**3 * (count - large + large * ratio**3) / 0.62
    width = round(max(volume ** (1.0 / 3.0), 0.06), 4)
    high = 4.0 * volume / width**2 + 0.03
    bed = Bed(Path(), diameter, ratio, width)
    return bed, {"count": count, "large": large, "ratio": ratio, "diameter": diameter, "width": width, "high": high, "top": 1.1 * high,
                 "step": bed.step, "steps": round((high / 0.3 + 0.2) / bed.step)}


def settled_bed(count: int, ratio: float = 1.0, base: float = 0.1) -> Bed:
    """Data file of `count` settled spheres, made by stock LIGGGHTS once and kept; see `bed_of`."""
    deck = HERE / "settle.in"
    bed, variables = bed_of(count, ratio, base)
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
