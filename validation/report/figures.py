"""How engines look in figures; figures of the report as SVG, and tables as CSV."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pandas as pd
from markupsafe import Markup, escape
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import text_to_path
from matplotlib.ticker import NullLocator

from dembark.postproc.pictures import saved
from dembark.postproc.style import GREY, PALETTE, STYLE
from dembark.validation import engines
from dembark.validation.engines import EngineFacts
from dembark.validation.verification.item import Item, Panel

WIDE = 7.2  # inches
_DOTS = 220.0
_SUBSCRIPT = re.compile(r"\b([σρμδλτuvKM])_([a-z]+)")
DASHES = ((0, (4, 2)), (0, (1, 1.5)), (0, (5, 1.5, 1, 1.5)))
MARKS = ("o", "s", "D", "^", "v", "P")


def look(engine: str) -> EngineFacts:
    """Title, colour and marker of `engine` in all figures, among its facts; one that is not known gets a spare colour."""
    if engine in engines.names():
        return engines.facts(engine)
    taken = {engines.facts(name).colour for name in engines.names()}
    spare = [(paint, mark) for paint, mark in zip(PALETTE, MARKS, strict=True) if paint not in taken] or [(GREY, "x")]
    paint, mark = spare[sum(engine.encode()) % len(spare)]
    return EngineFacts(engine, engine, colour=paint, marker=mark)


def engine_name(engine: str) -> str:
    """As its makers write it."""
    return look(engine).title


def colour(engine: str) -> str:
    """Colour of an engine."""
    return look(engine).colour


def write_csv(path: Path, header: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """A table as CSV; None becomes an empty cell."""
    pd.DataFrame(list(rows), columns=list(header)).to_csv(path, index=False)


def svg(figure: Figure) -> bytes:
    """The figure as SVG text, the same for the same data."""
    return saved(figure, "svg", 100.0)


def png(figure: Figure) -> bytes:
    """The figure as PNG for the PDF, where the many paths of an SVG take seconds to lay out."""
    return saved(figure, "png", _DOTS)


def symbols(text: str) -> str:
    """Symbols like σ_zz with real subscripts, in figures."""
    return _SUBSCRIPT.sub(r"$\\mathrm{\1_{\2}}$", text)


def subscripts(text: str) -> Markup:
    """The same in HTML, and no break between a number and its per cent."""
    return Markup(_SUBSCRIPT.sub(r"\1<sub>\2</sub>", str(escape(text))).replace(" %", "\N{NO-BREAK SPACE}%"))


def text_width(text: str, points: float, weight: str = "normal") -> float:
    """Width in inches of a line in letters of `points`; symbols() makes it no wider."""
    width, _, _ = text_to_path.get_text_width_height_descent(text, FontProperties(size=points, weight=weight), ismath=False)
    # Small letters that are fitted to dots are up to a hundredth wider.
    return 1.02 * float(width) / 72.0


def text_lines(text: str, inches: float, points: float, weight: str = "normal") -> list[str]:
    """`text` in lines that are not wider than `inches`, but for a single word that is."""
    found: list[str] = []
    for word in text.split():
        longer = f"{found[-1]} {word}" if found else word
        found[-1:] = [longer] if found and text_width(longer, points, weight) <= inches else [*found[-1:], word]
    return found


def shortened(text: str, inches: float, points: float, weight: str = "normal") -> str:
    """As many words of `text` as fit into `inches`, but one at least, with an ellipsis for the others."""
    if text_width(text, points, weight) <= inches:
        return text
    first, *others = text_lines(text, inches - text_width(" …", points, weight), points, weight)
    return f"{first} …" if others else text


Curves = Mapping[str, Sequence[Mapping[str, Any]]]
Entries = Sequence[tuple[str, Mapping[str, Any]]]


def profile_names(profiles: Curves) -> list[str]:
    """Names of all profiles of a page, those with a reference first: what a reader looks for is whether it is met."""
    every = {one["name"]: one for of_engine in reversed(list(profiles.values())) for one in reversed(of_engine)}
    ordered = list(dict.fromkeys(one["name"] for of_engine in profiles.values() for one in of_engine))
    return sorted(ordered, key=lambda name: every[name].get("reference") is None)


def of_name(profiles: Curves, name: str) -> Entries:
    """The engines that have a profile of this name, with it."""
    return [(engine, one) for engine, of_engine in profiles.items() for one in of_engine if one["name"] == name]


def profile_figure(profiles: Curves, names: Sequence[str], columns: int = 2) -> Figure:
    """Profiles by name in one figure, the engines over the reference; `profiles` holds each engine's list."""
    return panels_figure([of_name(profiles, name) for name in names], columns)


def panels_figure(panels: Sequence[Entries], columns: int = 2) -> Figure:
    """A figure with a panel for each of `panels`, which are profiles with their engines."""
    rows = math.ceil(len(panels) / columns)
    tall = 1.8 * rows + 0.3
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(WIDE, tall))
        # Fixed margins: long titles must not make the panels narrow.
        figure.subplots_adjust(left=0.115, right=0.99, bottom=0.66 / tall, top=1.0 - 0.32 / tall, wspace=0.3, hspace=0.62)
        handles: dict[str, Any] = {}
        for number, entries in enumerate(panels):
            _panel(figure.add_subplot(rows, columns, number + 1), entries, handles)
        # In one row, however many engines there are: a second one would lie over the panels.
        count = len(handles)
        figure.legend(handles.values(), handles.keys(), loc="lower center", ncols=max(4, count), fontsize=min(7.5, 34.0 / max(1, count)))
    return figure


def _panel(axes: Any, entries: Entries, handles: dict[str, Any]) -> None:
    first = entries[0][1]
    upward = first["vertical"]
    for number, (engine, one) in enumerate(entries):
        place, paint = _numbers(one["place"]), colour(engine)

        def line(values: Any, place: Any = place, **style: Any) -> Any:
            return axes.plot(*((values, place) if upward else (place, values)), **style)[0]

        if one.get("reference") is not None:
            same = all(_same(other, one) for _, other in entries)
            if not same or not number:
                measured, ink = one.get("reference_low") is not None, GREY if same else paint
                shown = ("reference with interval" if measured else "reference") + ("" if same else f" ({engine_name(engine)})")
                style = {"marker": "o", "markersize": 2.5, "linestyle": "none"} if measured else {"linestyle": DASHES[number % 3]}
                handles.setdefault(shown, line(_numbers(one["reference"]), color=ink, linewidth=0.9, zorder=3, **style))
                if measured:
                    bars = axes.hlines if upward else axes.vlines
                    bars(place, _numbers(one["reference_low"]), _numbers(one["reference_high"]), color=ink, linewidth=0.9)
        if one.get("low") is not None:
            fill = axes.fill_betweenx if upward else axes.fill_between
            fill(place, _numbers(one["low"]), _numbers(one["high"]), color=paint, alpha=0.18, linewidth=0)
        # Where engines agree to the last digit the lines below must still be seen.
        below = 1.0 - number / max(1, len(entries) - 1)
        handles.setdefault(engine_name(engine),
                           line(_numbers(one["value"]), color=paint, linewidth=0.9 + 1.5 * below, alpha=0.6 if below else 1.0))
    wide, high = axes.get_position().width * WIDE, axes.get_position().height * axes.figure.get_figheight()
    beneath, aside = (first["across"], first["along"]) if upward else (first["along"], first["across"])
    upper, *others = text_lines(aside, high, 7.5) or [""]
    lower = shortened(" ".join(others), high, 7.5)
    axes.set(xlabel=symbols(shortened(beneath, wide, 7.5)), ylabel=symbols(f"{upper}\n{lower}" if lower else upper))
    labels = sorted({one["reference_label"] for _, one in entries if one.get("reference_label")})
    note = "; ".join([f"reference: {', '.join(labels)}"] * bool(labels) + [first["note"]] * bool(first.get("note")))
    axes.set_title(shortened(first["title"], wide, 8.5, "bold"), pad=10)
    axes.text(0.0, 1.015, symbols(shortened(note, wide, 5.8)), transform=axes.transAxes, fontsize=5.8, color="#666c75", va="bottom")
    if upward:
        axes.set_ylim(bottom=0.0)
        axes.set_xlim(left=min(0.0, axes.get_xlim()[0]))
    else:
        bottom, top = axes.get_ylim()
        axes.set_ylim(min(0.0, bottom), top + 0.05 * (top - bottom))


def _same(one: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    """Whether two engines have one and the same reference, so that one line will do."""
    values, others = (_numbers(each.get("reference") or []) for each in (one, other))
    return len(values) == len(others) and bool(np.allclose(values, others, rtol=1e-3, atol=1e-3 * np.nanmax(np.abs(others)),
                                                           equal_nan=True))


def _numbers(values: Sequence[float | None]) -> np.ndarray[Any, Any]:
    return np.array([math.nan if value is None else value for value in values], float)


def profile_table(of_engine: Mapping[str, Mapping[str, Any]]) -> tuple[list[str], list[list[Any]]]:
    """Header and rows of one profile of all engines; engines may have different places."""
    header = ["engine", "place", "value", "low", "high", "reference", "reference_low", "reference_high"]
    rows = []
    for engine, one in of_engine.items():
        columns = [one.get(key) or [None] * len(one["place"]) for key in header[1:]]
        rows += [[engine, *cells] for cells in zip(*columns, strict=True)]
    return header, rows


def verification_figure(item: Item) -> Figure | None:
    """The panels of an item of the verification side by side; None without any."""
    if not item.panels:
        return None
    with matplotlib.rc_context(STYLE):
        drawn = Figure(figsize=(WIDE, 2.1), layout="constrained")
        # A single panel is as large as one of two.
        places = drawn.subplots(1, max(2, len(item.panels)))
        for axes, panel in zip(places, item.panels, strict=False):
            _draw(axes, panel)
        for axes in places[len(item.panels) :]:
            axes.axis("off")
    return drawn


def _draw(axes: Any, panel: Panel) -> None:
    number = 0
    for curve in panel.curves:
        if curve.theory:
            axes.plot(curve.place, curve.value, color=GREY, linewidth=0.9, linestyle=DASHES[0], label=curve.label)
        else:
            axes.plot(curve.place, curve.value, color=PALETTE[number % len(PALETTE)], marker=MARKS[number % len(MARKS)], markersize=3.2,
                      linewidth=1.1, label=curve.label)
            number += 1
    axes.set(yscale="log", xlabel=panel.along, ylabel=panel.across)
    axes.set_title(panel.title, fontsize=7.5)
    if not panel.linear:
        axes.set_xscale("log")
        places = np.unique(np.concatenate([np.asarray(curve.place) for curve in panel.curves]))
        if len(places) <= 5:
            axes.set_xticks(places, [f"{place:.2g}" for place in places], minor=False, fontsize=6)
            axes.xaxis.set_minor_locator(NullLocator())
    axes.legend(fontsize=6.5)


def verification_table(item: Item) -> tuple[list[str], list[list[Any]]]:
    """Header and rows of all curves of an item of the verification."""
    return ["panel", "curve", "place", "value"], [[panel.title, curve.label, float(place), float(value)]
        for panel in item.panels for curve in panel.curves for place, value in zip(curve.place, curve.value, strict=True)]
