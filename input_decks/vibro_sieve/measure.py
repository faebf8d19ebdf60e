"""Vibrating screen: grains that have passed, period by period, and the rate at which those that are left pass."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dembark.input_decks.common.drive_levels import acceleration
from dembark.input_decks.common.drive_phases import read_phases
from dembark.input_decks.common.estimates import over_chaotic, values_and_halves
from dembark.input_decks.common.momentum import unexplained_energy
from dembark.input_decks.common.power_law import ordered
from dembark.input_decks.drive_power.drive import LONGEST
from dembark.postproc.measurement import (
    Array,
    Estimate,
    Measurement,
    Numbers,
    Points,
    Replica,
    Replicas,
    Value,
    exact,
    number,
    profile,
)
from dembark.postproc.replica import cached_per_replica
from dembark.postproc.studies import measured

Counts = NDArray[np.int64]


@dataclass(frozen=True)
class Screening:
    """One run: undersize grains `on` the screen (periods + 1,) at the beginning of each period and at the end; `coverage`: diameters of
    all grains on the screen at the beginning over its width; the most oversize grains `through` the screen in any frame; grains `lost`
    from the bin in the last frame."""

    on: Counts
    coverage: float
    through: int
    lost: int


@cached_per_replica
def read(replica: Replica) -> Screening:
    """What the frames of a run show."""
    p, derived = replica.parameters, replica.derived
    run = read_phases(replica.grains(), derived["period_steps"], replica.time_step)
    oversize = run.frames[0].radii > 0.25 * p["grain_diameter"] * (1.0 + p["oversize_ratio"])
    below = [frame.positions[:, 2] < derived["below"] for frame in run.frames]
    on = np.array([np.sum(~passed & ~oversize) for passed, phase in zip(below, run.phases, strict=True) if phase == 0])
    x, z = run.frames[-1].positions[:, 0], run.frames[-1].positions[:, 2]
    inside = (x > 0.0) & (x < derived["width"]) & (z > -p["drop"])
    coverage = 2.0 * float(run.frames[0].radii[~below[0]].sum()) / derived["width"]
    return Screening(on, coverage, max(int(np.sum(passed & oversize)) for passed in below), p["grain_count"] - int(inside.sum()))


def rate(on: Counts) -> float:
    """Rate (1/period) from the grains left (periods + 1,): passages over the sum of those left, by the mean of either end of each
    period; the estimate of largest likelihood where each has the same chance at any time."""
    exposed = float(0.5 * (on[1:] + on[:-1]).sum())
    return float(on[0] - on[-1]) / exposed if exposed > 0.0 else math.nan


def halves_ratio(on: Counts) -> float:
    """Rate after half of the passages over that before."""
    middle = int(np.searchsorted(on[0] - on, 0.5 * (on[0] - on[-1])))
    before = rate(on[: middle + 1])
    return rate(on[middle:]) / before if before > 0.0 else math.nan


def random_chance(p: Numbers) -> float:
    """(a - d) / (a + w), the part of all places over a screen of slots at which a grain falls through and touches nothing."""
    return float((p["aperture"] - p["grain_diameter"]) / (p["aperture"] + p["bar_width"]))


def resting(p: Numbers) -> str:
    """Why nothing is known of passages where the screen never throws; "" where it does."""
    return "" if acceleration(p) > 1.0 else "up to 1 g grains stay where they lie: they do not meet the screen anew"


def meetings(p: Numbers) -> str:
    """Why grains do not meet the screen once in each period; "" where they do. A body that does not bounce flies for a full one from
    LONGEST on."""
    longer = f"from {LONGEST:.2f} g on a flight lasts more than a period: grains meet the screen less than once in each"
    return resting(p) or (longer if acceleration(p) >= LONGEST else "")


def measure(replicas: Replicas) -> Measurement:
    """Values and curves from all packings."""
    p, runs = replicas[0].parameters, [read(replica) for replica in replicas]
    undersize = p["grain_count"] - round(p["oversize_part"] * p["grain_count"])
    counts = [one.on for one in runs]
    # One grain more or less.
    found = over_chaotic((rate(on) for on in counts), 1.0 / min(max(float(on[:-1].sum()), 1.0) for on in counts))
    chance = Estimate(1.0 - math.exp(-found.value), math.exp(-found.value) * found.half, found.basis)
    coverage = over_chaotic(one.coverage for one in runs)
    order = over_chaotic(halves_ratio(one.on) for one in runs)
    # Fewer than three packings have no interval, without which the ratio decides nothing.
    crowded = "grains lie on each other, and wait" if coverage.value > 1.0 else resting(p)
    values = {
        "energy_balance": number(max(unexplained_energy(replica.times()) for replica in replicas), 0.0),
        "oversize_passed": number(sum(one.through for one in runs), 0.0),
        "grains_lost": number(sum(one.lost for one in runs), 0.0),
        "start": Value(over_chaotic((on[0] / undersize for on in counts), 1.0 / undersize)),
        "coverage": Value(coverage),
        "passed": Value(over_chaotic((1.0 - on[-1] / on[0] for on in counts), 1.0 / min(max(on[0], 1) for on in counts))),
        "rate": Value(found),
        "order": Value(order, exact(1.0) if len(counts) > 2 and math.isfinite(order.value) else None, inapplicable=crowded),
        "chance": above(chance, random_chance(p), meetings(p)),
    }
    time = np.arange(len(counts[0]), dtype=float)
    return Measurement(values, [profile("passed", "Undersize that has passed", "periods", "part of that on the screen at the start", time,
                                        [1.0 - on / on[0] for on in counts], reference=1.0 - np.exp(-found.value * time),
                                        reference_label="first order, with the rate k")])


def above(found: Estimate, bound: float, inapplicable: str) -> Value:
    """`found` next to a lower `bound`: open where its interval holds the bound."""
    if inapplicable:
        return Value(found, exact(bound), inapplicable=inapplicable)
    if abs(found.value - bound) <= found.half:
        return Value(found, exact(bound), reason="its interval holds the bound")
    return Value(found, exact(bound), verdict="pass" if found.value > bound else "fail")


def study(name: str, points: Points, along: str) -> Measurement:  # noqa: ARG001 (there is one study)
    """Rate over the width of the slots."""
    points, aperture = ordered(points, along)
    rates, halves = values_and_halves([measured(point, "rate") for point in points])
    steps, wide = np.diff(rates), np.hypot(halves[1:], halves[:-1])
    risen, fallen = steps > wide, steps < -wide
    if still := resting(points[0]["parameters"]):
        falls = number(float(risen.sum()), float(len(steps)), inapplicable=still)
    elif fallen.any() or risen.all():
        falls = number(float(risen.sum()), float(len(steps)), verdict="fail" if fallen.any() else "pass")
    else:
        falls = number(float(risen.sum()), float(len(steps)), reason="the interval of a step holds 0")
    chances: Array = np.array([-math.log1p(-random_chance(point["parameters"])) for point in points])
    curve = profile("rate", "Rate of passage over the width of the slots", "a/d", "k (1/T)",
                    aperture / points[0]["parameters"]["grain_diameter"], [rates], reference=chances,
                    reference_label="one meeting a period, at a random place")
    return Measurement({"rate_falls": falls}, [curve])
