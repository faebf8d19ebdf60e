"""The front of the column compared with two experiments, the zero of whose times is not known."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from scipy.stats import linregress

from dembark.input_decks.common.estimates import reference_rows
from dembark.input_decks.common.power_law import PowerLawFit, ordered
from dembark.input_decks.common.water_run import common_values
from dembark.postproc.history import reached
from dembark.postproc.measurement import Array, Curve, Estimate, Measurement, Numbers, Points, Replica, Replicas, Value, exact, profile
from dembark.postproc.replica import cached_per_replica
from dembark.postproc.statistics import student
from dembark.postproc.studies import compared, measured, numerical, quantity

MEASURED = Path(__file__).with_name("reference") / "fronts.csv"
NAMES = {"martin_moyce": "Martin & Moyce (1952)", "koshizuka_oka": "Koshizuka & Oka (1996)"}
# T from which points count, and the fewest with which a line is fitted.
FREE, FEWEST = 1.0, 4
# Area over a² of the water ahead of a front whose place the spacing does not decide: the tip of the water is as thin as one particle.
AHEAD = 0.01
NOWHERE = Estimate(math.nan, math.inf, "the front does not get so far")


def published(source: str) -> tuple[Array, Array]:
    """Times T and fronts, over a."""
    times, fronts = np.array([(row.number("time"), row.number("front")) for row in reference_rows(MEASURED, source=source)]).T
    return times, fronts


def front(run: Replica) -> tuple[Array, Array]:
    """Times T = t √(2g/a) and places over a of the front: the foremost particle and half a spacing."""
    times, foremost, _ = _fronts(run)
    return times, foremost


def thick_front(run: Replica) -> tuple[Array, Array]:
    """The same of the particle that has AHEAD a² of water before it, where the water is thicker than a particle."""
    times, _, thick = _fronts(run)
    return times, thick


@cached_per_replica
def _fronts(run: Replica) -> tuple[Array, Array, Array]:
    """Times T, and places over a of both fronts."""
    p = run.parameters
    width, unit = p["column_width"], math.sqrt(p["column_width"] / (2.0 * p["gravity"]))
    number = max(round(AHEAD * p["resolution"] ** 2), 1)
    rows = [(0.0, 1.0, 1.0)]
    for frame in run.grains():
        foremost = np.sort(frame.positions[:, 0])[[-1, -number]]
        rows.append((frame.step * run.time_step / unit, *(foremost + 0.5 * width / p["resolution"]) / width))
    times, foremost, thick = np.array(rows).T
    return times, foremost, thick


def pace(own: tuple[Array, Array], source: str) -> tuple[Estimate, Estimate]:
    """Speed of the front `own` over that measured, and the delay of the measured times T, with 95 % intervals by the scatter of the points.
    The time at which the water was free is not known. Measured times T are fitted by a line over those of the simulation at the same
    places: its slope is the speed, the mean difference the delay. Points count from T = 1 on."""
    times, fronts = published(source)
    counted = (times >= FREE) & (fronts <= own[1].max())
    if counted.sum() < FEWEST:
        return NOWHERE, NOWHERE
    there, ours = times[counted], np.array([reached(*own, place) for place in fronts[counted]])
    reach, line, late = student(len(ours) - 2), linregress(ours, there), there - ours
    return (Estimate(float(line.slope), reach * float(line.stderr), f"scatter of {len(ours)} points"),
            Estimate(float(late.mean()), reach * float(late.std(ddof=1)) / math.sqrt(len(ours)), f"scatter of {len(ours)} points"))


def due(source: str, found: tuple[Estimate, Estimate]) -> tuple[Estimate, Estimate]:
    """References of speed and delay; U_D: scatter of the points. The delay is between zero and the first entry of the table. The later
    experiment contradicts the earlier one, of columns of two sizes that agree: its U_D of the speed includes the difference."""
    speed, delay = found
    contradiction = 0.0 if source == "martin_moyce" else abs(pace(published("martin_moyce"), source)[0].value - 1.0)
    return (Estimate(1.0, math.hypot(speed.half, contradiction), speed.basis),
            Estimate(0.5 * float(published(source)[0][0]), delay.half, delay.basis))


def at_3(own: tuple[Array, Array], p: Numbers) -> Value:
    """The front `own` at T = 3; none where the run ends before, or where it has come to the end of the tank."""
    found = float(np.interp(3.0, *own, right=math.nan))
    if found > p["tank_length"] - 1.0 / p["resolution"]:
        return Value(exact(math.nan), reason="the front is at the end of the tank before T = 3: take a larger tank_length")
    return Value(exact(found), reason="" if math.isfinite(found) else "the run ends before T = 3: take a longer run_time")


def measure(replicas: Replicas) -> Measurement:
    """Of the one run: nothing is random. What has no spacings to be studied with is judged by itself."""
    run = replicas[0]
    own, p = front(run), run.parameters
    energy = p["fluid_density"] * p["gravity"] * 2.0 * p["column_width"] ** 3
    thick = thick_front(run)
    values = {"front_at_3": at_3(own, p), "thick_front_at_3": at_3(thick, p),
              "thick_speed": Value(pace(thick, "martin_moyce")[0]), **common_values(run, energy)}
    for source in NAMES:
        found = pace(own, source)
        references = due(source, found) if p["no_slip"] == "yes" else (None, None)
        values |= {f"{what}_{source}": Value(one if reference is None else exact(one.value), reference)
                   for what, one, reference in zip(("speed", "delay"), found, references, strict=True)}
    return Measurement(values, [_curve(own, source, f"front_{source}", label) for source, label in NAMES.items()])


def study(name: str, points: Points, along: str) -> Measurement:  # noqa: ARG001 (there is one study)
    """The front with the finest particles compared with the experiments, and how far the two finest are apart."""
    points, place = ordered(points, along)
    fronts = np.array([_known(point, "front_at_3").value for point in points])
    known = bool(np.isfinite(fronts).all())
    values = {"front_converged": Value(exact(fronts[-1] - fronts[-2]), exact(0.0), reason="" if known else "no front at T = 3 in each run")}
    for source in NAMES:
        every = [[_known(point, f"{what}_{source}") for point in points] for what in ("speed", "delay")]
        references = due(source, (every[0][-1], every[1][-1]))
        for what, found, reference in zip(("speed", "delay"), every, references, strict=True):
            of_spacing = numerical(list(1.0 / place), [one.value for one in found])
            value = found[-1].value
            values[f"{what}_{source}"] = Value(Estimate(value, of_spacing, "spacing"), reference,
                                               detail=compared(value, reference, num=of_spacing).text)
    if not known:
        return Measurement(values)
    curve = PowerLawFit(place, fronts, 0.0 * fronts).curve("front", "Front at T = 3", "particles across the column", "over a")
    return Measurement(values, [curve])


def _known(point: Numbers, name: str) -> Estimate:
    """The quantity of a run; no number where its front did not get there."""
    one = quantity(point, name)
    return NOWHERE if one["value"] is None else measured(point, name)


def _curve(own: tuple[Array, Array], source: str, name: str, label: str) -> Curve:
    """The front, with that of an experiment whose times are shifted by the delay as its reference."""
    times, fronts = published(source)
    delay = pace(own, source)[1].value
    shifted = times - (delay if math.isfinite(delay) else 0.0)
    return profile(name, f"Front, {label}", "T = t √(2g/a), measured times less the delay", "front over a", shifted,
                   [np.interp(shifted, *own)], reference=fronts, reference_label=label)
