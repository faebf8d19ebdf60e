"""Discharge of a bin: discharged mass against time, compared with a published curve, and the laws of Beverloo and of Choi. Times count from
10 % of the mass on: published curves do not say how their gate opens. V&V 20: E = S − D is known within U_val, U_val² = U_num² + U_input² +
U_D²."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dembark.input_decks.common.estimates import reference_rows, values_and_halves
from dembark.input_decks.common.power_law import PowerLawFit, ordered
from dembark.postproc.history import reached
from dembark.postproc.measurement import Curve, Estimate, Measurement, Points, Replicas, Value, exact, over_replicas, profile
from dembark.postproc.replica import Array, Replica
from dembark.postproc.studies import compared, fitted_exponent, measured, propagated

PUBLISHED = Path(__file__).with_name("reference") / "anand_2008.csv"
# Part of all mass between which the rate is taken, and Beverloo's constant for spheres.
LOW, HIGH, K = 0.1, 0.7, 1.4
# Of the plug's velocity in (W/d - 1), by J. Choi, A. Kudrolli, M. Z. Bazant, J. Phys.: Condens. Matter 17 (2005) S2533.
CHOI = 1.48
# 95 % limits of a digitised point: the largest difference of two digitisations.
READ = 0.0035
TITLES = ("Discharged mass", "time since 10 % discharged (s)", "fraction of the mass of all grains")
# What makes a run one of the published bin, whatever its modulus and its resistance against rolling are, and the range of its frictions.
ANAND = {"grain_count": 6790, "grain_diameter": 0.00224, "grain_diameter_spread": 0.0, "grain_density": 2500.0, "restitution": 0.94,
         "wall_restitution": 0.9, "static_friction": None, "kinetic_friction": None, "kinetic_friction_ratio": 1.0, "bridge_volume": 0.0,
         "bin_width": 0.12544, "bin_depth": 0.0056, "outlet_width": 0.025088, "ends": "periodic", "gravity": 9.81}
FRICTIONS = (0.18, 0.22)


@dataclass(frozen=True)
class Discharge:
    """One run: `share` (frames,) of the mass that is below the bottom at the `times` (s) since the gate began to drop; `mass` (kg) of all
    grains, bulk `density` (kg/m3) above the slot and fill `height` (m) before, `period` (m) along the slot."""

    times: Array
    share: Array
    mass: float
    density: float
    height: float
    period: float

    def times_from_low(self) -> Array:
        """Times since LOW of the mass has left."""
        return self.times - reached(self.times, self.share, LOW)

    def rate(self) -> Estimate:
        """1/s, over the mass of all grains, with the limits of the fit."""
        return slope(self.times, self.share, HIGH)

    def mass_rate(self) -> float:
        """kg/m/s, from LOW of all mass to HIGH of what leaves."""
        return slope(self.times, self.share, HIGH * float(self.share[-1])).value * self.mass / self.period


def slope(times: Array, share: Array, high: float) -> Estimate:
    """Slope of a line through the curve from LOW to `high`; interval: difference of its halves, over two."""
    inside = (share >= LOW) & (share <= high)
    if inside.sum() < 4:
        return Estimate(math.nan, math.inf, "fewer than four frames in the discharge")
    t, y = times[inside], share[inside]
    half = len(t) // 2
    first, second = np.polyfit(t[: half + 1], y[: half + 1], 1)[0], np.polyfit(t[half:], y[half:], 1)[0]
    return Estimate(float(np.polyfit(t, y, 1)[0]), 0.5 * abs(float(first - second)), "first and second half of the discharge")


def published() -> dict[str, tuple[Array, Array]]:
    """Times (s) and shares of the digitisations of the published curve, by name."""
    points: dict[str, list[tuple[float, float]]] = {}
    for row in reference_rows(PUBLISHED):
        points.setdefault(row["digitisation"], []).append((row.number("time"), row.number("share")))
    return {name: (one[:, 0], one[:, 1]) for name, table in points.items() for one in [np.array(table)]}


def datum() -> dict[str, Estimate]:
    """Rate (1/s) and final share of the published curve: mean of the digitisations, and their difference or that of the halves."""
    curves = list(published().values())
    rates, last = [slope(t, y, HIGH) for t, y in curves], [float(y[-1]) for _, y in curves]
    return {"rate": Estimate(float(np.mean([one.value for one in rates])), float(np.ptp([one.value for one in rates])), "digitisations"),
            "discharged": Estimate(float(np.mean(last)), READ, "digitisations")}


def read(replica: Replica) -> Discharge:
    """Measure a run; the first frame is that at which the gate begins to drop."""
    given, frames = replica.parameters, list(replica.grains())
    first = frames[0]
    mass, d, period = float(first.masses.sum()), float(given["grain_diameter"]), float(given["bin_depth"])
    height = 2.0 * float(np.average(first.positions[:, 2], weights=first.masses))
    above = (np.abs(first.positions[:, 0] - 0.5 * given["bin_width"]) < 0.5 * given["outlet_width"]) & (first.positions[:, 2] > 2.0 * d)
    above &= first.positions[:, 2] < 0.8 * height
    density = float(first.masses[above].sum()) / (float(given["outlet_width"]) * period * (0.8 * height - 2.0 * d))
    # A grain has left when it is wholly below the bottom.
    share = np.array([one.masses[one.positions[:, 2] < -one.radii].sum() for one in frames]) / mass
    times = np.array([one.step - first.step for one in frames]) * replica.time_step
    return Discharge(times, share, mass, density, height, period)


def measure(replicas: Replicas) -> Measurement:
    """Values and the curve of all replicas of a series."""
    runs, given = [read(replica) for replica in replicas], replicas[0].parameters
    known = all(given[name] == value for name, value in ANAND.items())
    known = known and all(FRICTIONS[0] <= given[name] <= FRICTIONS[1] for name in ("grain_friction", "wall_friction"))
    rate, last = over_replicas([run.rate() for run in runs]), over_replicas([_whole(float(run.share[-1]), run) for run in runs])
    rates = [Estimate(run.mass_rate(), run.rate().half / run.rate().value * run.mass_rate(), run.rate().basis) for run in runs]
    values = {"rate": Value(rate), "discharged": Value(last), "mass_rate": Value(over_replicas(rates)),
              "time_80": Value(over_replicas([Estimate(reached(run.times, run.share, 0.8), math.inf, "one packing") for run in runs])),
              "bulk_density": Value(over_replicas([Estimate(run.density, math.inf, "one frame") for run in runs])),
              "fill_height": Value(exact(runs[0].height / given["outlet_width"]))}
    if not known:
        place = runs[0].times_from_low()
        return Measurement(values, [profile("discharge", *TITLES, place, _mean(runs, place))])
    due = datum()
    worst = max((_difference(runs, name) for name in published()), key=lambda one: one.value)
    values |= {"rate": Value(rate, due["rate"], detail=compared(rate.value, due["rate"], sim=rate.half, num=0.0, input=0.0).text),
               "discharged": Value(last, due["discharged"]), "curve": Value(worst, exact(0.0))}
    return Measurement(values, [_with_published(runs, name) for name in published()])


def _whole(share: float, run: Discharge) -> Estimate:
    return Estimate(share, abs(share - float(run.share[-max(2, len(run.share) // 20)])), "mass discharged in the last 5 % of the time")


def _mean(runs: Sequence[Discharge], times: Array) -> list[Array]:
    return [np.interp(times, run.times_from_low(), run.share) for run in runs]


def _difference(runs: Sequence[Discharge], name: str) -> Estimate:
    t, y = published()[name]
    t = t - reached(t, y, LOW)
    inside = (y > 0.5 * LOW) & (y <= HIGH)
    apart = np.abs(np.mean(_mean(runs, t[inside]), axis=0) - y[inside])
    return Estimate(float(apart.max()), READ, "digitisations")


def _with_published(runs: Sequence[Discharge], name: str) -> Curve:
    t, y = published()[name]
    t = t - reached(t, y, LOW)
    first = max(run.times_from_low()[0] for run in runs)
    t, y = t[t > first], y[t > first]
    return profile(f"discharge_{name}", *TITLES, t, _mean(runs, t), reference=y, reference_half=np.full(len(y), READ),
                   reference_label="Anand et al. (2008), DEM")


def study(name: str, points: Points, along: str) -> Measurement:
    """The law of Beverloo, or that of Choi, in the width of the slot; or the effect of the varied parameter on the rate."""
    points, places = ordered(points, along)
    if name == "orifice":
        # In one bin the velocity far above the slot is in proportion to the flow.
        flow = PowerLawFit.of(points, "mass_rate", places / float(points[0]["parameters"]["grain_diameter"]) - 1.0)
        return Measurement({"orifice_exponent": Value(flow.exponent, exact(CHOI))}, [
            flow.curve("orifice", "Discharge rate", "width of the slot W / d − 1", "kg/m/s", CHOI, f"(W/d − 1)^{CHOI:g}")])
    if name != "outlet":
        one = next(point for point in points if point["variant"] == "anand")
        found = np.array([measured(point, "rate").value for point in points])
        half, rate, due = float(np.ptp(found)), measured(one, "rate"), datum()["rate"]
        varied = {"input": 0.5 * half, "num": 0.0} if name == "friction" else {"input": 0.0, "num": half}
        joint = Estimate(rate.value, math.hypot(rate.half, *varied.values()), "scatter and effect of the varied parameter")
        return Measurement({"rate": Value(joint, due, detail=compared(rate.value, due, sim=rate.half, **varied).text)},
                           [profile("rate", "Discharge rate", along, "1/s", places, [found])])
    rates, halves = values_and_halves([measured(point, "mass_rate") for point in points])
    given = points[0]["parameters"]
    d, g = float(given["grain_diameter"]), float(given["gravity"])
    density = float(np.mean([measured(point, "bulk_density").value for point in points]))

    def line(values: Array) -> tuple[float, float]:
        rise, start = np.polyfit(places, values ** (2.0 / 3.0), 1)
        return -start / rise / d, rise**1.5 / (density * math.sqrt(g))

    k, c = line(rates)
    power = propagated(lambda logs: fitted_exponent(places - K * d, np.exp(logs)), np.log(rates), halves / rates)
    values = {
        "exponent": Value(power, exact(1.5)),
        "beverloo_k": Value(propagated(lambda each: line(each)[0], rates, halves), exact(1.5)),
        "beverloo_c": Value(propagated(lambda each: line(each)[1], rates, halves)),
    }
    law = c * density * math.sqrt(g) * (places - k * d) ** 1.5
    label = f"C = {c:.2f}, k = {k:.2f}"
    curve = profile("mass_rate", "Discharge rate", "width of the slot D / d", "kg/m/s", places / d, [rates], half=halves, reference=law,
                    reference_label=label)
    return Measurement(values, [curve])
