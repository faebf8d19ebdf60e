"""Column collapse: the energies that the engine's account booked, row by row, and the deposit. Energies are in J; works are positive when
they make grains faster. Balances run over all rows of time.csv, shares over the collapse, from the row in which the gate begins to move."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from dembark.input_decks.common import momentum
from dembark.input_decks.common.estimates import over_chaotic
from dembark.input_decks.common.heaps import behind, height, surface
from dembark.input_decks.common.power_law import PowerLawFit, ordered
from dembark.postproc import DumpError, GrainFrame
from dembark.postproc.measurement import Array, Estimate, Measurement, Points, Replica, Replicas, Value, exact, profile

# What takes the energy, with the titles of the curves; liquid does so in wet columns.
WAYS = {"kinetic": "Kinetic energy", "friction": "Dissipated by friction", "normal_viscous": "Dissipated by normal damping",
        "tangential_viscous": "Dissipated by tangential damping", "held": "Elastic energy of springs", "gate": "Work on the gate"}
WET = {"liquid_viscous": "Dissipated in the viscous liquid", "capillary": "Work against liquid bridges"}
DISSIPATING = ("normal_viscous", "tangential_viscous", "liquid_viscous")
# Share of the mass behind the front: single grains roll on after the others have come to rest.
FRONT = 0.98
# Kinetic energy when the gate begins to move, over the potential energy lost from then on, below which the column counts as at rest.
REST = 0.01


@dataclass(frozen=True)
class Collapse:
    """One run: `rows`, the columns of time.csv; `opening`, the row in which the gate begins to move; `first`, `last`: grains then and at
    the end; W and d in m. Shares are those of `fallen`, the potential energy lost since the opening in the last row."""

    rows: Mapping[str, Array]
    opening: int
    first: GrainFrame
    last: GrainFrame
    width: float
    diameter: float

    def gain(self, name: str) -> Array:
        """Change of a column since the opening."""
        return self.rows[name][self.opening :] - self.rows[name][self.opening]

    @property
    def fallen(self) -> float:
        """J."""
        return float(-self.gain("potential_energy")[-1])

    def rests(self) -> bool:
        """Whether the grains are at rest when the gate begins to move."""
        return bool(self.rows["kinetic_energy"][self.opening] < REST * self.fallen)

    def lost_in(self, name: str) -> Array:
        """Share that this way has taken since the opening."""
        takers = {"friction": {"tangential_elastic": -1, "tangential_stored": -1}, "held": {"normal_stored": 1, "tangential_stored": 1},
                  "kinetic": {"kinetic_energy": 1}, "gate": {"walls": -1}, "potential": {"potential_energy": -1}}
        return np.sum([sign * self.gain(column) for column, sign in takers.get(name, {name: -1}).items()], axis=0) / self.fallen

    def potential_error(self, column: str = "potential_energy") -> float:
        """Largest difference between gravity's work since the first row and the potential energy lost, over the largest such work."""
        work, energy = self.rows["gravity"] - self.rows["gravity"][0], self.rows[column]
        return float(np.abs(work + energy - energy[0]).max() / np.abs(work).max())

    def given_back(self) -> float:
        """Largest energy that a dissipating part gave from one row to the next, over the energy turned over; 0 when none ever did."""
        return float(max(np.diff(self.rows[name], prepend=0.0).max() for name in DISSIPATING) / self.rows["scale"][-1])

    def front(self) -> float:
        """m, behind which a share FRONT of the mass lies at the end."""
        return behind(self.last.positions[:, 0], self.last.masses, FRONT)

    def centre(self) -> Array:
        """Centre of mass (3,) of the deposit in m."""
        return np.average(self.last.positions, axis=0, weights=self.last.masses)


def read(replica: Replica) -> Collapse:
    """What was written; DumpError when the first frame has no row in time.csv."""
    frames, rows = replica.grains(), replica.times()
    opening = np.flatnonzero(rows["step"] == frames[0].step)
    if len(opening) != 1 or opening[0] + 1 >= len(rows["step"]):
        raise DumpError(f"{replica.folder}: time.csv has no row at step {frames[0].step}, the first of grains.dump, or none after it")
    p = replica.parameters
    return Collapse(rows, int(opening[0]), frames[0], frames[len(frames) - 1], p["column_width"], p["grain_diameter"])


def shares(runs: Sequence[Collapse], ways: Mapping[str, str]) -> list[dict[str, Any]]:
    """Curves over time of the shares that `ways` have taken, by name with a title."""
    times = [one.gain("time") for one in runs]
    place = np.linspace(0.0, times[0][-1], 101)
    return [profile(name, title, "time since the gate moves (s)", "fraction of the potential energy lost", place,
                    [np.interp(place, time, one.lost_in(name)) for time, one in zip(times, runs, strict=True)])
            for name, title in ways.items()]


def deposits(runs: Sequence[Collapse]) -> dict[str, Any]:
    """Curve of the deposit's surface, with that of the column as its reference."""
    width, edges = runs[0].width, np.arange(0.0, 5.0 * runs[0].width, runs[0].diameter)
    before = np.mean([surface(one.first, edges) for one in runs], axis=0) / width
    return profile("deposit", "Deposit", "x / W", "height / W", 0.5 * (edges[1:] + edges[:-1]) / width,
                   [surface(one.last, edges) / width for one in runs], reference=before, reference_label="when the gate opens")


def run_out_law(aspect: float) -> float | None:
    """(L - W)/W by Lube et al. (2005) for H/W = `aspect`; None between its two branches."""
    return 1.2 * aspect if aspect < 1.8 else 1.9 * aspect ** (2.0 / 3.0) if aspect > 2.8 else None


def height_law(aspect: float) -> float | None:
    """Final height over W of a high column by Lube et al. (2005); None for a low one."""
    return aspect**0.4 if aspect > 2.8 else None


def measure(replicas: Replicas) -> Measurement:
    """Values, curves and remarks from all replicas of a series."""
    runs = [read(replica) for replica in replicas]
    ways = WAYS | (WET if replicas[0].parameters["bridge_volume"] > 0.0 else {})
    resting = all(one.rests() for one in runs)
    raining = "" if resting else "the grains still move when the gate opens: raise settle_time"

    def over(number: Callable[[Collapse], float]) -> Estimate:
        return over_chaotic(number(one) for one in runs)

    def value(number: Callable[[Collapse], float]) -> Value:
        return Value(over(number), reason=raining, compared=resting)

    def share(name: str) -> Value:
        return value(lambda one: float(one.lost_in(name)[-1]))

    def worst(number: Callable[[Collapse], float]) -> Value:
        return Value(exact(np.max([number(one) for one in runs])), exact(0.0))  # of numbers that are none: none

    def with_law(number: Callable[[Collapse], float], law: float | None) -> Value:
        other = "the experiments used sand, sugar and rice between side walls, not rolling spheres"
        return Value(over(number), None if law is None else exact(law), reason=raining or ("" if law is None else other))

    aspect = over(lambda one: height(one.first) / one.width)
    values = {
        "energy_balance": worst(lambda one: momentum.imbalance(one.rows, momentum.BRIDGED_PARTS)),
        "potential_error": worst(Collapse.potential_error),
        "dissipation_sign": worst(Collapse.given_back),
        "step_error": value(lambda one: float(np.abs(one.gain("step_error")).max() / one.fallen)),
        "height_error": Value(over(lambda one: one.potential_error("weight_height"))),
        **{f"{name}_share": share(name) for name in ways},
        "aspect_ratio": Value(aspect, reason=raining, compared=resting),
        "run_out": with_law(lambda one: one.front() / one.width - 1.0, run_out_law(aspect.value)),
        "final_height": with_law(lambda one: float(surface(one.last, np.array([0.0, 2.0 * one.diameter]))[0]) / one.width,
                                 height_law(aspect.value)),
        "mean_run_out": value(lambda one: 2.0 * one.centre()[0] / one.width - 1.0),
        "mean_height": value(lambda one: 2.0 * one.centre()[2] / one.width),
    }
    fallen, turned = 1e3 * np.mean([(one.fallen, one.rows["scale"][-1]) for one in runs], axis=0)
    remarks = [f"The collapse loses {fallen:.4g} mJ of potential energy; the total work of the run, with the rain, is {turned:.4g} mJ."]
    if len(runs) < 3:
        remarks.append("Shares and deposit vary from packing to packing; fewer than three packings do not show by how much.")
    return Measurement(values, [*shares(runs, {"potential": "Potential energy lost"} | ways), deposits(runs)], remarks)


def study(_name: str, points: Points, along: str) -> Measurement:
    """Exponent of the step's energy error, with the interval that those of the errors give it."""
    points, steps = ordered(points, along)
    errors = PowerLawFit.of(points, "step_error", steps)
    listed = ", ".join(f"{error:.2e} at {step:g}" for step, error in zip(steps, errors.values, strict=True))
    return Measurement(
        {"order_step_error": Value(errors.exponent, exact(2.0), detail=f"errors {listed} of the Rayleigh time")},
        [errors.convergence("step_error", "Energy error of the time step", "time step over the Rayleigh time", 2.0)],
        ["Work and kinetic energy balance to round-off at each of these steps; the error shown is that of the time step."])
