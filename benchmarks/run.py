"""Measure dembark's styles beside the stock ones: `python -m benchmarks.run` (what `make bench` calls)."""

from __future__ import annotations

import argparse
import os
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from benchmarks import lcp
from benchmarks.measure import (
    HERE,
    Bed,
    Comparison,
    Subject,
    clock_library,
    lammps_sample,
    liggghts_sample,
    settled_bed,
    stock_liggghts,
    yade_sample,
)
from dembark.common.errors import DembarkError
from dembark.common.files import write_json
from dembark.validation.engines import absent, find
from dembark.validation.provenance import collect

ROOT = HERE.parent


def say(line: str) -> None:
    """Tell on stderr what goes on."""
    print(f"dembark: {line}", file=sys.stderr, flush=True)


def liggghts_comparisons(bed: Bed, cache: Path, wall_clock: bool, relax: int, steps: int) -> list[Comparison]:
    """Friction law and capillary law beside the stock ones."""
    ours, stock = find("liggghts"), stock_liggghts()
    environment = ours.environment()
    if not wall_clock:
        environment["LD_PRELOAD"] = str(clock_library(cache))

    def subject(name: str, program: Path, tangential: str, cohesion: str = "", settings: str = "limitForce off") -> Subject:
        variables: dict[str, object] = {"tangential": tangential, "settings": settings, "relax": relax, "steps": steps}
        if cohesion:
            variables |= {"wet": 1, "cohesion": cohesion}
        return Subject(name, lambda: liggghts_sample(program, bed, variables, environment))

    law = ours.executable
    return [
        Comparison("LIGGGHTS, dry", [
            subject("history (stock)", stock, "history"),
            subject("finnie_rabinowicz", law, "finnie_rabinowicz"),
            subject("finnie_rabinowicz presliding partial_slip", law, "finnie_rabinowicz", settings="presliding partial_slip"),
        ], steps, {"finnie_rabinowicz": 0.67 if bed.ratio == 1.0 else 1.0}),
        Comparison("LIGGGHTS, wet", [
            subject("history + washino (stock)", stock, "history", "washino/capillary/viscous"),
            subject("history + capillary exact", law, "history", "capillary"),
            subject("history + capillary willett", law, "history", "capillary", "capillary_model willett"),
            subject("finnie_rabinowicz + capillary exact", law, "finnie_rabinowicz", "capillary"),
        ], steps, {"history + capillary exact": 1.0, "history + capillary willett": 1.0}),
    ]


def lammps_comparison(bed: Bed, wall_clock: bool, relax: int, steps: int) -> Comparison:
    """The pair style beside LAMMPS's own with Mindlin's history."""
    engine = find("lammps")

    def subject(name: str, **variables: object) -> Subject:
        return Subject(name, lambda: lammps_sample(engine, bed, {**variables, "relax": relax, "steps": steps}, wall_clock))

    # Bridges of V/R^3 = 1e-3, of grains that have touched; granular has no such bridges, and stands dry beside them.
    wet = {"style": "dembark", "settings": "capillary_model exact surface_tension 0.072",
           "more": "bridge_volume 1.5625e-11 contact_angle 0"}
    return Comparison("LAMMPS", [
        subject("granular, tangential mindlin (stock)", style="stock"),
        subject("dembark/granular", style="dembark"),
        subject("dembark/granular presliding partial_slip", style="dembark", settings="presliding partial_slip"),
        subject("dembark/granular capillary_model exact", **wet),
    ], steps, {"dembark/granular": 0.6})


def yade_comparison(bed: Bed, relax: int, steps: int) -> Comparison:
    """The law beside YADE's own Mindlin law, one thread."""
    engine = find("yade")

    def subject(name: str, law: str, loop: str = "SphereContactLoop") -> Subject:
        return Subject(name, lambda: yade_sample(engine, bed, law, relax, steps, loop))

    return Comparison("YADE, dry", [
        subject("Law2_ScGeom_MindlinPhys_Mindlin (stock)", "stock", "InteractionLoop"),
        subject("Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz", "dembark", "InteractionLoop"),
        subject("the same, SphereContactLoop", "dembark"),
        subject("SphereContactLoop, presliding partial_slip", "partial_slip"),
    ], steps, {"Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz": 1.1, "the same, SphereContactLoop": 0.93})


def texts(row: dict[str, Any]) -> list[str]:
    """Cells of a row as a reader wants them."""
    def times(part: str) -> str:
        return f"{row[part]['median']:.3f} ({row[part]['min']:.3f}-{row[part]['max']:.3f})"

    goal = "" if row["goal"] is None else f"<= {row['goal']:.2f} {'met' if row['met'] else 'MISSED'}"
    return [row["comparison"], row["subject"], times("pair"), times("pair_ratio"), times("loop"), times("loop_ratio"), goal]


HEADS = ["comparison", "models", "pair time / s", "pair ratio", "loop time / s", "loop ratio", "goal (pair)"]


def markdown(rows: list[dict[str, Any]], facts: dict[str, Any]) -> str:
    """The table of all rows and what it was measured with."""
    others = "" if facts["size_ratio"] == 1.0 else f", and others {facts['size_ratio']:g} times as large; each size has half of the volume"
    table = ["| " + " | ".join(HEADS) + " |", "|" + " --- |" * len(HEADS)]
    table += ["| " + " | ".join(texts(row)) + " |" for row in rows]
    return "\n".join([
        "# Cost of dembark's styles beside the stock ones", "",
        (f"{facts['grains']} settled spheres of {facts['diameter']} m{others}; {facts['clock']}; "
         f"median (least-greatest) of {facts['rounds']} rounds in turn; ratios to the reference of the same round."), "", *table, "",
        f"{facts['date']}, {facts['cpu']}, {facts['cores']} cores, load {facts['load']:.1f} before and {facts['load_after']:.1f} after, "
        f"commit {facts['commit'] or 'none'}{' with changes' if facts['dirty'] else ''}, " +
        ", ".join(f"{name} {version}" for name, version in facts["versions"].items() if version) + ".", "",
    ])


def parsed(words: list[str] | None) -> argparse.Namespace:
    """The options of the command line; ends the program when one is wrong."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.run", description=__doc__)
    parser.add_argument("--rounds", type=int, default=5, help="samples of each combination (default %(default)s)")
    parser.add_argument("--count", type=int, default=20000, help="spheres in the bed (default %(default)s)")
    parser.add_argument("--size-ratio", type=float, default=1.0,
                        help="of two sizes of spheres, each with half of the volume (default: one size)")
    parser.add_argument("--steps", type=int, default=400,
                        help="steps of a timed run of LIGGGHTS; a quarter of it in YADE (default %(default)s)")
    parser.add_argument("--relax", type=int, default=1000, help="steps before it, in which histories build up (default %(default)s)")
    parser.add_argument("--only", choices=["dry", "wet", "yade", "lammps", "lcp"], action="append", help="leave the other comparisons out")
    parser.add_argument("--redraw", action="store_true", help="with --only lcp: measure nothing, draw docs/figures/lcp_scaling from --out")
    parser.add_argument("--wall-clock", action="store_true", help="LIGGGHTS's timers as they are; default: processor time")
    parser.add_argument("--out", type=Path, default=ROOT / "results/bench", help="folder of bench.json and bench.md")
    given = parser.parse_args(words)
    if given.redraw and set(given.only or ()) != {"lcp"}:
        raise DembarkError("--redraw", "", "draws the figure of the LCP solver alone: add --only lcp")
    if not 1.0 <= given.size_ratio <= 20.0:
        raise DembarkError("--size-ratio", "", "give a number from 1 to 20")
    if given.size_ratio != 1.0 and "wet" in (given.only or ()):
        raise DembarkError("--size-ratio", "with --only wet", "is for dry beds: bridges of the stock model grow with the spheres")
    if min(given.rounds, given.count, given.steps, given.relax) < 1:
        raise DembarkError("--rounds, --count, --steps and --relax", "", "give whole numbers from 1 on")
    return given


def main(words: list[str] | None = None) -> int:
    """Run, print and write the table; the exit code is 1 when a run failed, 2 when something is missing."""
    try:
        given = parsed(words)
        if given.only and set(given.only) == {"lcp"}:
            if given.redraw:
                lcp.redraw(given.out, ROOT / "docs/figures/lcp_scaling.png")
                return 0
            return lcp.report(lcp.measure(given.out, given.rounds, given.wall_clock, say))
        cache = ROOT / "build/bench"
        cache.mkdir(parents=True, exist_ok=True)
        wanted = given.only or ["dry", *(["wet"] if given.size_ratio == 1.0 else []), "yade", "lcp",
                                *([] if absent(["lammps"]) else ["lammps"])]
        facts = {**collect(find("liggghts")), "date": datetime.now(UTC).isoformat(timespec="seconds"), "load": os.getloadavg()[0],
                 "grains": given.count, "size_ratio": given.size_ratio, "rounds": given.rounds, "relax": given.relax,
                 "clock": "elapsed time" if given.wall_clock else "processor time"}
        bed = settled_bed(cache, given.count, say, given.size_ratio)
        facts["diameter"] = bed.diameter
        dry, wet = liggghts_comparisons(bed, cache, given.wall_clock, given.relax, given.steps)
        comparisons = [each for each, name in ((dry, "dry"), (wet, "wet")) if name in wanted]
        if "yade" in wanted:
            comparisons.append(yade_comparison(bed, max(1, given.relax // 5), max(1, given.steps // 4)))
            facts["versions"] = {**facts["versions"], "yade": find("yade").version}
        if "lammps" in wanted:
            comparisons.append(lammps_comparison(bed, given.wall_clock, given.relax, given.steps))
            facts["versions"] = {**facts["versions"], "lammps": find("lammps").version}
        for comparison in comparisons:
            comparison.run(given.rounds, say)
        rows = [row for comparison in comparisons for row in comparison.rows()]
        facts["load_after"] = os.getloadavg()[0]
        given.out.mkdir(parents=True, exist_ok=True)
        write_json(given.out / "bench.json", {"rows": rows, "provenance": facts})
        (given.out / "bench.md").write_text(markdown(rows, facts), encoding="utf-8")
    except DembarkError as error:
        say(str(error))
        return error.exit_code
    table = Table(*HEADS, title="median (least-greatest)")
    for row in rows:
        table.add_row(*texts(row))
    Console(width=None if sys.stdout.isatty() else 160).print(table)
    say(f"wrote {given.out / 'bench.md'} and bench.json")
    if "lcp" not in wanted:
        return 0
    try:
        return lcp.report(lcp.measure(given.out, given.rounds, given.wall_clock, say))
    except DembarkError as error:
        say(str(error))
        return error.exit_code


if __name__ == "__main__":
    sys.exit(main())
