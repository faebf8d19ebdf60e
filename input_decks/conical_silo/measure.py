"""Conical silo: grains above the lip against time, compared with other codes, and the law of Beverloo."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from dembark.input_decks.common.estimates import divided, ratio, reference_rows, values_and_halves
from dembark.input_decks.common.power_law import ordered
from dembark.postproc.history import reached
from dembark.postproc.measurement import Array, Estimate, Measurement, Points, Replica, Replicas, Value, exact, over_replicas, profile
from dembark.postproc.statistics import student
from dembark.postproc.studies import fitted_exponent, measured, propagated

PUBLISHED = Path(__file__).with_name("reference") / "remaining.csv"
# Codes whose slopes count, and whose numbers do: LIGGGHTS counts in another region.
SLOPES, LEVELS = ("musen", "liggghts", "peclet_hertz"), ("musen", "peclet_hertz")
# What makes a run one of the published silo, whatever its modulus is.
LARGE = {"grain_count": 100000, "grain_diameter": 0.004, "grain_density": 2500.0, "restitution": 0.5, "friction": 0.3,
         "grain_steel_friction": 0.2, "grain_steel_restitution": 0.4, "barrel_radius": 0.1, "lip_radius": 0.03, "sides": 100,
         "gravity": 9.81}
# Window of the slope (s) there, and parts of the grains that are left in that of other silos. Beverloo's constants for spheres.
WINDOW, LEFT = (0.5, 3.5), (0.85, 0.3)
C, K, POWER = 0.58, 1.4, 2.5
PARTS = 6


@dataclass(frozen=True)
class Emptying:
    """`left`: grains above the lip at the `times` (s) from `start` to `end` (s) on, where the silo empties steadily."""

    times: Array
    left: Array
    start: float
    end: float

    def slopes(self, parts: int = PARTS) -> Array:
        """Grains a second in equal parts of the time."""
        edges = np.linspace(self.start, self.end, parts + 1)
        return np.array([_rate(self.times, self.left, low, high) for low, high in pairwise(edges)])

    def rate(self) -> Estimate:
        """Grains a second; interval: scatter of the parts about a straight line."""
        slopes = self.slopes()
        place = np.arange(PARTS)
        scatter = slopes - np.polyval(np.polyfit(place, slopes, 1), place)
        half = student(PARTS - 2) * math.sqrt(float((scatter**2).sum()) / (PARTS - 2) / PARTS)
        return Estimate(_rate(self.times, self.left, self.start, self.end), half, f"{PARTS} blocks of time")

    def late_over_early(self) -> Estimate:
        """Rate of the last third of the time over that of the first."""
        slopes = self.slopes(3)
        rate = self.rate()
        # A third is two of the parts.
        half = rate.half / rate.value * math.sqrt(PARTS)
        return Estimate(float(slopes[2] / slopes[0]), half * float(slopes[2] / slopes[0]), rate.basis)

    def when(self, left: float) -> float:
        """Time (s) at which so many grains are left."""
        return reached(self.times, self.left[0] - self.left, self.left[0] - left)

    def at(self, time: float) -> float:
        """Grains left at this time (s)."""
        return float(np.interp(time, self.times, self.left))


def _rate(times: Array, left: Array, start: float, end: float) -> float:
    inside = (times > start - 1e-9) & (times < end + 1e-9)
    return -float(np.polyfit(times[inside], left[inside], 1)[0]) if inside.sum() > 2 else math.nan


def published() -> dict[str, Emptying]:
    """The published curves by code."""
    rows = reference_rows(PUBLISHED)
    times = np.array([row.number("time") for row in rows])
    return {code: Emptying(times, np.array([row.number(code) for row in rows]), *WINDOW) for code in SLOPES}


def is_published(p: Mapping[str, Any]) -> bool:
    """Whether a run with the parameters `p` is one of the published silo."""
    return all(p[name] == value for name, value in LARGE.items())


def read(replica: Replica) -> Emptying:
    """The number of grains above the lip, from the opening on."""
    p, rows = replica.parameters, replica.times()
    times = np.concatenate([[0.0], rows["time"]])
    left = np.concatenate([[float(p["grain_count"])], rows["remaining"]])
    if is_published(p):
        return Emptying(times, left, *WINDOW)
    return Emptying(times, left, *(reached(times, left[0] - left, (1.0 - part) * left[0]) for part in LEFT))


def unaccounted(replica: Replica) -> float:
    """The most grains, at any time, that were removed before they had passed the lip, or were not although they had all time to fall."""
    p, rows = replica.parameters, replica.times()
    times, fall = rows["time"], math.sqrt(2.0 * p["drop"] / p["gravity"])
    passed, removed = p["grain_count"] - rows["remaining"], p["grain_count"] - rows["present"]
    # Grains go when the lists of neighbours are made anew.
    due = np.interp(times - 1.2 * fall - 2.0 * times[0], times, passed, left=0.0)
    return float(max((removed - passed).max(), (due - removed).max(), 0.0))


def leaked(replica: Replica) -> int:
    """The most grains, in any frame, whose middle is outside of the walls above the lip."""
    p = replica.parameters

    def outside(places: Array) -> int:
        wall = np.minimum(p["barrel_radius"], p["lip_radius"] + places[:, 2])
        return int(((places[:, 2] > 0.0) & (np.hypot(places[:, 0], places[:, 1]) > wall)).sum())

    return max(outside(frame.positions) for frame in replica.grains())


def bulk_density(replica: Replica) -> float:
    """kg/m3, of the grains with their middles between the lip and eight tenths of the height, in the first frame."""
    p, frame = replica.parameters, next(iter(replica.grains()))
    height = 0.8 * float(np.quantile(frame.positions[:, 2], 0.99))
    cone = p["barrel_radius"] - p["lip_radius"]
    in_cone = math.pi / 3.0 * ((p["lip_radius"] + min(cone, height)) ** 3 - p["lip_radius"] ** 3)
    volume = in_cone + math.pi * p["barrel_radius"] ** 2 * max(height - cone, 0.0)
    inside = (frame.positions[:, 2] > 0.0) & (frame.positions[:, 2] < height)
    return float(frame.masses[inside].sum()) / volume


def opening(p: Mapping[str, Any]) -> float:
    """Width (m) of the outlet less Beverloo's K diameters."""
    return float(2.0 * p["lip_radius"] - K * p["grain_diameter"])


def measure(replicas: Replicas) -> Measurement:
    """Values and the curve of all replicas of a series."""
    runs, p = [read(replica) for replica in replicas], replicas[0].parameters
    rate, uneven = over_replicas([run.rate() for run in runs]), over_replicas([run.late_over_early() for run in runs])
    mass, density = math.pi / 6.0 * p["grain_density"] * p["grain_diameter"] ** 3, float(np.mean([bulk_density(one) for one in replicas]))
    law = density * math.sqrt(p["gravity"]) * opening(p) ** POWER / mass
    # How long the silo takes is known as well as its rate is.
    part = rate.half / rate.value

    def over_runs(found: list[float]) -> Estimate:
        mean = float(np.mean(found))
        return Estimate(mean, part * mean, rate.basis)

    halfway, last = (over_runs([run.when(share * p["grain_count"]) for run in runs]) for share in (0.5, 0.01))
    values = {"rate": Value(rate), "mass_rate": Value(divided(rate, 1.0 / mass)), "halfway": Value(halfway),
              "bulk_density": Value(Estimate(density, math.inf, "one frame")), "beverloo_c": Value(divided(rate, law), exact(C)),
              "left_at_end": Value(exact(max(run.left[-1] for run in runs) / p["grain_count"]), exact(0.0)),
              "leaked": Value(exact(max(map(leaked, replicas))), exact(0.0)),
              "unaccounted": Value(exact(max(map(unaccounted, replicas))), exact(0.0))}
    times = runs[0].times
    curves = [np.interp(times, run.times, run.left) for run in runs]
    if not is_published(p):
        values |= {"steadiness": Value(uneven, exact(1.0)), "last_percent": Value(last)}
        return Measurement(values, [profile("remaining", "Grains left", "time (s)", "grains above the lip", times, curves)])
    codes = published()
    levels = [codes[code] for code in LEVELS]
    values["rate"] = Value(rate, _spread([code.rate().value for code in codes.values()]))
    values["late_over_early"] = Value(uneven, _spread([code.late_over_early().value for code in codes.values()]))
    values["last_percent"] = Value(last, _spread([code.when(0.01 * code.left[0]) for code in levels]))
    for second in (1, 2, 3):
        # The number left is known as well as the number that has gone.
        share = float(np.mean([run.at(second) for run in runs])) / p["grain_count"]
        values[f"left_{second}"] = Value(Estimate(share, part * (1.0 - share), rate.basis),
                                         _spread([code.at(second) / code.left[0] for code in levels]))
    times = codes["musen"].times
    known = np.array([code.left for code in levels])
    return Measurement(values, [profile("remaining", "Grains left", "time (s)", "grains above the lip", times,
                                        [np.interp(times, run.times, run.left) for run in runs], reference=known.mean(axis=0),
                                        reference_half=0.5 * np.ptp(known, axis=0), reference_label="two codes")])


def _spread(found: list[float]) -> Estimate:
    return Estimate(float(np.mean(found)), 0.5 * float(np.ptp(found)), "half of the range of the codes")


def study(name: str, points: Points, along: str) -> Measurement:
    """The exponent of the rate in the width of the outlet; or the rate with a softened modulus over that with the modulus of the source."""
    points, places = ordered(points, along)
    found = [measured(point, "rate") for point in points]
    rates, halves = values_and_halves(found)
    if name == "stiffness":
        curve = profile("rate", "Rate", "log₁₀ of the softening", "grains a second", np.log10(places), [rates], half=halves)
        return Measurement({"softened_rate": Value(ratio(found[-1], found[0]), exact(1.0))}, [curve])
    openings = np.array([opening(point["parameters"]) for point in points])
    power = propagated(lambda logs: fitted_exponent(openings, np.exp(logs)), np.log(rates), halves / rates)
    law = np.exp(np.log(rates).mean() + POWER * (np.log(openings) - np.log(openings).mean()))
    width = np.array([2.0 * place / float(point["parameters"]["grain_diameter"]) for place, point in zip(places, points, strict=True)])
    return Measurement({"exponent": Value(power, exact(POWER))}, [
        profile("rate", "Rate", "width of the outlet D / d", "grains a second", width, [rates], half=halves, reference=law,
                reference_label="power 2.5 of D − 1.4 d")])
