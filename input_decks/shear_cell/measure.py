"""Shear cell: stresses on the plates in steady shear under each load, the yield locus through them, and the stress inside of the layer."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dembark.input_decks.common.estimates import values_and_halves
from dembark.input_decks.common.inside_layer import Inside, inside
from dembark.postproc.measurement import (
    Array,
    Curve,
    Estimate,
    Measurement,
    Replica,
    Replicas,
    Value,
    block_mean,
    exact,
    pooled,
    profile,
)
from dembark.postproc.replica import cached_per_replica
from dembark.postproc.statistics import combined

# Normal stresses over the smallest.
LOADS = (1.0, 2.0, 4.0)
# Glass beads, Jop et al. (2006): friction of slow flow, what fast flow adds, and the inertial number at which half of that is reached.
SLOW, ADDED, HALF_WAY = 0.383, 0.26, 0.279


@dataclass(frozen=True, eq=False)
class Shear:
    """What was measured under one `load` (Pa): stresses on the lower and the upper plate (rows,) in Pa, and the frames."""

    load: float
    lower_normal: Array
    lower_shear: Array
    upper_normal: Array
    upper_shear: Array
    frames: list[Inside]

    def mean(self, name: str) -> float:
        """Of all frames."""
        return float(np.mean([getattr(frame, name) for frame in self.frames]))


def bead_friction(inertial: float) -> float:
    """Shear over normal stress of glass beads that flow with this inertial number, Jop et al. (2006)."""
    return SLOW + ADDED / (1.0 + HALF_WAY / inertial)


def line(normal: Array) -> tuple[Array, Array]:
    """Weights (n,) of the shear stresses in the intercept and in the slope of the straight line through them. The line has the least
    squares of relative deviations: stresses scatter in proportion to the load."""
    design = np.column_stack([1.0 / normal, np.ones(len(normal))])
    cut, slope = np.linalg.pinv(design) / normal
    return cut, slope


@cached_per_replica
def read(replica: Replica) -> list[Shear]:
    """All loads of a run."""
    p, numbers, rows = replica.parameters, replica.derived, replica.times()
    each = [(grains.step, inside(grains, contacts, p, numbers["area"])) for grains, contacts in replica.paired_frames()]
    found = []
    for number, factor in enumerate(LOADS):
        end = numbers["steps"] - (len(LOADS) - 1 - number) * numbers["load_steps"]
        begin = end - numbers["load_steps"] * p["strain"] / (p["run_in"] + p["strain"])
        now = (rows["step"] > begin) & (rows["step"] <= end)
        lower_normal, lower_shear, upper_normal, upper_shear = (
            sign * rows[name][now] / numbers["area"] for name, sign in (("lower_fz", 1.0), ("lower_fx", -1.0), ("upper_fz", -1.0),
                                                                        ("upper_fx", 1.0)))
        here = [frame for step, frame in each if begin < step <= end]
        found.append(Shear(factor * p["normal_stress"], lower_normal, lower_shear, upper_normal, upper_shear, here))
    return found


def estimates(replica: Replica) -> dict[str, Estimate]:
    """All that is measured of one run."""
    loads = read(replica)
    shear = [block_mean(0.5 * (one.lower_shear + one.upper_shear)) for one in loads]
    normal = np.array([one.load for one in loads])
    stresses, halves = values_and_halves(shear)
    cut, slope = line(normal)

    def fitted(weights: Array, scale: float = 1.0) -> Estimate:
        return Estimate(float(weights @ stresses) / scale, combined(list(weights * halves)) / scale, "propagated from block averages")

    friction, cohesion = fitted(slope), fitted(cut)
    inertial = inertial_numbers(replica)
    # Attraction acts on the contacts like a load.
    pull = float(np.mean([one.mean("attraction") for one in loads]))
    angle = math.degrees(math.atan(friction.value))
    ratios = np.array([frame.stress[2, 2] / one.load for one in loads for frame in one.frames])
    return {
        "internal_friction": friction,
        "friction_angle": Estimate(angle, math.degrees(friction.half / (1.0 + friction.value**2)), friction.basis),
        "cohesion": cohesion,
        "cohesion_ratio": fitted(cut, float(normal.mean())),
        "capillary_cohesion": Estimate(friction.value * pull, friction.half * pull, friction.basis),
        "bead_friction": exact(float(slope @ (normal * [bead_friction(one) for one in inertial]))),
        "normal_balance_error": max((of_loads([getattr(one, side) / one.load - 1.0 for one in loads])
                                     for side in ("lower_normal", "upper_normal")), key=lambda one: abs(one.value)),
        "shear_balance_error": of_loads([(one.lower_shear - one.upper_shear) / one.load for one in loads]),
        "contact_stress_error": block_mean(ratios - 1.0),
        "solid_fraction": block_mean(np.array([frame.fraction for one in loads for frame in one.frames])),
        "coordination": block_mean(np.array([frame.coordination for one in loads for frame in one.frames])),
        "inertial_number": exact(float(inertial[0])),
    }


def of_loads(errors: Sequence[Array]) -> Estimate:
    """The mean over all loads of what was measured under each."""
    means = [block_mean(one) for one in errors]
    return Estimate(float(np.mean([one.value for one in means])), combined([one.half for one in means]) / len(means), means[0].basis)


def inertial_numbers(replica: Replica) -> Array:
    """Under each load: speed over distance of the plates, times d √(ρ/σ)."""
    p, loads = replica.parameters, read(replica)
    rates = replica.derived["shear_speed"] / np.array([one.mean("height") for one in loads])
    return np.asarray(rates * p["grain_diameter"] * np.sqrt(p["grain_density"] / np.array([one.load for one in loads])))


def measure(replicas: Replicas) -> Measurement:
    """Values and curves of all packings."""
    found, p = [estimates(replica) for replica in replicas], replicas[0].parameters
    over = {name: pooled(found, name) for name in found[0]}
    wet = p["bridge_volume"] > 0.0
    beads = "liquid bridges" if wet else "grains without friction are no beads of glass" if not replicas[0].derived["grain_static"] else ""
    values = {name: Value(over[name]) for name in ("friction_angle", "cohesion", "solid_fraction", "coordination", "inertial_number")}
    values["internal_friction"] = Value(over["internal_friction"], over["bead_friction"], inapplicable=beads)
    for name in ("normal_balance_error", "shear_balance_error", "contact_stress_error"):
        values[name] = Value(over[name], exact(0.0))
    if wet:
        values["cohesion"] = Value(over["cohesion"], over["capillary_cohesion"])
    else:
        values["cohesion_ratio"] = Value(over["cohesion_ratio"], exact(0.0))
    return Measurement(values, curves(replicas))


def curves(replicas: Replicas) -> list[Curve]:
    """The yield locus, and the shear stress in time."""
    runs = [read(replica) for replica in replicas]
    normal = np.array([one.load for one in runs[0]])
    beads = normal * [bead_friction(one) for one in np.mean([inertial_numbers(replica) for replica in replicas], axis=0)]
    locus = profile("locus", "Yield locus", "normal stress (Pa)", "shear stress (Pa)", normal,
                    [np.array([0.5 * (one.lower_shear + one.upper_shear).mean() for one in loads]) for loads in runs], reference=beads,
                    reference_label="glass beads, Jop et al. (2006)")
    table = [replica.times() for replica in replicas]
    share = np.linspace(0.0, 1.0, 201)[1:]
    ends = (share * len(table[0]["step"])).astype(int)

    def course(rows: dict[str, Array]) -> Array:
        stress = 0.5 * (rows["upper_fx"] - rows["lower_fx"]) / replicas[0].derived["area"]
        return np.array([part.mean() for part in np.split(stress, ends[:-1])])

    return [locus, profile("course", "Shear stress in time", "time (s)", "shear stress (Pa)", table[0]["time"][ends - 1],
                           [course(rows) for rows in table])]
