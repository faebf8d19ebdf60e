"""The chapter on verification: the instruments on problems with known answers, and what the runs themselves say about them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib
import numpy as np
from dembark.validation import verification
from dembark.validation.report.figures import STYLE, engine_name
from dembark.validation.report.gather import Page
from dembark.validation.verification.item import Item, Panel
from matplotlib.figure import Figure

_PAINTS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")
_MARKS = ("o", "s", "D", "^")
# Quantities of the cases that test an instrument, not the physics.
_FROM_RUNS = ("wall_force_deviation", "field_momentum_residual", "field_balance_deviation", "eulerian_lagrangian_difference",
              "scheme_deviation")


@dataclass(frozen=True)
class Chapter:
    """Stands for the chapter where a row of the verdict table names its page."""

    case: str = "verification"
    variant: str = "instruments"
    anchor: str = "verification"
    name: str = "verification"


def rows(items: Sequence[Item]) -> list[dict[str, Any]]:
    """The items' quantities as rows of the verdict table."""
    return [quantity.as_json() | {"page": Chapter(), "engine": "dembark"} for item in items for quantity in item.quantities]


def compute() -> list[Item]:
    """All items; they take some seconds together."""
    return verification.items()


def from_runs(pages: Sequence[Page]) -> list[dict[str, Any]]:
    """Quantities of the cases that test an instrument, each with its page and engine."""
    return [
        one | {"page": page, "engine": engine_name(engine)}
        for name in _FROM_RUNS
        for page in pages
        for engine, metrics in sorted(page.metrics.items())
        for one in metrics["quantities"]
        if one["name"] == name
    ]


def figure(item: Item) -> Figure | None:
    """The panels of an item side by side; None without any."""
    if not item.panels:
        return None
    with matplotlib.rc_context(STYLE):
        drawn = Figure(figsize=(7.2, 2.3), layout="constrained")
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
            axes.plot(curve.place, curve.value, color="#4a4f57", linewidth=0.9, linestyle=(0, (4, 2)), label=curve.label)
        else:
            axes.plot(curve.place, curve.value, color=_PAINTS[number % len(_PAINTS)], marker=_MARKS[number % len(_MARKS)], markersize=3.2,
                      linewidth=1.1, label=curve.label)
            number += 1
    axes.set(yscale="log", xlabel=panel.along, ylabel=panel.across)
    axes.set_title(panel.title, fontsize=7.5)
    if not panel.linear:
        axes.set_xscale("log")
        places = np.unique(np.concatenate([curve.place for curve in panel.curves]))
        if len(places) <= 5:
            axes.set_xticks(places, [f"{place:.2g}" for place in places], minor=False, fontsize=6)
            axes.xaxis.set_minor_locator(matplotlib.ticker.NullLocator())
    axes.legend(fontsize=6.5)


def table(item: Item) -> tuple[list[str], list[list[Any]]]:
    """Header and rows of all curves of an item."""
    return ["panel", "curve", "place", "value"], [
        [panel.title, curve.label, float(place), float(value)]
        for panel in item.panels
        for curve in panel.curves
        for place, value in zip(curve.place, curve.value, strict=True)
    ]
