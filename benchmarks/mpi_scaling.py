"""Time, memory and messages by number of grains and MPI ranks (LIGGGHTS, LAMMPS) or threads (YADE): `python -m benchmarks.mpi_scaling`.

Scenes are a settled bed, periodic sideways, and a slice of a long drum in which grains flow; larger ones are the same repeated along
their periods. What counts is processor time of the loop over the steps, so that other work on the machine enters little. More ranks than
this machine has cores are counted, not timed: grains, halo and messages. A model fitted to the samples says what other numbers need.
"""

from __future__ import annotations

import argparse
import io
import json
import math
import os
import sys
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cache, partial
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd

from benchmarks import frame
from benchmarks.beds import Bed, account, keep, pinned, run_deck, run_yade, settled_bed, with_clock
from benchmarks.frame import Sample
from benchmarks.scaling_model import Array, Model, Network
from dembark.common.errors import DembarkError
from dembark.common.units import duration, size_text
from dembark.validation.engines import call, find

# Grains of what is repeated: a bed 20 grains high on a square base of this width (m), and a drum twice as long, of that radius.
TILE, BASE = 2500, 0.05
SLICE = 4 * TILE
# Of the drum: rad/s, at a Froude number of 0.05, and the steps after which grains flow, a radian.
SPEED, TURNING = 2.2, 22000
HEADS = ("scene", "engine", "grains", "ranks", "steps", "grain-steps / (s rank)", "least-greatest", "speed-up", "1e6 steps take",
         "memory a grain", "halo / own", "sent a step", "imbalance")
FITTED = ("scene", "engine", "t_grain / ns", "t_halo / ns", "t_step / us", "B a grain or copy", "B of a rank", "messages", "B a copy sent",
          "deviation in time", "memory", "halo", "largest size from smaller ones: time", "memory")
PREDICTED = ("scene", "engine", "grains", "ranks", "halo / own", "memory of a rank", "ms a step", "1e6 steps take", "efficiency",
             "of it between nodes")
_DECKS = {"liggghts": "replay.in", "lammps": "replay_lammps.in"}
# Work of a sample over that of LIGGGHTS.
_SHARE = {"liggghts": 1.0, "lammps": 1.0, "yade": 0.1}
# Numbers of a data file's row after id, type, diameter and density, and of a row of velocities.
_PLACES, _STATE = list("xyz"), ["vx", "vy", "vz", "wx", "wy", "wz"]


@dataclass(frozen=True)
class Point:
    """Grains of a scene in an engine on `cores` cores (ranks or threads), and its timed steps; 0 where it is only counted."""

    scene: str
    engine: str
    grains: int
    cores: int
    steps: int

    @property
    def name(self) -> str:
        """For people."""
        return f"{self.scene}, {self.engine}, {self.grains} grains, {self.cores} cores"

    def sample(self, relax: int, options: dict[str, object], wall_clock: bool) -> Sample:
        """Seconds of a core, particle-steps per second and core, and what ranks account for; `options` are variables of the decks."""
        engine, bed = find(self.engine), bed_of(self.scene, self.grains)
        if self.engine == "yade":
            seconds = run_yade(engine, bed, "dembark", max(1, relax // 10), self.steps, threads=self.cores)["loop"] / self.cores
            return {"loop": seconds, "rate": self.grains * self.steps / (seconds * self.cores)}
        steps = {"relax": relax, "steps": self.steps or relax}
        words = [*(engine.launcher(self.cores) if self.cores > 1 else pinned()), *with_clock(wall_clock)]
        found = dict(run_deck([*words, engine.executable], _DECKS[self.engine], variables(self.engine, bed) | steps | options,
                              engine.environment(), wall_clock))
        every = sum(steps.values())
        return found | {"rate": self.grains * self.steps / (found["loop"] * self.cores), "messages": found["messages"] / every,
                        "bytes": found["bytes"] / every, "program": program(self.engine, self.cores)}


@cache
def program(engine_name: str, ranks: int) -> float:
    """Peak memory (B) of a rank without grains."""
    engine = find(engine_name)
    with tempfile.TemporaryDirectory(prefix="dembark-bench-") as name:
        call([*(engine.launcher(ranks) if ranks > 1 else []), *with_clock(), engine.executable, "-in", "/dev/null", "-log", "none"],
             Path(name), {**engine.environment(), "RANKS": name})
        return account(Path(name))["resident"]


def variables(engine: str, bed: Bed) -> dict[str, object]:
    """Of the decks, for a bed or a drum."""
    if not bed.drum:
        return bed.variables | {"tangential": "finnie_rabinowicz"} if engine == "liggghts" else bed.variables | {"style": "dembark"}
    turning = {"boundary": "f f p", "grid": "1 1 *", "down": "0 -1 0", "damping": 0}
    if engine == "liggghts":
        wall = {"tangential": "finnie_rabinowicz", "wall": f"zcylinder {bed.drum} 0 0 shear x {SPEED}"}
    else:
        wall = {"style": "dembark", "wall": f"cylinder z 0 0 {bed.drum} INF INF side in",
                "motion": f"motion rotation point 0 0 0 axis 0 0 1 rate {SPEED}"}
    return bed.variables | turning | wall


def read_grains(path: Path) -> tuple[Array, pd.DataFrame]:
    """Lower and upper ends (3, 2) of the box of a data file, and its grains in the order of the file."""
    lines = path.read_text(encoding="utf-8").splitlines()
    box, count = np.array([line.split()[:2] for line in lines[5:8]], float), int(lines[2].split()[0])
    grains = pd.DataFrame([line.split()[2:] for line in lines[11:11 + count]], columns=["diameter", "density", *_PLACES], dtype=float)
    moving = [line.split()[1:] for line in lines[14 + count:]]
    return box, grains.join(pd.DataFrame(moving, columns=_STATE, dtype=float)) if moving else grains


def write_grains(path: Path, box: Array, grains: pd.DataFrame) -> None:
    """A data file of `grains`, with velocities if they have them."""
    rows = grains.set_axis(range(1, len(grains) + 1)).assign(type=1, density=2500)
    text = io.StringIO()
    print("grains\n", f"{len(rows)} atoms", "1 atom types\n", sep="\n", file=text)
    print("\n".join(f"{low:.17g} {high:.17g} {axis}lo {axis}hi" for (low, high), axis in zip(box, _PLACES, strict=True)), file=text)
    for head, columns in (("Atoms", ["type", "diameter", "density", *_PLACES]), ("Velocities", _STATE)):
        if set(columns) <= set(rows):
            text.write(f"\n{head}\n\n")
            rows[columns].to_csv(text, sep=" ", header=False, float_format="%.17g")
    keep(path, text.getvalue())


def tiled(box: Array, grains: pd.DataFrame, times: tuple[int, int, int]) -> tuple[Array, pd.DataFrame]:
    """Box and grains, repeated that often along each axis; the box has to begin at 0 where it is repeated."""
    size = box[:, 1] - box[:, 0]
    tiles = [grains.assign(**{axis: grains[axis] + shift * length for axis, shift, length in zip(_PLACES, place, size, strict=True)})
             for place in np.ndindex(times)]
    return np.column_stack((box[:, 0], box[:, 0] + size * times)), pd.concat(tiles, ignore_index=True)


def drum_of(bed: Bed) -> Bed:
    """A drum about z, as long as twice the width of `bed`, of that radius too, with SLICE grains that flow. It is made once and kept."""
    drum = replace(bed, path=bed.path.with_name(f"{bed.path.stem}-drum.data"), drum=2.0 * bed.width)
    if drum.path.exists():
        return drum
    frame.say(f"turning a drum with {SLICE} grains, once (2-3 minutes)")
    box, grains = tiled(*read_grains(bed.path), (4, 2, 1))
    # What was up is y, what was across is x.
    grains = grains.assign(x=grains["x"] - drum.drum, y=grains["z"] - drum.drum, z=grains["y"])
    inside = grains[np.hypot(grains["x"], grains["y"]) <= drum.drum - 0.5 * drum.diameter]
    half = drum.drum + drum.diameter
    first = replace(drum, path=drum.path.with_suffix(".first"))
    write_grains(first.path, np.array([[-half, half], [-half, half], box[1]]), inside.nsmallest(SLICE, "y"))
    engine = find("liggghts")
    with tempfile.TemporaryDirectory(prefix="dembark-bench-") as name:
        kept = Path(name, "grains.dump")
        turn = {"relax": 0, "steps": TURNING, "keep": 1, "kept": kept}
        run_deck([*pinned(), engine.executable], "replay.in", variables("liggghts", first) | turn, engine.environment())
        rows = pd.read_csv(kept, sep=" ", skiprows=9, header=None, usecols=range(11), names=["id", "diameter", *_PLACES, *_STATE])
    write_grains(drum.path, read_grains(first.path)[0], rows)
    first.path.unlink()
    return drum


def bed_of(scene: str, grains: int) -> Bed:
    """The bed or drum of `grains`."""
    smallest = SLICE if scene == "drum" else TILE
    count, rest = divmod(grains, smallest)
    if rest or not count:
        raise DembarkError(f"--grains {grains} do not fill a {scene}", "", f"give a multiple of {smallest}")
    base = settled_bed(TILE, base=BASE)
    one = drum_of(base) if scene == "drum" else base
    across = next(k for k in range(math.isqrt(count), 0, -1) if count % k == 0)
    times = (1, 1, count) if scene == "drum" else (count // across, across, 1)
    if count == 1:
        return one
    target = one.path.with_name(f"{one.path.stem}-{'x'.join(map(str, times))}.data")
    if not target.exists():
        write_grains(target, *tiled(*read_grains(one.path), times))
    return replace(one, path=target)


def cells(points: Iterable[Point], samples: pd.DataFrame) -> list[list[str]]:
    """Cells of the table: medians, with the speed-up over one core of the same engine and scene where that was measured."""
    points = list(points)
    middle = samples.groupby("subject").median(numeric_only=True)
    rates = samples.groupby("subject")["rate"].agg(["min", "max"])
    alone = {(point.scene, point.engine, point.grains): middle.loc[point.name, "rate"] for point in points if point.cores == 1}
    table = []
    for point in points:
        row, (low, high) = middle.loc[point.name], rates.loc[point.name]
        one = alone.get((point.scene, point.engine, point.grains))
        timed = [f"{row['rate']:.3g}", f"{low:.3g}-{high:.3g}", f"{row['rate'] * point.cores / one:.2f}" if one else "",
                 duration(1e6 * point.grains / (row["rate"] * point.cores))] if point.steps else [""] * 4
        ranks = ["", "", "", ""]
        if point.engine in _DECKS:
            sent = f"{row['messages']:.1f} x {size_text(row['bytes'] / row['messages'])}" if row["messages"] else "none"
            ranks = [size_text((row["resident"] - row["program"]) / row["own"]), f"{row['halo'] / row['own']:.3f}", sent,
                     f"{row['most'] / row['own']:.3f}"]
        table.append([point.scene, point.engine, str(point.grains), str(point.cores), str(point.steps or "counted"), *timed, *ranks])
    return table


def model_of(scene: str, samples: pd.DataFrame, alone: pd.DataFrame) -> Model:
    """The model of `samples` of a scene in one engine, with those of one rank `alone`."""
    bed = bed_of(scene, SLICE)
    size = np.ptp(read_grains(bed.path)[0], axis=1)
    over = size[2:] if scene == "drum" else size[:2]
    return Model.of(samples, alone, SLICE * float(np.prod((bed.diameter + bed.skin) / over)), len(over))


def fitted(known: pd.DataFrame) -> tuple[dict[tuple[str, str], Model], list[list[str]]]:
    """Models by scene and engine, of which two sizes and several ranks were measured, and their rows of the table."""
    models, table = {}, []
    for (scene, engine), samples in known[known["engine"].isin(_DECKS)].groupby(["scene", "engine"], sort=False):
        alone = known[(known["engine"] == engine) & (known["cores"] == 1)]
        sizes = sorted(samples["grains"].unique())
        if len(sizes) < 2 or samples["cores"].nunique() < 2 or alone.empty:
            continue
        model = models[scene, engine] = model_of(scene, samples, alone)
        off, smaller = model.deviations(samples), samples["grains"] < sizes[-1]
        blind = model_of(scene, samples[smaller], alone[alone["grains"] < sizes[-1]]).deviations(samples[~smaller])
        numbers = [(model.own.at(1.0), 1e9), (model.halo.at(1.0, 0.0), 1e9), (model.halo.at(0.0, 1.0), 1e6),
                   (model.memory.at(1.0, 0.0), 1.0)]
        table.append([scene, engine, *(f"{number.value * scale:.3g} +- {number.half * scale:.2g}" for number, scale in numbers),
                      size_text(model.program + model.memory.at(0.0, 1.0).value), f"{model.messages:.2f}", f"{model.message:.3g}",
                      *(f"{100.0 * found[name]:+.1f} %" for found, names in ((off, off), (blind, ("time", "memory"))) for name in names)])
    return models, table


def predicted(models: Mapping[tuple[str, str], Model], grains: Sequence[float], ranks: Sequence[int], network: Network) -> list[list[str]]:
    """Rows of the table of what `grains` on `ranks`, all between nodes, need; balanced."""
    table = []
    for (scene, engine), model in models.items():
        for count, number in product(grains, ranks):
            own = count / number
            halo = model.copies(own)
            inside, between = model.step(own, halo), model.between_nodes(halo, number, network)
            memory, total = model.resident(own, halo, count), inside.value + between
            table.append([scene, engine, f"{count:.3g}", str(number), f"{halo / own:.2f}",
                          f"{size_text(memory.value)} +- {100.0 * memory.half / memory.value:.0f} %",
                          f"{1e3 * total:.3g} +- {1e3 * inside.half:.2g}", duration(1e6 * total),
                          f"{model.own.at(own).value / total:.2f}", f"{between / total:.2f}"])
    return table


def parsed(words: list[str] | None) -> argparse.Namespace:
    """The options of the command line."""
    cores = len(os.sched_getaffinity(0))
    parser = frame.parser("mpi_scaling", __doc__, rounds=3)
    parser.add_argument("--grains", type=float, nargs="+", default=[SLICE, 10 * SLICE], help=f"multiples of {SLICE}")
    parser.add_argument("--ranks", type=int, nargs="+", help="ranks, and threads of YADE; more than there are cores are only counted",
                        default=[2**k for k in range(cores.bit_length()) if 2**k <= cores])
    parser.add_argument("--scene", choices=["bed", "drum"], action="append", help="default: both")
    parser.add_argument("--engine", choices=list(_SHARE), action="append", help="default: LIGGGHTS and LAMMPS")
    parser.add_argument("--relax", type=int, default=100, help="steps before the timed ones (a tenth in YADE)")
    parser.add_argument("--work", type=float, default=4e6, help="particle-steps of a sample (a tenth in YADE)")
    parser.add_argument("--least", type=int, default=10, help="steps of a sample, at least")
    parser.add_argument("--grid", help="how ranks divide the box, such as '1 2 1'; default: across the periods")
    parser.add_argument("--balance", help="LAMMPS: words of fix balance after its group, such as '100 1.05 shift xy 10 1.02'")
    parser.add_argument("--samples", type=Path, nargs="+", help="measure nothing, take those of these .json of earlier runs")
    parser.add_argument("--wall-clock", action="store_true", help="elapsed time, for a machine that does nothing else")
    parser.add_argument("--predict", type=float, nargs="+", default=[1e6, 1e7], help="grains to predict")
    parser.add_argument("--there", type=int, nargs="+", default=[16, 64, 256], help="ranks to predict")
    parser.add_argument("--latency", type=float, default=2e-6, help="of a message between nodes (s)")
    parser.add_argument("--bandwidth", type=float, default=1e9, help="of a rank between nodes (B/s)")
    given = parser.parse_args(words)
    frame.at_least_one(given, "relax", "work", "least")
    for name in ("grains", "ranks", "predict", "there"):
        if min(getattr(given, name)) < 1:
            raise DembarkError(f"--{name} has a number that is too small", "", "give numbers from 1 on")
    return given


def planned(given: argparse.Namespace) -> list[Point]:
    """All points, with as many steps as come to about the same work."""
    cores = len(os.sched_getaffinity(0))

    def steps(engine: str, grains: int) -> int:
        return max(given.least, round(given.work * _SHARE[engine] / grains))

    return [Point(scene, engine, count, number, steps(engine, count) if number <= cores else 0)
            for scene in given.scene or ("bed", "drum") for engine in given.engine or ("liggghts", "lammps")
            for count in map(round, given.grains) for number in sorted(given.ranks)
            if engine in _DECKS or (scene == "bed" and number <= cores)]


def measure(given: argparse.Namespace) -> None:
    """Run, print and write the tables."""
    options: dict[str, object] = {"grid": given.grid} if given.grid else {}
    options |= {"balanced": 1, "balance": given.balance} if given.balance else {}
    if given.samples:
        known = pd.concat([pd.DataFrame(json.loads(path.read_text(encoding="utf-8"))["rows"]) for path in given.samples])
        points = [Point(*row) for row in known[["scene", "engine", "grains", "cores", "steps"]].drop_duplicates().itertuples(index=False)]
    else:
        points = planned(given)
        samples = frame.in_turn("scaling", {point.name: partial(point.sample, given.relax, options, given.wall_clock) for point in points},
                                given.rounds)
        known = samples.merge(pd.DataFrame([{**asdict(point), "subject": point.name} for point in points]), on="subject")
    facts = frame.facts(**{name: find(name).version for name in {point.engine for point in points}},
                        clock="elapsed time" if given.wall_clock else "processor time")
    parts = ["Medians of the samples.", frame.markdown(HEADS, cells(points, known))]
    models, table = fitted(known) if not options else ({}, [])
    if models:
        network = Network(given.latency, given.bandwidth)
        parts += ["Model:", frame.markdown(FITTED, table),
                  f"Prediction for {network.latency:.3g} s a message and {network.bandwidth:.3g} B/s a rank between nodes:",
                  frame.markdown(PREDICTED, predicted(models, given.predict, given.there, network))]
    frame.write(given.out, "mpi_scaling", "Scaling with grains and ranks", parts, known.to_dict("records"), facts)


def main(words: list[str] | None = None) -> int:
    """The exit code is 1 when a run failed, 2 for a mistake of the user."""
    return frame.ended(lambda: measure(parsed(words)))


if __name__ == "__main__":
    sys.exit(main())
