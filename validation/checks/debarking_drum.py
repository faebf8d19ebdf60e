"""Debarking drum: how many impacts logs get in a revolution, how hard they are, and whether the simulation keeps its books.

A contact counts as an impact when it begins with at least the speed of approach `impact_speed`; slower ones are logs that rest or roll on
each other. Everything is taken per revolution of the measuring window, and per log where that makes drums of different size comparable.

What must hold whatever the logs do: the certificate of the contact problem in every step; the energy that the shell brings in (its moment
times its speed) is what is stored plus what is lost; over many revolutions what is stored does not grow, so the drum's power is the power
that is lost; and the mean force of the shell is the weight.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from dembark.postproc import DumpError
from dembark.validation.checks.quantity import Quantity, measured
from dembark.validation.checks.filling import propagated
from dembark.validation.checks.run import Array, Replica, pooled, profile, resampled, time_blocks
from dembark.validation.references import KOLESNIKOV
from dembark.postproc.statistics import Estimate
from numpy.typing import NDArray

REFERENCES = (KOLESNIKOV,)
ROWS = 200  # of time.csv in a revolution
CERTIFICATE = 1e-10
ENERGY_TOLERANCE = 2e-3
POWER_TOLERANCE = 0.05
FORCE_TOLERANCE = 0.02
# Edges of the histograms: peak force in N, place in degrees from the lowest point of the drum, positive the way it turns.
FORCES = np.logspace(1.0, 6.0, 51)
ANGLES = np.linspace(-180.0, 180.0, 37)


def geometry(parameters: Mapping[str, Any]) -> tuple[int, float]:
    """(number of logs, radius of the drum in m), by the formulas of the decks."""
    low, high = parameters["log_diameter_min"], parameters["log_diameter_max"]
    square, filling, radius = (0.5 * (low + high)) ** 2 + (high - low) ** 2 / 12.0, parameters["filling"], parameters["drum_radius"]
    if radius is not None and radius > 0.0:
        return math.floor(4.0 * filling * radius**2 / square + 0.5), radius
    count = parameters["log_count"]
    return count, 0.5 * math.sqrt(count * (square - (high - low) ** 2 / (12.0 * count**2)) / filling)


def total_weight(parameters: Mapping[str, Any]) -> float:
    """Weight (N) of all logs."""
    count, _ = geometry(parameters)
    low, high = parameters["log_diameter_min"], parameters["log_diameter_max"]
    square = (0.5 * (low + high)) ** 2 + (high - low) ** 2 / 12.0 * (1.0 - 1.0 / count**2)
    return float(count * 0.25 * math.pi * square * parameters["log_length"] * parameters["log_density"] * parameters["gravity"])


@dataclass(frozen=True)
class Drum:
    """The measuring window of one replica. Rows (rows,) are means or sums over 1/200 of a revolution; impacts (impacts,)."""

    logs: int
    revolutions: int
    period: float
    weight: float
    radius: float
    steps: int
    work: Array  # J, that the shell does in each row
    lost: Array  # J, dissipated in each row
    stored: Array  # J, at the end of each row, and before the first
    torque: Array  # N m, of the shell on the logs, mean of each row
    lift: Array  # N, upward force of the shell, mean of each row
    impulse: Array  # N s, of all contacts in each row
    pivots: Array  # in each row
    certificate: float  # worst since the start
    quarter: NDArray[np.int64]  # of a revolution, of each impact, counted from the window's begin
    peak: Array  # N
    angle: Array  # degrees
    shell: NDArray[np.bool_]

    @property
    def quarters(self) -> int:
        """Number of quarter revolutions: the pieces of time whose scatter makes the intervals."""
        return 4 * self.revolutions

    def in_quarters(self, rows: Array) -> Array:
        """Sums of `rows` over each quarter."""
        return np.asarray(rows.reshape(self.quarters, ROWS // 4).sum(axis=1))


def contacts_in_window(given: Mapping[str, Any], impacts: Array) -> Array:
    """Rows of `Replica.impacts` whose contact began in the measuring window."""
    period = 2.0 * math.pi / given["drum_speed"]
    begin = period * int(given["run_in"])
    return impacts[(impacts[:, 2] >= begin) & (impacts[:, 2] < begin + int(given["revolutions"]) * period)]


def quarters(given: Mapping[str, Any], impacts: Array) -> NDArray[np.int64]:
    """Quarter of a revolution of each impact in the window, counted from its begin."""
    turned = impacts[:, 2] * given["drum_speed"] / (2.0 * math.pi) - int(given["run_in"])
    return np.minimum((4.0 * turned).astype(np.int64), 4 * int(given["revolutions"]) - 1)


def angles(impacts: Array) -> Array:
    """Place of each impact in degrees from the drum's lowest point; the shell turns about +y, so that point moves towards -x."""
    return np.degrees(np.arctan2(-impacts[:, 8], -impacts[:, 10]))


def read(replica: Replica) -> Drum:
    """The window of `replica`; DumpError when its files do not belong together."""
    given, times, impacts = replica.parameters, replica.times(), replica.impacts()
    logs, radius = geometry(given)
    turns, period = int(given["revolutions"]), 2.0 * math.pi / given["drum_speed"]
    before, count = ROWS * int(given["run_in"]), len(times["step"])
    if count != before + ROWS * turns:
        raise DumpError(f"{replica.folder / 'time.csv'} has {count} rows instead of {before + ROWS * turns}")
    row = period / ROWS

    def change(name: str) -> Array:
        return np.diff(times[name], prepend=0.0)[before:]

    stored = times["kinetic_energy"] + times["potential_energy"] + times["elastic_energy"]
    if before == 0:
        stored = np.concatenate([[stored[0]], stored])
    else:
        stored = stored[before - 1 :]
    impacts = contacts_in_window(given, impacts)
    impacts = impacts[impacts[:, 6] >= given["impact_speed"]]
    quarter, angle = quarters(given, impacts), angles(impacts)
    return Drum(
        logs=logs, revolutions=turns, period=period, weight=total_weight(given), radius=radius,
        steps=int(times["step"][-1] - (times["step"][before - 1] if before else 0)),
        work=times["torque"][before:] * given["drum_speed"] * row, lost=change("dissipated_energy"), stored=stored,
        torque=times["torque"][before:], lift=times["shell_fz"][before:], impulse=change("impulse_sum"),
        pivots=change("pivots"), certificate=float(times["certificate"][-1]),
        quarter=quarter, peak=impacts[:, 4],
        angle=angle, shell=impacts[:, 1] < 0)


def _scalars(drum: Drum) -> dict[str, Estimate]:
    counts = np.bincount(drum.quarter, minlength=drum.quarters).astype(float)
    blocks = time_blocks(counts)
    lost, impulse, pivots, lift, torque = (
        drum.in_quarters(rows) for rows in (drum.lost, drum.impulse, drum.pivots, drum.lift, drum.torque))

    def mean(values: Array, factor: float = 1.0) -> Estimate:
        """Mean over quarters, times `factor`."""
        return resampled(lambda keep, _: factor * float(values[keep].mean()), blocks)

    def of_peaks(measure: Callable[[Array], float]) -> Estimate:
        def chosen(keep: NDArray[np.bool_], _: Any) -> float:
            peaks = drum.peak[keep[drum.quarter]]
            return measure(peaks) if len(peaks) else math.nan
        return resampled(chosen, blocks)

    # Work and loss differ by nothing but the change of what is stored, between two moments that are as good as any.
    power = Estimate(float(drum.work.sum() / drum.lost.sum()), 2.0 * math.sqrt(2.0) * float(drum.stored.std() / abs(drum.lost.sum())),
                     "spread of the stored energy")
    return {
        "impacts": mean(counts, 4.0),
        "impacts_per_log": mean(counts, 4.0 / drum.logs),
        "peak_mean": of_peaks(lambda peaks: float(peaks.mean())),
        "peak_p99": of_peaks(lambda peaks: float(np.percentile(peaks, 99.0))),
        "impulse": mean(impulse, 4.0),
        "lost": mean(lost, 4.0),
        "power": power,
        "lift": mean(lift, 4.0 / (ROWS * drum.weight)),
        "arm": mean(torque, 4.0 / (ROWS * drum.weight * drum.radius)),
        "pivots": mean(pivots, drum.quarters / drum.steps),
        "shell": resampled(lambda keep, _: float(drum.shell[keep[drum.quarter]].mean()) if len(drum.shell) else math.nan, blocks),
    }


def energy_error(drum: Drum) -> float:
    """Largest gap in the balance of energy over the window, over the work of the shell in it."""
    gap = np.cumsum(drum.work - drum.lost) - (drum.stored[1:] - drum.stored[0])
    return float(np.abs(gap).max() / abs(drum.work.sum()))


def picture(parameters: Mapping[str, Any]) -> dict[str, Any]:
    """How the report shows the logs: a cross-section with the drum."""
    _, radius = geometry(parameters)
    return {"cross_section": "xz", "drum_radius": radius, "drum_speed": parameters["drum_speed"]}


def quantities(replicas: Sequence[Replica]) -> tuple[list[Quantity], list[dict[str, Any]], list[str]]:
    """Quantities, profiles and remarks for the report from all replicas of a series."""
    drums = [read(replica) for replica in replicas]
    scalars = [_scalars(drum) for drum in drums]
    given, one = replicas[0].parameters, Estimate(1.0, 0.0)
    limit = given["impact_speed"]

    def over(name: str) -> Estimate:
        return pooled(scalars, name)

    def worst(values: list[float], what: str) -> Estimate:
        return Estimate(max(values), 0.0, what)

    found = [
        Quantity("certificate_max", "certificate of the contact problem, worst step", "1",
                 worst([drum.certificate for drum in drums], "every step of every run"), reference=Estimate(0.0, 0.0), absolute=True,
                 tolerance=CERTIFICATE, source="complementarity", compared=False,
                 detail="largest of min(z), min(w) below zero and z·w, scaled; 0 is an exact solution"),
        Quantity("energy_balance_error", "energy: shell's work − stored − lost, over the work", "1",
                 worst([energy_error(drum) for drum in drums], "worst row of time.csv"), reference=Estimate(0.0, 0.0), absolute=True,
                 tolerance=ENERGY_TOLERANCE, source="balance of energy", compared=False,
                 detail="what is lost is counted contact by contact, work and stored energy from moments, positions and speeds"),
        Quantity("power_ratio", "drum's power (moment × speed) over the power lost", "1", over("power"), reference=one,
                 tolerance=POWER_TOLERANCE, source="steady state", compared=False),
        Quantity("lift_over_weight", "mean force of the shell over the weight", "1", over("lift"), reference=one, tolerance=FORCE_TOLERANCE,
                 source="Newton's second law", compared=False),
        Quantity("impacts_per_revolution", "impacts per revolution", "1", over("impacts"),
                 detail=f"contacts that begin with {limit:g} m/s or more; {drums[0].logs} logs"),
        Quantity("impacts_per_log", "impacts per log and revolution", "1", over("impacts_per_log"), compared=False,
                 detail="the impacts of the line above over the number of logs; one between two logs counts once"),
        Quantity("peak_force_mean", "mean peak force of impacts", "N", over("peak_mean")),
        Quantity("peak_force_p99", "peak force that 1 % of the impacts exceed", "N", over("peak_p99")),
        Quantity("impulse_sum", "impulse of all contacts per revolution", "N s", over("impulse"),
                 detail="normal forces of impacts and of logs at rest on each other, over time"),
        Quantity("dissipated_energy", "energy lost per revolution", "J", over("lost")),
        Quantity("torque_arm", "drum's moment over weight × radius", "1", over("arm"),
                 detail="in the mean the horizontal distance of the logs' centre of mass from the axis, over the radius"),
        Quantity("shell_share", "share of the impacts that are on the shell", "1", over("shell")),
        Quantity("pivots_per_step", "pivots per step", "1", over("pivots"), compared=False,
                 detail="all solves of a step together; contacts that closed or opened where Gauss–Seidel solved it"),
    ]
    critical = math.sqrt(given["gravity"] / drums[0].radius)
    remarks = [
        f"{drums[0].logs} logs in a drum of radius {drums[0].radius:.3g} m; its speed is {given['drum_speed'] / critical:.0%} of the "
        "critical one, at which logs would stay at the shell all around.",
        "The last revolution of the first load of each engine lies as an animation (GIF) among the figures beside the report.",
        f"{KOLESNIKOV.short}: {KOLESNIKOV.statement}",
    ]
    if given["drum_radius"] is not None and given["drum_radius"] > 0.0:
        remarks.append("The drum's radius is given, so the number of logs follows from it and the filling; log_count is not used.")
    if len(replicas) < 3:
        remarks.append("With fewer than three loads the intervals come from quarter revolutions within the run.")
    return found, _profiles(drums, limit), remarks


def fields(replicas: Sequence[Replica], found: Sequence[Quantity]) -> Any:
    """Power of the impacts over the cross-section and along the shell, with quantities drawn from them."""
    from dembark.validation.checks.fields_drum import measure

    del found
    return measure(replicas)


def _profiles(drums: Sequence[Drum], limit: float) -> list[dict[str, Any]]:
    hit = np.nonzero(sum(np.histogram(drum.peak, FORCES)[0] for drum in drums))[0]
    forces = FORCES[max(0, hit[0] - 1) : hit[-1] + 3] if len(hit) else FORCES
    middle = np.sqrt(forces[1:] * forces[:-1])
    decades, width = np.diff(np.log10(forces)), float(np.diff(ANGLES)[0])
    place = 0.5 * (ANGLES[1:] + ANGLES[:-1])

    def per_log(drum: Drum, number: Array) -> Array:
        return np.asarray(number / (drum.logs * drum.revolutions))

    def exceeding(drum: Drum) -> Array:
        rest = np.array([np.count_nonzero(drum.peak > force) for force in forces], float)
        with np.errstate(divide="ignore"):
            return np.where(rest > 0, np.log10(per_log(drum, rest)), np.nan)

    def at_angle(drum: Drum, chosen: NDArray[np.bool_]) -> Array:
        return per_log(drum, np.histogram(drum.angle[chosen], ANGLES)[0].astype(float)) * 10.0 / width

    def hardness(drum: Drum) -> Array:
        inside = np.digitize(drum.angle, ANGLES) - 1
        chosen = [drum.peak[inside == k] for k in range(len(place))]
        return np.array([peaks.mean() / 1000.0 if len(peaks) >= 10 else np.nan for peaks in chosen])

    turned = (np.arange(20 * drums[0].revolutions) + 0.5) / 20.0

    def power(rows: Array, drum: Drum) -> Array:
        return np.asarray(rows.reshape(20 * drum.revolutions, ROWS // 20).sum(axis=1) / (drum.period / 20.0))

    note, around = f"approach ≥ {limit:g} m/s", "angle past the lowest point (°)"
    return [
        profile("peak_forces", "Peak forces of impacts", "log₁₀ of the peak force (N)", "per log, turn and decade", np.log10(middle),
                [per_log(drum, np.histogram(drum.peak, forces)[0].astype(float)) / decades for drum in drums], note=note),
        profile("peak_forces_exceeded", "Impacts harder than F", "log₁₀ of F (N)", "log₁₀ of number per log, turn", np.log10(forces),
                [exceeding(drum) for drum in drums], note=note),
        profile("impacts_at_angle", "Where logs meet", around, "per log, turn and 10°", place,
                [at_angle(drum, np.ones(len(drum.peak), bool)) for drum in drums], note="all impacts"),
        profile("shell_impacts_at_angle", "Where logs meet the shell", around, "per log, turn and 10°", place,
                [at_angle(drum, drum.shell) for drum in drums], note="impacts on the shell"),
        profile("peak_force_at_angle", "How hard they meet", around, "mean peak force (kN)", place, [hardness(drum) for drum in drums]),
        profile("power", "Power", "revolutions of the window", "power of the drum (W)", turned, [power(drum.work, drum) for drum in drums],
                reference=np.mean([power(drum.lost, drum) for drum in drums], axis=0), reference_label="power that is lost"),
    ]


def study(name: str, points: Sequence[dict[str, Any]], along: str) -> tuple[list[Quantity], list[dict[str, Any]], list[str]]:
    """The studies `filling` and `speed`: curves of impacts, peak forces and power, and the power of `along` that each grows with."""
    del name
    points = sorted(points, key=lambda point: point["parameters"][along])
    place = np.array([point["parameters"][along] for point in points], float)
    label = {"filling": "filling", "drum_speed": "speed of the drum (rad/s)"}.get(along, along.replace("_", " "))
    found, curves = [], []
    for quantity, title, unit, factor in (
        ("impacts_per_log", "Impacts per log and revolution", "1", 1.0), ("peak_force_mean", "Mean peak force", "kN", 1e-3),
        ("peak_force_p99", "Peak force that 1 % exceed", "kN", 1e-3), ("dissipated_energy", "Energy lost per revolution", "kJ", 1e-3),
        ("torque_arm", "Moment over weight × radius", "1", 1.0)):
        entries = [measured(point, quantity, factor) for point in points]
        values, halves = np.array([one.value for one in entries]), np.array([one.half for one in entries])
        found.append(Quantity(f"{quantity}_exponent", f"{title.lower()}: exponent of {along.replace('_', ' ')}", "1",
                              propagated(lambda y: float(np.polyfit(np.log(place), np.log(y), 1)[0]), values, halves),
                              detail=f"slope of a line through {len(points)} points on logarithmic axes"))
        curve = profile(quantity, title, label, title.lower() + ("" if unit == "1" else f" ({unit})"), place, [values])
        if np.isfinite(halves).all():
            curve |= {"low": (values - halves).tolist(), "high": (values + halves).tolist(), "band": "95 % interval"}
        curves.append(curve)
    remark = "Every point is a drum of the same size; the logs of each are loaded anew and run in for the same number of revolutions."
    return found, curves, [remark]
