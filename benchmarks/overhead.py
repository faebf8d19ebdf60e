"""What `dembark run silo` takes beside its engine: from the command to the table, less the time in which an engine ran.

`python -m benchmarks.overhead` samples the programs in turn and prints and writes medians; `--program before=../other/.venv/bin/dembark`
adds another, as that of an older checkout. With `--replay` the engine is replaced by one that waits as long as a recorded run took and
then copies what that wrote: all processor time is dembark's then, and a machine that is busy otherwise disturbs it less.
"""

from __future__ import annotations

import argparse
import os
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path

from dembark.common.errors import DembarkError, RunError
from dembark.common.files import read_json, write_json

ROOT = Path(__file__).resolve().parents[1]
GOAL = 2.0
_REPLAY = """#!/bin/bash
case "$*" in */dev/null*) echo "LIGGGHTS (Version LIGGGHTS-PUBLIC {version}, replayed)"; exit 0;; esac
number=${{PWD##*/.replica-}}
from={folder}/replica-${{number%%.*}}
sleep {wall}
cp $from/*.dump $from/time.csv .
grep -v resumed $from/engine.log
"""


@dataclass(frozen=True)
class Sample:
    """Seconds: `elapsed` from start to end, of which an `engine` ran, and `processor` time of all processes."""

    elapsed: float
    engine: float
    processor: float

    @property
    def beside(self) -> float:
        """What was not spent waiting for an engine."""
        return self.elapsed - self.engine


def covered(spans: Sequence[tuple[float, float]]) -> float:
    """Length of the union of intervals (begin, end)."""
    total, reach = 0.0, -float("inf")
    for begin, end in sorted(spans):
        total += max(0.0, end - max(begin, reach))
        reach = max(reach, end)
    return total


def engine_time(folder: Path) -> float:
    """Seconds in which at least one engine ran for the replicas in `folder`: each ended when it wrote its last line."""
    spans = []
    for path in folder.glob("replica-*/run.json"):
        end = (path.parent / "engine.log").stat().st_mtime
        spans.append((end - float((read_json(path) or {})["provenance"]["wall_time"]), end))
    return covered(spans)


def take(program: str, words: Sequence[str], environment: Mapping[str, str], out: Path) -> Sample:
    """One run of the command into the folder `out`, which must not be there; RunError when it fails."""
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    done = subprocess.run([program, "run", "silo", "--engine", "liggghts", *words, "--out", str(out)], env=environment,
                          stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
    elapsed, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode:
        raise RunError(f"{program} ended with code {done.returncode}", (done.stderr.strip().splitlines() or [""])[-1])
    return Sample(elapsed, engine_time(out), after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)


def replayer(recorded: Path, folder: Path) -> Path:
    """A program in `folder` that stands for the engine and gives what the replicas in `recorded` wrote."""
    facts = (read_json(recorded / "replica-1/run.json") or {})["provenance"]
    path = folder / "replay"
    path.write_text(_REPLAY.format(version=facts["versions"]["liggghts"], folder=recorded, wall=min(facts["wall_time"], 5.0)))
    path.chmod(0o755)
    return path


def rows(samples: Mapping[str, Sequence[Sample]]) -> list[dict[str, object]]:
    """One entry a program: medians of its samples, and whether the time beside the engine is below the goal."""
    found = []
    for name, each in samples.items():
        beside = statistics.median(one.beside for one in each)
        found.append({"program": name, "beside_engine": beside, "engine": statistics.median(one.engine for one in each),
                      "processor": statistics.median(one.processor for one in each), "met": beside < GOAL,
                      "samples": [asdict(one) for one in each]})
    return found


def main(words: Sequence[str] | None = None) -> int:
    """Command line; 0 when this checkout's program is below the goal, 1 when not, 2 for a mistake."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.overhead", description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--program", action="append", default=[], metavar="NAME=PATH", help="another dembark beside this one")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--grains", type=int, default=400)
    parser.add_argument("--replicas", type=int, default=3)
    parser.add_argument("--replay", action="store_true", help="an engine that only gives what an earlier run wrote")
    parser.add_argument("--out", type=Path, default=ROOT / "build/bench")
    given = parser.parse_args(words)
    programs = {**dict(one.partition("=")[::2] for one in given.program), "now": str(Path(sys.executable).with_name("dembark"))}
    wanted = ["--set", f"grain_count={given.grains}", "--set", f"replicas={given.replicas}"]
    samples: dict[str, list[Sample]] = {name: [] for name in programs}
    try:
        if given.rounds < 1:
            raise DembarkError(f"--rounds {given.rounds}", "", "give 1 or more")
        for path in programs.values():
            if not os.access(path, os.X_OK):
                raise DembarkError(f"there is no program {path}", "in --program", "give NAME=PATH")
        with tempfile.TemporaryDirectory(prefix="dembark-") as name:
            folder, environment = Path(name), dict(os.environ)
            if given.replay:
                take(programs["now"], wanted, environment, folder / "recorded")
                environment["DEMBARK_LIGGGHTS"] = str(replayer(folder / "recorded", folder))
            for turn in range(given.rounds):
                for program in programs if turn % 2 == 0 else reversed(programs):
                    print(f"round {turn + 1} of {given.rounds}, {program}", file=sys.stderr)
                    samples[program].append(take(programs[program], wanted, environment, folder / "run"))
                    shutil.rmtree(folder / "run")
    except DembarkError as error:
        print(f"benchmarks.overhead: {error}", file=sys.stderr)
        return error.exit_code
    table = rows(samples)
    given.out.mkdir(parents=True, exist_ok=True)
    write_json(given.out / "overhead.json", {"at": datetime.now(UTC).isoformat(timespec="seconds"), "words": wanted, "replay": given.replay,
                                             "load": os.getloadavg(), "rows": table})
    for row in table:
        print(f"{row['program']:12} beside the engine {row['beside_engine']:.2f} s, engine {row['engine']:.2f} s, "
              f"processor {row['processor']:.2f} s")
    return 0 if table[-1]["met"] else 1


if __name__ == "__main__":
    sys.exit(main())
