"""Measure dembark's contact laws and the stock ones on one settled bed: `python -m benchmarks.run` (what `make bench` calls)."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping
from typing import Any

import pandas as pd

from benchmarks import frame, lcp
from benchmarks.beds import Bed, pinned, run_deck, run_yade, settled_bed, stock_liggghts, with_clock
from benchmarks.frame import Sample, Subjects, spread
from dembark.common.errors import DembarkError
from dembark.validation.engines import absent, find

HEADS = ("comparison", "models", "pair time / s", "pair ratio", "loop time / s", "loop ratio", "goal (pair)")
# The largest ratio of pair times that is aimed at, by subject; of one size of spheres.
GOALS = {"finnie_rabinowicz": 0.67, "history + capillary exact": 1.0, "history + capillary willett": 1.0, "dembark/granular": 0.6,
         "Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz": 1.1, "the same, SphereContactLoop": 0.93}
# Friction law, cohesion and settings by subject; the first of each comparison is the stock model.
LIGGGHTS = {
    "dry": {"history (stock)": ("history", "", ""), "finnie_rabinowicz": ("finnie_rabinowicz", "", ""),
            "finnie_rabinowicz presliding partial_slip": ("finnie_rabinowicz", "", "presliding partial_slip")},
    "wet": {"history + washino (stock)": ("history", "washino/capillary/viscous", ""),
            "history + capillary exact": ("history", "capillary", ""),
            "history + capillary willett": ("history", "capillary", "capillary_model willett"),
            "finnie_rabinowicz + capillary exact": ("finnie_rabinowicz", "capillary", "")}}
# Bridges of V/R^3 = 1e-3, of grains that have touched; granular has no such bridges: its dry contacts are the reference.
LAMMPS = {
    "granular, tangential mindlin (stock)": {"style": "stock"}, "dembark/granular": {"style": "dembark"},
    "dembark/granular presliding partial_slip": {"style": "dembark", "settings": "presliding partial_slip"},
    "dembark/granular capillary_model exact": {"style": "dembark", "settings": "capillary_model exact surface_tension 0.072",
                                               "more": "bridge_volume 1.5625e-11 contact_angle 0"}}
YADE = {
    "Law2_ScGeom_MindlinPhys_Mindlin (stock)": ("stock", "InteractionLoop"),
    "Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz": ("dembark", "InteractionLoop"),
    "the same, SphereContactLoop": ("dembark", "SphereContactLoop"),
    "SphereContactLoop, presliding partial_slip": ("partial_slip", "SphereContactLoop")}


def liggghts(kind: str, bed: Bed, wall_clock: bool, **steps: int) -> Subjects:
    """The table of LIGGGHTS for `kind`, dry or wet."""
    ours, stock = find("liggghts"), stock_liggghts()
    before = [*pinned(), *([] if wall_clock else with_clock())]

    def taken(number: int, tangential: str, cohesion: str, settings: str) -> Callable[[], Sample]:
        variables = {**bed.variables, "diameter": bed.diameter, "tangential": tangential, "settings": settings or "limitForce off", **steps}
        wet = {"wet": 1, "cohesion": cohesion} if cohesion else {}
        return lambda: run_deck([*before, ours.executable if number else stock], "replay.in", variables | wet, ours.environment())

    return {name: taken(number, *models) for number, (name, models) in enumerate(LIGGGHTS[kind].items())}


def lammps(bed: Bed, wall_clock: bool, **steps: int) -> Subjects:
    """The table of LAMMPS; the stock style is one of the same program."""
    engine = find("lammps")

    def taken(variables: Mapping[str, object]) -> Callable[[], Sample]:
        return lambda: run_deck([*pinned(), engine.executable], "replay_lammps.in", {**bed.variables, **variables, **steps},
                                engine.environment(), wall_clock)

    return {name: taken(variables) for name, variables in LAMMPS.items()}


def yade(bed: Bed, relax: int, steps: int) -> Subjects:
    """The table of YADE, one thread."""
    engine = find("yade")

    def taken(law: str, loop: str) -> Callable[[], Sample]:
        return lambda: run_yade(engine, bed, law, max(1, relax // 5), max(1, steps // 4), loop)

    return {name: taken(*models) for name, models in YADE.items()}


def cells(row: Mapping[str, Any]) -> list[str]:
    """A row of the table."""
    goal = GOALS.get(row["subject"])
    reached = "" if goal is None else f"<= {goal:.2f} {'met' if row['pair_ratio_median'] <= goal else 'MISSED'}"
    return [row["comparison"], row["subject"], *(spread(row, part) for part in ("pair", "pair_ratio", "loop", "loop_ratio")), reached]


def parsed(words: list[str] | None) -> argparse.Namespace:
    """The options of the command line."""
    parser = frame.parser("run", __doc__, rounds=5)
    parser.add_argument("--count", type=int, default=20000, help="spheres in the bed (default %(default)s)")
    parser.add_argument("--size-ratio", type=float, default=1.0,
                        help="of two sizes of spheres, each with half of the volume (default: one size)")
    parser.add_argument("--steps", type=int, default=400,
                        help="steps of a timed run of LIGGGHTS; a quarter of it in YADE (default %(default)s)")
    parser.add_argument("--relax", type=int, default=1000, help="steps before it, in which histories build up (default %(default)s)")
    parser.add_argument("--only", choices=["dry", "wet", "yade", "lammps", "lcp"], action="append", help="leave the other comparisons out")
    parser.add_argument("--wall-clock", action="store_true", help="LIGGGHTS's timers as they are; default: processor time")
    given = parser.parse_args(words)
    if not 1.0 <= given.size_ratio <= 20.0:
        raise DembarkError("--size-ratio is out of range", "", "give a number from 1 to 20")
    if given.size_ratio != 1.0 and "wet" in (given.only or ()):
        raise DembarkError("--size-ratio", "with --only wet", "is for dry beds: bridges of the stock model grow with the spheres")
    frame.at_least_one(given, "count", "steps", "relax")
    return given


def measure(given: argparse.Namespace) -> None:
    """Run, print and write the table."""
    wanted = given.only or ["dry", *(["wet"] if given.size_ratio == 1.0 else []), "yade", "lcp",
                            *([] if absent(["lammps"]) else ["lammps"])]
    engines = {"dry": "liggghts", "wet": "liggghts", "yade": "yade", "lammps": "lammps"}
    if comparisons := [name for name in engines if name in wanted]:
        known = frame.facts(**{engines[name]: find(engines[name]).version for name in comparisons}, grains=given.count,
                            size_ratio=given.size_ratio, clock="elapsed time" if given.wall_clock else "processor time", relax=given.relax)
        bed, steps = settled_bed(given.count, given.size_ratio), {"relax": given.relax, "steps": given.steps}
        tables: dict[str, tuple[str, Callable[[], Subjects]]] = {
            "dry": ("LIGGGHTS, dry", lambda: liggghts("dry", bed, given.wall_clock, **steps)),
            "wet": ("LIGGGHTS, wet", lambda: liggghts("wet", bed, given.wall_clock, **steps)),
            "yade": ("YADE, dry", lambda: yade(bed, **steps)), "lammps": ("LAMMPS", lambda: lammps(bed, given.wall_clock, **steps))}
        samples = pd.concat([frame.in_turn(title, subjects(), given.rounds) for title, subjects in map(tables.__getitem__, comparisons)])
        rows = frame.summary(samples.reset_index(drop=True), ("pair", "loop"))
        frame.write(given.out, "bench", "Cost of dembark's styles and of the stock ones", [
            f"Spheres of {bed.diameter} m; median (least-greatest) of {given.rounds} rounds in turn; ratios to the first of each round.",
            frame.markdown(HEADS, map(cells, rows))], rows, known)
    if "lcp" in wanted:
        lcp.measure(given.out, given.rounds, given.wall_clock)


def main(words: list[str] | None = None) -> int:
    """The exit code is 1 when a run failed, 2 when something is missing."""
    return frame.ended(lambda: measure(parsed(words)))


if __name__ == "__main__":
    sys.exit(main())
