"""The outcome of one or several loads as lines of text, as a Dataset and as figures."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from itertools import cycle

import matplotlib
import numpy as np
import xarray
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from dembark.common.errors import DembarkError

from ..output.netcdf import cf_dataset, variable, with_interval
from ..resampling import pooled
from ..statistics import Estimate, over_replicas
from ..style import PALETTE, STYLE
from .outcomes import CLEAN, Outcome

Array = NDArray[np.float64]

# Label, unit and factor to it, in the order of the summary.
LABELS = {
    "useful_impacts": ("impacts in the range, per log and revolution", "", 1.0),
    "damaging_impacts": ("impacts above it, per log and revolution", "", 1.0),
    "damaging_share": ("share of the effective impacts above the range", "%", 100.0),
    "friction_work": ("work of friction per area and revolution", "J/m²", 1.0),
    "wood_loss_index": ("wood-loss index, per revolution", "J/kg", 1.0),
    "sector_dispersion": ("dispersion around the logs (1: at random)", "", 1.0),
    "debarking_degree": ("degree of debarking at the end", "%", 100.0),
    "debarking_time": (f"time to {CLEAN:.0%} if it goes on", "min", 1.0 / 60.0),
}


def check_alike(results: Sequence[Outcome]) -> None:
    """DembarkError where loads that are taken together differ in the period of the drum or in the number of revolutions."""
    first = results[0]
    name, period, turns = first.load.name or "load 1", first.load.period, first.revolutions
    for number, one in enumerate(results[1:], start=2):
        other = one.load.name or f"load {number}"
        if not math.isclose(one.load.period, period, rel_tol=1e-9):
            raise DembarkError(f"{other} is of a drum with {one.load.period:.6g} s a revolution, {name} of one with {period:.6g} s", "",
                               "compare them with --against, or name them in separate calls")
        if len(one.revolutions) != len(turns):
            raise DembarkError(f"{other} has {one.revolutions[-1]:.6g} revolutions, {name} has {turns[-1]:.6g}", "",
                               f"give --end {min(result.load.end for result in results):.12g}, or name them in separate calls")


def pooled_values(results: Sequence[Outcome]) -> dict[str, Estimate]:
    """Each value over the loads, which must be alike."""
    check_alike(results)
    return {name: pooled([one.values for one in results], name) for name in results[0].values}


def lines(results: Sequence[Outcome]) -> list[str]:
    """The summary."""
    first = results[0]
    peaks = [one.doses.peaks for one in results]
    every, revolutions = np.concatenate(peaks), first.revolutions[-1]
    logs = " and ".join(str(number) for number in sorted({len(one.load.logs.ids) for one in results}))
    found = [(f"{len(results)} load{'s' if len(results) > 1 else ''} of {logs} logs, {revolutions:.4g} revolutions of "
              f"{first.load.period:.3g} s each, from {first.load.begin:.4g} s on"),
             f"range of forces: {first.forces.bark:.4g} to {first.forces.wood:.4g} N"]
    for name, estimate in pooled_values(results).items():
        label, unit, factor = LABELS[name]
        if not math.isnan(estimate.value):
            half = f" ± {factor * estimate.half:.2g}" if math.isfinite(estimate.half) else ""
            found.append(f"{label}: {factor * estimate.value:.4g}{half}{unit and ' '}{unit}")
    if len(every):
        p99 = over_replicas([Estimate(float(np.percentile(one, 99.0)), math.inf) for one in peaks if len(one)])
        half = f" ± {p99.half:.2g}" if math.isfinite(p99.half) else ""
        shape = np.median(np.concatenate([one.doses.shape for one in results]))
        bound = max(one.load.bound for one in results)
        of_bound = "" if math.isnan(bound) else f", none can exceed {bound:.4g} N by its energy"
        found += [f"peak force of impacts: 99 % are at most {p99.value:.4g}{half} N, the largest is {every.max():.4g} N{of_bound}",
                  f"peak force over that of a half sine of the same impulse and duration: median {shape:.3f}"]
    if len(results) < 3:
        found.append("intervals are from quarter revolutions; three or more loads give those over loads")
    return found


def dataset(results: Sequence[Outcome], **attributes: str | float) -> xarray.Dataset:
    """Degree of debarking over time of each load, and doses of each log and sector, (load, log, sector). The logs are in the order of their
    ids; where a load has fewer logs than another, NaN follow."""
    first, means = results[0], pooled_values(results)
    dimensions = ("load", "log", "sector")

    def table(name: str) -> Array:
        return _padded([getattr(one.doses, name).sum(axis=0) for one in results])

    variables = {
        "degree": variable(("load", "revolutions"), [one.degree for one in results], "1", "degree of debarking"),
        "useful_impacts": variable(dimensions, table("useful"), "1", "impacts with a peak force in the range"),
        "damaging_impacts": variable(dimensions, table("damaging"), "1", "impacts with a peak force above the range"),
        "friction_work": variable(dimensions, table("friction"), "J", "energy lost by friction on the log"),
        "radius": variable(("load", "log"), _padded([one.load.logs.radii for one in results]), "m", "radius of the log"),
        "mass": variable(("load", "log"), _padded([one.load.logs.masses for one in results]), "kg", "mass of the log"),
    }
    for name, estimate in means.items():
        variables |= with_interval(f"mean_{name}", ("mean",), [estimate], "1", f"{LABELS[name][0]}, in SI units")
    sectors = first.doses.useful.shape[2]
    coordinates = {"revolutions": variable(("revolutions",), first.revolutions, "1", "revolutions from the begin of the window"),
                   "sector": variable(("sector",), (np.arange(sectors) + 0.5) * 360.0 / sectors, "degree", "angle in the log's own frame")}
    return cf_dataset(variables, coordinates, bark_force=first.forces.bark, wood_force=first.forces.wood, period=first.load.period,
                      **attributes)


def _padded(rows: Sequence[Array]) -> Array:
    """Arrays of one row for each log as one array (loads, logs, ...), with NaN after the last log of a load."""
    found = np.full((len(rows), max(map(len, rows)), *rows[0].shape[1:]), np.nan)
    for place, one in zip(found, rows, strict=True):
        place[: len(one)] = one
    return found


def against(groups: Mapping[float, Sequence[Outcome]], label: str) -> Figure:
    """Degree of debarking of drums that differ in one number, named `label`: against residence time, and against that number after three
    residence times. Logs that are hit evenly around at the mean rates of the window; bands and bars are 95 % intervals over loads."""
    order = sorted(groups)
    times = [pooled_values(groups[value])["debarking_time"].value for value in order]
    # Where a log is never hit, 90 % may never be reached: then as long as was measured.
    longest = max([one for one in times if math.isfinite(one)] or [groups[value][0].revolutions[-1] * groups[value][0].load.period
                                                                   for value in order])

    def degree(results: Sequence[Outcome], seconds: float) -> Estimate:
        return over_replicas([Estimate(100.0 * float(one.even(np.array([seconds / one.load.period]))[0]), math.inf) for one in results])

    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(7.2, 2.8), layout="constrained")
        over_time, across = figure.subplots(1, 2, sharey=True)
        seconds = np.linspace(0.0, 1.2 * longest, 61)
        for colour, value in zip(cycle(PALETTE), order, strict=False):
            found = [degree(groups[value], float(one)) for one in seconds]
            middle, half = np.array([one.value for one in found]), np.array([one.half for one in found])
            over_time.plot(seconds / 60.0, middle, color=colour, label=f"{value:g}")
            over_time.fill_between(seconds / 60.0, middle - half, middle + half, where=np.isfinite(half), color=colour, alpha=0.2, lw=0.0)
        over_time.set(xlabel="residence time (min)", ylabel="degree of debarking (%)", ylim=(0, 102), xlim=(0, seconds[-1] / 60.0))
        over_time.legend(title=label, loc="lower right")
        for number, share in enumerate((0.25, 0.5, 1.0)):
            found = [degree(groups[value], share * longest) for value in order]
            bars = [one.half if math.isfinite(one.half) else 0.0 for one in found]
            across.errorbar(order, [one.value for one in found], bars, fmt="o-", ms=3, capsize=2, color=PALETTE[number],
                            label=f"{share * longest / 60.0:.2g} min")
        across.set(xlabel=label)
        across.legend(title="residence time", loc="lower right")
    return figure


def figures(results: Sequence[Outcome]) -> dict[str, Figure]:
    """Degree of debarking against revolutions and residence time; doses around the logs and by diameter; peak forces. Of loads that are
    alike."""
    check_alike(results)
    with matplotlib.rc_context(STYLE):
        found = {"doses": _doses(results), "forces": _forces(results)}
        if results[0].law is not None:
            found["degree"] = _degree(results)
    return found


def _degree(results: Sequence[Outcome]) -> Figure:
    figure = Figure(figsize=(4.2, 2.8), layout="constrained")
    axes = figure.subplots()
    period = results[0].load.period
    for number, one in enumerate(results):
        axes.plot(one.revolutions, 100.0 * one.degree, color=PALETTE[0], lw=1.2, label=None if number else "measured, each load")
    time = results[0].values["debarking_time"].value
    far = max(results[0].revolutions[-1], 1.3 * time / period) if math.isfinite(time) else results[0].revolutions[-1]
    turns = np.linspace(0.0, far, 200)
    axes.plot(turns, 100.0 * np.mean([one.even(turns) for one in results], axis=0), color=PALETTE[1], ls="--",
              label="mean rates, hit evenly around")
    axes.set(xlabel="revolutions", ylabel="degree of debarking (%)", ylim=(0, 102), xlim=(0, far))
    ratio = period / 60.0
    top = axes.secondary_xaxis("top", functions=(partial(np.multiply, ratio), partial(np.multiply, 1.0 / ratio)))
    top.set_xlabel("residence time (min)")
    axes.legend(loc="lower right")
    return figure


def _doses(results: Sequence[Outcome]) -> Figure:
    sectors = results[0].doses.useful.shape[2]
    figure = Figure(figsize=(7.2 if sectors > 1 else 3.6, 2.5), layout="constrained")
    panels = figure.subplots(1, 2 if sectors > 1 else 1, squeeze=False)[0]
    across, tables = panels[-1], [one.doses.effective.sum(axis=0) / one.revolutions[-1] for one in results]
    if sectors > 1:
        _around(panels[0], tables)
    for one, table in zip(results, tables, strict=True):
        across.plot(2e3 * one.load.logs.radii, table.sum(axis=1), ".", color=PALETTE[0], ms=3)
    across.set(xlabel="diameter of the log (mm)", ylabel="effective impacts per revolution")
    across.set_ylim(bottom=0.0)
    return figure


def _around(around: Axes, tables: Sequence[Array]) -> None:
    sectors = tables[0].shape[1]
    angle = (np.arange(sectors) + 0.5) * 360.0 / sectors
    spread = np.concatenate([table / np.maximum(table.mean(axis=1, keepdims=True), 1e-300) for table in tables])
    for share, colour in ((10, PALETTE[2]), (50, PALETTE[0]), (90, PALETTE[1])):
        around.plot(angle, np.percentile(spread, share, axis=0), color=colour, label=f"{share} % of the logs are below")
    around.set(xlabel="angle in the log's own frame (°)", ylabel="effective impacts over the log's mean", xlim=(0, 360))
    around.set_ylim(bottom=0.0)
    around.legend()


def _forces(results: Sequence[Outcome]) -> Figure:
    figure = Figure(figsize=(4.2, 2.6), layout="constrained")
    axes = figure.subplots()
    peaks = np.concatenate([one.doses.peaks for one in results])
    peaks = peaks[peaks > 0.0]
    turns = sum(one.revolutions[-1] * len(one.load.logs.ids) for one in results)
    if len(peaks):
        edges = np.geomspace(max(peaks.min(), 1e-4 * peaks.max()), peaks.max() * 1.001, 41)
        axes.stairs(np.histogram(peaks, edges)[0] / turns / np.diff(np.log10(edges)), edges, color=PALETTE[0])
    forces = results[0].forces
    axes.axvspan(forces.bark, forces.wood, color=PALETTE[2], alpha=0.2, lw=0.0, label="removes bark, spares wood")
    axes.set(xscale="log", xlabel="peak force (N)", ylabel="impacts per log, revolution, decade")
    axes.legend(loc="upper right")
    return figure
