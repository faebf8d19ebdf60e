"""Figures of a campaign: quantities along the swept parameters, and maps over two of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from dembark.postproc.style import GREY, SEQUENTIAL, STYLE
from dembark.validation.judge.result import QuantityRecord
from dembark.validation.report.figures import MARKS, WIDE, colour, engine_name, symbols

from .calibration import Fit
from .sensitivity import Sensitivity
from .sweeps import Sweep, words

_DASHES = ["-", (0, (5, 2)), (0, (1, 1.5)), (0, (5, 1.5, 1, 1.5)), (0, (8, 3))]
COLUMNS = 3


def _panels(count: int, height: float = 1.95) -> tuple[Figure, list[Any]]:
    rows = max(1, math.ceil(count / COLUMNS))
    tall = height * rows + 0.5
    figure = Figure(figsize=(WIDE, tall))
    figure.subplots_adjust(left=0.075, right=0.985, bottom=0.85 / tall, top=1.0 - 0.3 / tall, wspace=0.42, hspace=0.55)
    return figure, [figure.add_subplot(rows, COLUMNS, number + 1) for number in range(count)]


def study_figure(sweep: Sweep, quantities: Sequence[QuantityRecord]) -> Figure | None:
    """Each quantity along the sweep's main axis with 95 % intervals, a line for each combination of the others and engine; its
    reference dashed in grey. None for a sweep without a numeric axis."""
    along = sweep.along
    if along is None or not quantities or sweep.sample:
        return None
    with matplotlib.rc_context(STYLE):
        figure, panels = _panels(len(quantities))
        handles: dict[str, Any] = {}
        for axes, quantity in zip(panels, quantities, strict=True):
            _study_panel(axes, sweep, along, quantity, handles)
        figure.legend(handles.values(), handles.keys(), loc="lower center", ncols=min(4, max(1, len(handles))), fontsize=6.8)
    return figure


def _study_panel(axes: Any, sweep: Sweep, along: str, quantity: QuantityRecord, handles: dict[str, Any]) -> None:
    for engine in sweep.engines:
        for number, (others, line) in enumerate(sweep.lines(along, engine, quantity.name)):
            place = np.array([at for at, _ in line])
            value = np.array([one.value for _, one in line], float)
            style = {"color": colour(engine), "linestyle": _DASHES[number % len(_DASHES)], "marker": MARKS[number % len(MARKS)]}
            handle = axes.errorbar(place, value, yerr=_bars(line), markersize=3.2, elinewidth=0.7, linewidth=1.1, **style)
            label = engine_name(engine) + (f", {words(others)}" if others else "")
            handles.setdefault(label, handle)
            known = [(at, one.reference) for at, one in line if one.reference is not None]
            if known:
                (reference,) = axes.plot(*zip(*known, strict=True), color=GREY, linewidth=0.8, linestyle=_DASHES[1], alpha=0.8, zorder=1)
                handles.setdefault("reference", reference)
    axes.set(xlabel=sweep.label(along), ylabel=_unit(quantity))
    axes.set_title(_title(quantity), fontsize=7.0)
    low, high = sweep.levels(along)[0], sweep.levels(along)[-1]
    if low > 0 and high / low > 20:
        axes.set_xscale("log")


def sample_figure(sweep: Sweep, quantities: Sequence[QuantityRecord]) -> Figure | None:
    """Each quantity of a sample against each parameter, with 95 % intervals. None for a sweep that is no sample."""
    if not sweep.sample or not quantities:
        return None
    pairs = [(quantity, axis) for quantity in quantities for axis in sweep.axes if sweep.numeric(axis)]
    with matplotlib.rc_context(STYLE):
        figure, panels = _panels(len(pairs))
        handles: dict[str, Any] = {}
        for axes, (quantity, axis) in zip(panels, pairs, strict=True):
            for number, engine in enumerate(sweep.engines):
                found = [(float(point.values[axis]), one) for point in sweep.points if (one := point.quantity(engine, quantity.name))]
                handle = axes.errorbar([at for at, _ in found], [one.value for _, one in found], yerr=_bars(found), linestyle="",
                                       color=colour(engine), marker=MARKS[number % len(MARKS)], markersize=2.4, elinewidth=0.5, alpha=0.7)
                handles.setdefault(engine_name(engine), handle)
            axes.set(xlabel=sweep.label(axis), ylabel=_unit(quantity))
            axes.set_title(_title(quantity), fontsize=7.0)
            if sweep.sample["parameters"][axis].startswith("log"):
                axes.set_xscale("log")
        figure.legend(handles.values(), handles.keys(), loc="lower center", ncols=min(4, max(1, len(handles))), fontsize=6.8)
    return figure


def sensitivity_figure(found: Sequence[Sensitivity], panels: int) -> Figure | None:
    """Bars of what each parameter does, a panel for each of the first quantities, with 95 % intervals; dashed: below it nothing matters.
    None where nothing was analysed."""
    analysed = [one for one in found if one.effects]
    names = list(dict.fromkeys(one.quantity.name for one in analysed))[:panels]
    if not names:
        return None
    rows = len(analysed[0].effects)
    lines = list(dict.fromkeys((one.engine, one.at) for one in analysed))
    thick = 0.8 / len(lines)
    with matplotlib.rc_context(STYLE):
        figure, drawn = _panels(len(names), max(1.2, 0.5 + 0.26 * rows))
        figure.subplots_adjust(left=0.17, wspace=0.75)
        handles: dict[str, Any] = {}
        for axes, name in zip(drawn, names, strict=True):
            for one in (one for one in analysed if one.quantity.name == name):
                number = lines.index((one.engine, one.at))
                at = np.arange(rows) + thick * (number - 0.5 * (len(lines) - 1))
                paler = 1.0 / (1 + [each for each, _ in lines[:number]].count(one.engine))
                bars = axes.barh(at, [each.index for each in one.effects], xerr=[each.half for each in one.effects], height=0.9 * thick,
                                 color=colour(one.engine), alpha=paler, error_kw={"elinewidth": 0.8})
                handles.setdefault(", ".join(filter(None, (engine_name(one.engine), one.at))), bars)
                (other,) = axes.plot([each.other for each in one.effects], at, linestyle="", marker="|", markersize=5.0, color="black")
                handles.setdefault("σ of the effects" if one.design == "morris" else "first-order index", other)
                axes.axvline(one.limit, color=GREY, linewidth=0.8, linestyle=_DASHES[1])
                axes.set_yticks(range(rows), [each.parameter.replace("_", " ") for each in one.effects])
                axes.set_xlabel("total index" if one.design == "saltelli" else f"μ*, {_unit(one.quantity)}")
                axes.set_title(_title(one.quantity, 30), fontsize=7.0)
            axes.invert_yaxis()
        figure.legend(handles.values(), handles.keys(), loc="lower center", ncols=min(4, len(handles)), fontsize=6.8)
    return figure


def posterior_figure(sweep: Sweep, fit: Fit) -> Figure | None:
    """Marginal densities of the fitted parameters on the diagonal, joint ones below, with the most probable point. None without a fit."""
    if fit.values is None:
        return None
    count = len(fit.parameters)
    with matplotlib.rc_context(STYLE | {"axes.grid": False}):
        figure = Figure(figsize=(WIDE, WIDE * 0.28 * count + 0.4))
        drawn = figure.subplots(count, count, squeeze=False, gridspec_kw={"wspace": 0.35, "hspace": 0.35})
        for row, below in enumerate(fit.parameters):
            for column, left in enumerate(fit.parameters):
                axes = drawn[row, column]
                if column > row:
                    axes.set_axis_off()
                    continue
                if row == column:
                    axes.hist(fit.values[:, row], bins=40, color=colour(fit.engine), density=True)
                    axes.set_yticks([])
                    for end in (left.low, left.high):
                        axes.axvline(end, color=GREY, linewidth=0.8, linestyle=_DASHES[1])
                else:
                    axes.hist2d(fit.values[:, column], fit.values[:, row], bins=40, cmap=SEQUENTIAL)
                    axes.plot(left.best, below.best, marker="+", color="white")
                if row == count - 1:
                    axes.set_xlabel(sweep.label(left.name))
                if column == 0 and row:
                    axes.set_ylabel(sweep.label(below.name))
    return figure


def _bars(line: Sequence[tuple[float, QuantityRecord]]) -> np.ndarray[Any, Any]:
    """Lower and upper parts (2, n) of the 95 % intervals."""
    values = np.array([one.value for _, one in line], float)
    ends = np.array([one.interval or (one.value, one.value) for _, one in line], float)
    return np.stack([values - ends[:, 0], ends[:, 1] - values]).clip(min=0.0)


def _unit(quantity: QuantityRecord) -> str:
    return "dimensionless" if quantity.unit == "1" else quantity.unit


def _title(quantity: QuantityRecord, length: int = 36) -> str:
    return symbols(quantity.title if len(quantity.title) <= length else quantity.name.replace("_", " "))


def map_axes(sweep: Sweep) -> tuple[str, str] | None:
    """The two axes of a map: of a sweep that is a full grid over exactly two axes with at least two values each."""
    if sweep.sample:
        return None
    wide = [axis for axis in sweep.axes if len(sweep.levels(axis)) > 1]
    if len(wide) != 2:
        return None
    down, across = sorted(wide, key=lambda axis: len(sweep.levels(axis)))
    return across, down


def map_figure(sweep: Sweep, engine: str, quantities: Sequence[QuantityRecord]) -> Figure | None:
    """Maps of quantities over the two axes of a sweep; a frame marks points that failed their check. None when there are not two."""
    axes_names = map_axes(sweep)
    if axes_names is None or not quantities:
        return None
    across, down = axes_names
    columns, rows = sweep.levels(across), sweep.levels(down)
    with matplotlib.rc_context(STYLE | {"axes.grid": False}):
        figure, panels = _panels(len(quantities), min(1.95, 0.95 + 0.32 * len(rows)))
        for axes, quantity in zip(panels, quantities, strict=True):
            values = np.full((len(rows), len(columns)), np.nan)
            failed = []
            for point in sweep.points:
                one = point.quantity(engine, quantity.name)
                cell = rows.index(point.values[down]), columns.index(point.values[across])
                if one is not None:
                    values[cell] = one.value
                    failed += [cell] if one.standing == "failed" else []
            image = axes.imshow(values, origin="lower", aspect="auto", cmap=SEQUENTIAL)
            for (row, column), value in np.ndenumerate(values):
                text = "–" if np.isnan(value) else f"{value:.3g}"
                bright = not np.isnan(value) and image.norm(value) < 0.55
                axes.text(column, row, text, ha="center", va="center", fontsize=6.0, color="white" if bright else "black")
            for row, column in failed:
                axes.add_patch(matplotlib.patches.Rectangle((column - 0.47, row - 0.47), 0.94, 0.94, fill=False, edgecolor="#b0321e",
                                                            linewidth=1.4))
            axes.set_xticks(range(len(columns)), [_short(one) for one in columns])
            axes.set_yticks(range(len(rows)), [_short(one) for one in rows])
            axes.set(xlabel=sweep.label(across), ylabel=sweep.label(down))
            axes.set_title(_title(quantity, 30) + ("" if quantity.unit == "1" else f" ({quantity.unit})"), fontsize=6.5)
        figure.text(0.5, 0.02, engine_name(engine), ha="center", color=colour(engine), fontsize=7.5, weight="bold")
    return figure


def _short(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
