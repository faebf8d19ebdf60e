"""Figures of the report as SVG, and their data as CSV."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from dembark.postproc.style import STYLE
from dembark.validation import engines
from dembark.postproc.statistics import Scatter, scatter
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

# For results of engines that are not registered: the rest of the engines' palette.
_SPARE = ["#009E73", "#CC79A7", "#E69F00", "#56B4E9"]


def colour(engine: str) -> str:
    """Colour of an engine in all figures."""
    return engines.facts(engine).colour if engine in engines.names() else _SPARE[sum(engine.encode()) % len(_SPARE)]


def marker(engine: str) -> str:
    """Marker of an engine in all figures."""
    return engines.facts(engine).marker if engine in engines.names() else "^"


def engine_name(engine: str) -> str:
    """As its makers write it."""
    return engines.facts(engine).title if engine in engines.names() else engine


def write_csv(path: Path, header: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """A table as CSV; None becomes an empty cell."""
    with path.open("w", newline="", encoding="utf-8") as handle:
        writer = csv.writer(handle)
        writer.writerow(header)
        writer.writerows([["" if cell is None else cell for cell in row] for row in rows])


def svg(figure: Figure) -> bytes:
    """The figure as SVG text, the same for the same data."""
    buffer = io.BytesIO()
    with matplotlib.rc_context(STYLE):
        figure.savefig(buffer, format="svg", metadata={"Date": None})
    return buffer.getvalue()


def profile_figure(profiles: Mapping[str, Sequence[dict[str, Any]]], columns: int = 3) -> Figure:
    """All profiles of a page in one figure, the engines over the reference; `profiles` holds each engine's list."""
    names = list(dict.fromkeys(one["name"] for of_engine in profiles.values() for one in of_engine))
    rows = max(1, math.ceil(len(names) / columns))
    with matplotlib.rc_context(STYLE):
        tall = 2.35 * rows + 0.35
        figure = Figure(figsize=(7.2, tall))
        # Fixed margins: long titles must not make the panels narrow.
        figure.subplots_adjust(left=0.065, right=0.99, bottom=0.8 / tall, top=1.0 - 0.38 / tall, wspace=0.34, hspace=0.52)
        handles: dict[str, Any] = {}
        for number, name in enumerate(names):
            axes = figure.add_subplot(rows, columns, number + 1)
            _panel(axes, [(engine, one) for engine, of_engine in profiles.items() for one in of_engine if one["name"] == name], handles)
        figure.legend(handles.values(), handles.keys(), loc="lower center", ncols=4, fontsize=7.5)
    return figure


def _panel(axes: Any, entries: Sequence[tuple[str, dict[str, Any]]], handles: dict[str, Any]) -> None:
    first = entries[0][1]
    dashes = iter([(0, (4, 2)), (0, (1, 1.5))])
    for engine, one in entries:
        place, value = _numbers(one["place"]), _numbers(one["value"])
        paint = colour(engine)
        if one.get("reference") is not None:
            style = {"color": "#4a4f57" if len(entries) == 1 else paint, "linestyle": next(dashes, ":"), "linewidth": 1.0, "alpha": 0.85}
            reference = _numbers(one["reference"])
            (handle,) = axes.plot(reference, place, **style) if one["vertical"] else axes.plot(place, reference, **style)
            handles.setdefault(f"reference ({engine_name(engine)})", handle)
        if one.get("low") is not None:
            fill = axes.fill_betweenx if one["vertical"] else axes.fill_between
            fill(place, _numbers(one["low"]), _numbers(one["high"]), color=paint, alpha=0.18, linewidth=0)
        (handle,) = axes.plot(value, place, color=paint) if one["vertical"] else axes.plot(place, value, color=paint)
        handles.setdefault(engine_name(engine), handle)
    across, along = symbols(first["across"]), symbols(first["along"])
    axes.set(**({"xlabel": across, "ylabel": along} if first["vertical"] else {"xlabel": along, "ylabel": across}))
    labels = sorted({one["reference_label"] for _, one in entries if one.get("reference_label")})
    note = "; ".join([*labels, *([first["note"]] if first.get("note") else [])])
    axes.set_title(first["title"], pad=11)
    if note:
        axes.text(
            0.0,
            1.01,
            symbols(f"reference: {note}" if labels else note),
            transform=axes.transAxes,
            fontsize=5.8,
            color="#666c75",
            va="bottom",
        )
    if first["vertical"]:
        axes.set_ylim(bottom=0.0)
        axes.set_xlim(left=min(0.0, axes.get_xlim()[0]))
    else:
        low, high = axes.get_ylim()
        axes.set_ylim(min(0.0, low), high + 0.05 * (high - low))


def symbols(text: str) -> str:
    return re.sub(r"([σρμKv])_([a-z]+)", r"$\\mathrm{\1_{\2}}$", text)


def _numbers(values: Sequence[float | None]) -> np.ndarray[Any, Any]:
    return np.array([math.nan if value is None else value for value in values], float)


def profile_table(of_engine: Mapping[str, dict[str, Any]]) -> tuple[list[str], list[list[Any]]]:
    """Header and rows of one profile of all engines; engines may have different places."""
    header = ["engine", "place", "value", "low", "high", "reference"]
    rows = []
    for engine, one in of_engine.items():
        count = len(one["place"])
        columns = [one.get(key) or [None] * count for key in ("place", "value", "low", "high", "reference")]
        rows += [[engine, *cells] for cells in zip(*columns, strict=True)]
    return header, rows


def pairs(quantities: Iterable[tuple[str, dict[str, Any]]]) -> list[tuple[str, float, float, float, float]]:
    """(name, value, reference, relative half-widths of both) of the quantities that a ratio makes sense for."""
    found = []
    for name, one in quantities:
        value, reference = one["value"], one["reference"]
        if one.get("deviation_kind") == "absolute" or value is None or reference is None or value <= 0 or reference <= 0:
            continue
        halves = [
            0.5 * (one[key][1] - one[key][0]) / middle if one.get(key) else 0.0
            for key, middle in (("interval", value), ("reference_interval", reference))
        ]
        found.append((name, value, reference, *halves))
    return found


def statistics(found: Sequence[tuple[str, float, float, float, float]]) -> Scatter | None:
    """Scatter statistics of `pairs`; None for fewer than three. sigma_E is the references' own: half of their 95 % half-widths, rms."""
    if len(found) < 3:
        return None
    sigma = math.sqrt(sum((0.5 * reference_half) ** 2 for *_, reference_half in found) / len(found))
    return scatter([one[1] for one in found], [one[2] for one in found], sigma)


def scatter_figure(groups: Mapping[str, Sequence[tuple[str, float, float, float, float]]], tolerance: float = 0.10) -> Figure:
    """Measured against reference, all quantities on logarithmic axes; `groups` (by key: engine name or 'engines') of `pairs`."""
    everything = [one for group in groups.values() for one in group]
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(7.2, 3.1), layout="constrained")
        axes, ratio = figure.subplots(1, 2, width_ratios=[1.0, 1.25])
        ends = [value for one in everything for value in one[1:3]] or [0.1, 10.0]
        # Whole decades, so that every axis has numbers on it.
        line = 10.0 ** np.array([math.floor(math.log10(min(ends))), math.ceil(math.log10(max(ends)))])
        for one in (axes, ratio):
            one.set_xscale("log")
            one.set_xlim(line)
            one.xaxis.set_minor_formatter(NullFormatter())
        axes.set(yscale="log", ylim=line, xlabel="reference", ylabel="measured", title="Measured against reference")
        axes.yaxis.set_minor_formatter(NullFormatter())
        axes.plot(line, line, color="#4a4f57", linewidth=0.8)
        axes.fill_between(line, line * (1 - tolerance), line * (1 + tolerance), color="#4a4f57", alpha=0.12, linewidth=0)
        ratio.axhspan(1 - tolerance, 1 + tolerance, color="#4a4f57", alpha=0.12, linewidth=0)
        ratio.axhline(1.0, color="#4a4f57", linewidth=0.8)
        ratio.set(xlabel="reference", ylabel="measured / reference", title="Bias and scatter")
        for key, group in groups.items():
            if not group:
                continue
            paint, shape = (colour(key), marker(key)) if key != "engines" else ("#009E73", "D")
            label = "engine against engine" if key == "engines" else f"{engine_name(key)} against theory"
            _, value, reference, value_half, reference_half = (np.array(column) for column in zip(*group, strict=True))
            value, reference, value_half, reference_half = (
                column.astype(float) for column in (value, reference, value_half, reference_half)
            )
            style = {
                "fmt": shape,
                "color": paint,
                "markersize": 3.4,
                "elinewidth": 0.6,
                "markeredgecolor": "white",
                "markeredgewidth": 0.4,
            }
            axes.errorbar(
                reference,
                value,
                yerr=np.minimum(value * value_half, 0.9 * value),
                xerr=np.minimum(reference * reference_half, 0.9 * reference),
                **style,
            )
            found = statistics(group)
            if found:
                label += f": δ = {found.bias:.3f}, σ = {found.model:.3f} ({found.count} pairs)"
                ratio.axhline(found.bias, color=paint, linewidth=0.9)
                ratio.axhspan(found.bias - 2 * found.model, found.bias + 2 * found.model, color=paint, alpha=0.08, linewidth=0)
            ratio.errorbar(
                reference, value / reference, yerr=value / reference * np.hypot(value_half, reference_half), label=label, **style
            )
        if everything:
            spread = max(0.3, 1.4 * max(abs(one[1] / one[2] - 1.0) for one in everything))
            ratio.set_ylim(max(0.0, 1.0 - spread), 1.0 + spread)
            figure.legend(loc="outside lower center", ncols=1 if len(groups) > 3 else 2, fontsize=6.5, handlelength=1.2, columnspacing=1.2)
        else:
            ratio.text(0.5, 0.5, "no pairs to show", transform=ratio.transAxes, ha="center", color="#666c75")
    return figure
