"""Timed runs of the engines on the settled bed, one after the other in turn, and the statistics of their ratios."""

from __future__ import annotations

import hashlib
import json
import math
import os
import re
import shutil
import statistics
import subprocess
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from dembark.common.errors import DembarkError, RunError
from dembark.validation.engines import Engine

HERE = Path(__file__).parent


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


@dataclass(frozen=True)
class Sample:
    """Seconds of one timed run: all of it, and the part in the pair forces (LIGGGHTS) or the interaction loop (YADE)."""

    loop: float
    pair: float


@dataclass
class Subject:
    """One combination of models and how to take a sample of it; the first of a comparison is the reference."""

    name: str
    take: Callable[[], Sample]
    samples: list[Sample] = field(default_factory=list)


@dataclass
class Comparison:
    """Subjects that are sampled in turn, A B C A B C ...; `goal` is the largest ratio of pair times asked of the subject so named."""

    title: str
    subjects: list[Subject]
    steps: int
    goals: dict[str, float] = field(default_factory=dict)

    def run(self, rounds: int, say: Callable[[str], None]) -> None:
        """Take a sample of each subject in each of `rounds`."""
        for turn in range(rounds):
            # Every second round runs backwards, so that a machine that slows down steadily favours nobody.
            for subject in self.subjects if turn % 2 == 0 else reversed(self.subjects):
                say(f"{self.title}: round {turn + 1} of {rounds}, {subject.name}")
                subject.samples.append(subject.take())

    def rows(self) -> list[dict[str, Any]]:
        """One entry a subject: times, and ratios to the reference's sample of the same round."""
        reference = self.subjects[0].samples
        result = []
        for subject in self.subjects:
            row: dict[str, Any] = {"comparison": self.title, "subject": subject.name, "steps": self.steps}
            for part in ("pair", "loop"):
                times = [getattr(sample, part) for sample in subject.samples]
                row[part] = spread(times)
                row[f"{part}_ratio"] = spread([a / getattr(b, part) for a, b in zip(times, reference, strict=True)])
            goal = self.goals.get(subject.name)
            row["goal"] = goal
            row["met"] = None if goal is None else row["pair_ratio"]["median"] <= goal
            result.append(row)
        return result


def spread(values: Sequence[float]) -> dict[str, float]:
    """Median, least and greatest of `values`, and how many they are."""
    return {"median": statistics.median(values), "min": min(values), "max": max(values), "count": len(values)}


def read_log(text: str) -> Sample:
    """The last run in a LIGGGHTS log; RunError when there is none."""
    loops = re.findall(r"^Loop time of (\S+) on ", text, re.MULTILINE)
    pairs = re.findall(r"^Pair  time \(%\) = (\S+) ", text, re.MULTILINE)
    if not loops or len(loops) != len(pairs):
        errors = re.findall(r"^ERROR.*$", text, re.MULTILINE)
        raise RunError("LIGGGHTS did not finish a timed run", errors[-1] if errors else "its log holds no timings")
    return Sample(float(loops[-1]), float(pairs[-1]))


def read_lammps(text: str, wall_clock: bool) -> Sample:
    """The last run of LAMMPS with `timer full`, elapsed or processor time; RunError when there is none."""
    loops = re.findall(r"^Loop time of (\S+) on .*\n\n(?:Performance.*\n)?(\S+)% CPU use", text, re.MULTILINE)
    pairs = re.findall(r"^Pair +\| \S+ +\| (\S+) +\| \S+ +\| +\S+ \| +(\S+) \|", text, re.MULTILINE)
    if not loops or len(loops) != len(pairs):
        errors = re.findall(r"^ERROR.*$", text, re.MULTILINE)
        raise RunError("LAMMPS did not finish a timed run", errors[-1] if errors else "its output holds no timings")
    return Sample(*(float(time) * (1.0 if wall_clock else 0.01 * float(part)) for time, part in (loops[-1], pairs[-1])))


def stock_liggghts() -> Path:
    """The stock engine; DembarkError when there is none."""
    found = os.environ.get("STOCK_LIGGGHTS") or shutil.which("liggghts")
    if not found:
        raise DembarkError("stock liggghts not found", "on PATH", "install Debian's package liggghts or set STOCK_LIGGGHTS")
    return Path(found)


def clock_library(cache: Path) -> Path:
    """The shared object that makes MPI's timer a processor-time clock, compiled once."""
    library, source = cache / "cpu_clock.so", HERE / "cpu_clock.c"
    if not library.exists() or library.stat().st_mtime < source.stat().st_mtime:
        subprocess.run(["cc", "-O2", "-shared", "-fPIC", str(source), "-o", str(library)], check=True)
    return library


def _call(words: Sequence[str], folder: Path, environment: dict[str, str]) -> subprocess.CompletedProcess[str]:
    # On one core: the other one is for whatever else the machine does.
    pinned = ["taskset", "--cpu-list", str(max(os.sched_getaffinity(0)))] if shutil.which("taskset") else []
    return subprocess.run([*pinned, *words], cwd=folder, env=environment, capture_output=True, text=True, errors="replace",
                          stdin=subprocess.DEVNULL, check=False)


def liggghts_sample(program: Path, bed: Bed, variables: dict[str, object], environment: dict[str, str]) -> Sample:
    """Run replay.in with `variables` under `program` in a scratch folder."""
    given = [word for key, value in {**bed.variables, "diameter": bed.diameter, **variables}.items() for word in ("-var", key, str(value))]
    with tempfile.TemporaryDirectory(prefix="dembark-bench-") as name:
        folder = Path(name)
        done = _call([str(program), "-in", str(HERE / "replay.in"), "-log", "log", *given], folder, environment)
        log = folder / "log"
        text = log.read_text(encoding="utf-8", errors="replace") if log.exists() else done.stdout + done.stderr
        if done.returncode:
            text = re.sub(r"^Loop time.*$", "", text, flags=re.MULTILINE)
        return read_log(text)


def lammps_sample(engine: Engine, bed: Bed, variables: dict[str, object], wall_clock: bool) -> Sample:
    """Run replay_lammps.in with `variables`; the stock style is one of the same program."""
    given = [word for key, value in {**bed.variables, **variables}.items() for word in ("-var", key, str(value))]
    with tempfile.TemporaryDirectory(prefix="dembark-bench-") as name:
        words = [str(engine.executable), "-in", str(HERE / "replay_lammps.in"), "-log", "none", *given]
        done = _call(words, Path(name), engine.environment())
    text = done.stdout + done.stderr
    return read_lammps(re.sub(r"^Loop time.*$", "", text, flags=re.MULTILINE) if done.returncode else text, wall_clock)


def yade_sample(engine: Engine, bed: Bed, law: str, relax: int, steps: int, loop: str = "InteractionLoop") -> Sample:
    """One timed run of yade_bed.py with contact law `law` (`stock`, `dembark`, or a pre-sliding curve of it) in an engine `loop`."""
    words = [str(engine.executable), "-j1", "-n", "-x", str(HERE / "yade_bed.py")]
    with tempfile.TemporaryDirectory(prefix="dembark-bench-") as name:
        done = _call([*words, f"bed={bed.path}", f"width={bed.width}", f"step={bed.step}", f"law={law}", f"loop={loop}",
                      f"relax={relax}", f"steps={steps}", "samples=1"], Path(name), engine.environment())
    lines = [line for line in done.stdout.splitlines() if line.startswith("{")]
    if done.returncode or not lines:
        last = (done.stderr or done.stdout).strip().splitlines()[-1:] or ["it says nothing"]
        raise RunError(f"YADE ended with exit code {done.returncode} in the benchmark of law {law}", last[0])
    found = json.loads(lines[-1])
    if not found["contacts"]:
        raise RunError(f"the bed in YADE has no contacts under law {law}", "the grains have left it")
    return Sample(found["loop"], found["pair"])


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


def settled_bed(cache: Path, count: int, say: Callable[[str], None], ratio: float = 1.0) -> Bed:
    """Data file of `count` settled spheres, made by stock LIGGGHTS once and kept in `cache`."""
    deck = HERE / "settle.in"
    bed, variables = bed_of(count, ratio)
    key = hashlib.sha256(deck.read_bytes() + repr(variables).encode()).hexdigest()[:12]
    target = cache / f"bed-{key}.data"
    bed = replace(bed, path=target)
    if target.exists():
        return bed
    say(f"settling {count} spheres with stock LIGGGHTS, once (2-3 minutes)")
    with tempfile.TemporaryDirectory(prefix="dembark-bench-") as name:
        folder = Path(name)
        words = [str(stock_liggghts()), "-in", str(deck), "-log", "log"]
        _call([*words, *(word for key, value in variables.items() for word in ("-var", key, str(value)))], folder, dict(os.environ))
        dump = folder / "bed.dump"
        if not dump.exists():
            raise RunError("stock LIGGGHTS did not settle the bed", "see benchmarks/settle.in")
        rows = dump.read_text(encoding="utf-8").splitlines()[9:]
    if len(rows) != count:
        raise RunError(f"only {len(rows)} of {count} spheres are in the settled bed")
    top = variables.get("top", 0.5)
    lines = ["settled bed", "", f"{count} atoms", "1 atom types", "", f"0 {bed.width} xlo xhi", f"0 {bed.width} ylo yhi",
             f"{-bed.diameter} {top} zlo zhi", "", "Atoms", ""]
    for row in rows:
        number, radius, *place = row.split()
        lines.append(f"{number} 1 {2.0 * float(radius)!r} 2500 {' '.join(place)}")
    part = target.with_suffix(".part")
    part.write_text("\n".join(lines) + "\n", encoding="utf-8")
    part.replace(target)
    return bed
