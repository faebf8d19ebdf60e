"""Bias and scatter of what was measured against experiment and theory, as in the validation guide of the Fire Dynamics Simulator."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from dembark.postproc.statistics import Scatter, scatter
from dembark.postproc.style import GREY, GRID, STYLE
from dembark.validation.judge.result import QuantityRecord

from .figures import WIDE, look, shortened, symbols, text_width
from .gather import Row

KINDS = ("experiment", "theory")
# Lines that fit on the first pages; the others are in the table next to the report.
LINES = 24
_LETTERS = 5.8  # points, of the lines' names


@dataclass(frozen=True)
class Point:
    """A measured value over its reference, of one quantity of a case in one variant and engine, with the relative half-width of the
    ratio."""

    line: tuple[str, str]
    engine: str
    evidence: str
    value: float
    reference: float
    half: float
    reference_half: float

    @property
    def ratio(self) -> float:
        """Measured over reference."""
        return self.value / self.reference


def points(rows: Iterable[Row]) -> list[Point]:
    """The checks against experiment and theory that a ratio makes sense for: both numbers positive, the deviation a relative one; and
    whose reference is independent, for numbers of one run have their errors in common."""
    found = []
    for row in rows:
        one = row.record
        if _has_ratio(one) and one.independent and one.value and one.reference:
            interval = one.reference_interval
            reference_half = 0.5 * (interval[1] - interval[0]) / one.reference if interval else 0.0
            found.append(Point((row.case.replace("_", " "), one.title), row.engine, one.evidence, one.value, one.reference,
                               (one.half or 0.0) / one.value, reference_half))
    return found


def _has_ratio(one: QuantityRecord) -> bool:
    return (one.evidence in KINDS and one.standing != "information" and not one.calibrated and one.deviation_kind == "relative"
            and (one.value or 0.0) > 0.0 and (one.reference or 0.0) > 0.0)


def left_out(rows: Iterable[Row]) -> int:
    """How many checks are not among the points for nothing but their reference, which is computed from other numbers of the same run."""
    return sum(_has_ratio(row.record) and not row.record.independent for row in rows)


def statistics(found: Sequence[Point]) -> Scatter | None:
    """Bias and scatter of an engine's points; None for fewer than three. sigma_E is the references' own: half of their 95 % half-widths,
    rms."""
    if len(found) < 3:
        return None
    sigma = math.sqrt(sum((0.5 * one.reference_half) ** 2 for one in found) / len(found))
    return scatter([one.value for one in found], [one.reference for one in found], sigma)


def lines(found: Sequence[Point]) -> list[tuple[str, str]]:
    """(case, quantity) of the points in the order of the figure, those farthest from the reference first to be kept when there is no
    room."""
    worst: dict[tuple[str, str], float] = {}
    for one in found:
        worst[one.line] = max(worst.get(one.line, 0.0), abs(math.log(one.ratio)))
    kept = sorted(worst, key=lambda line: -worst[line])[:LINES]
    return [line for line in worst if line in kept]


def figure(found: Sequence[Point], tolerance: float = 0.10) -> Figure | None:
    """Left: measured against reference, each point drawn as the number of its line; right: the ratio, line by line. None without points."""
    shown = lines(found)
    if not shown:
        return None
    engines = list(dict.fromkeys(one.engine for one in found))
    number = {line: place + 1 for place, line in enumerate(shown)}
    drawn = [one for one in found if one.line in number]
    tall = max(3.15, 0.135 * len(shown) + 0.75)
    with matplotlib.rc_context(STYLE | {"axes.grid": False}):
        result = Figure(figsize=(WIDE, tall))
        side = 2.3 / WIDE
        left = result.add_axes((0.085, 1.0 - (0.25 + 2.05) / tall, side, 2.05 / tall))
        right = result.add_axes((0.76, 0.42 / tall, 0.23, 1.0 - (0.25 + 0.42) / tall))
        values = [value for one in drawn for value in (one.value, one.reference)]
        ends = 10.0 ** np.array([math.floor(math.log10(min(values))), math.ceil(math.log10(max(values)) + 1e-9)])
        left.fill_between(ends, ends * (1 - tolerance), ends * (1 + tolerance), color=GREY, alpha=0.12, linewidth=0)
        left.plot(ends, ends, color=GREY, linewidth=0.6)
        left.set(xscale="log", yscale="log", xlim=ends, ylim=ends, xlabel="reference", ylabel="measured",
                 title="Measured against reference")
        for axis in (left.xaxis, left.yaxis):
            axis.set_minor_formatter(NullFormatter())
        right.axvspan(1 - tolerance, 1 + tolerance, color=GREY, alpha=0.12, linewidth=0)
        right.axvline(1.0, color=GREY, linewidth=0.6)
        for place, engine in enumerate(engines):
            _engine(left, right, engine, place, [one for one in drawn if one.engine == engine], number, len(engines),
                    statistics([one for one in found if one.engine == engine]))
        spread = max(1.3 * tolerance, 1.15 * max(abs(one.ratio - 1.0) + one.half for one in drawn))
        right.set(xlim=(max(0.0, 1.0 - spread), 1.0 + spread), ylim=(len(shown) + 0.6, 0.4), xlabel="measured / reference", title="Ratio")
        # Between the panels, next to the last number of the left one's axis.
        room = (right.get_position().x0 - left.get_position().x1) * WIDE - 0.2
        right.set_yticks(range(1, len(shown) + 1), [_label(number[line], line, room) for line in shown], fontsize=_LETTERS)
        right.tick_params(axis="y", length=0)
        right.hlines(range(1, len(shown) + 1), *right.get_xlim(), color=GRID, linewidth=0.4, zorder=0)
        handles = right.get_legend_handles_labels()
        result.legend(*handles, loc="lower left", bbox_to_anchor=(0.01, 0.0), fontsize=6.3, handlelength=1.0)
    return result


def kinds(found: Iterable[Point]) -> str:
    """`12 of experiment, 3 of theory`."""
    counts = Counter(one.evidence for one in found)
    return ", ".join(f"{counts[kind]} of {kind}" for kind in KINDS if counts[kind])


def _label(number: int, line: tuple[str, str], inches: float) -> str:
    end = f"  {number}"
    return symbols(shortened(f"{line[0]}: {line[1]}", inches - text_width(end, _LETTERS), _LETTERS) + end)


def _engine(left: Any, right: Any, engine: str, place: int, found: Sequence[Point], number: dict[tuple[str, str], int], engines: int,
            known: Scatter | None) -> None:
    paint, mark, title = look(engine).colour, look(engine).marker, look(engine).title
    for one in found:
        left.text(one.reference, one.value, str(number[one.line]), color=paint, fontsize=5.2, ha="center", va="center", clip_on=True)
    # The marks of all engines stay nearer to their own line than to the next.
    shift = min(0.22, 0.6 / engines) * (place - 0.5 * (engines - 1))
    label = title if known is None else f"{title}: δ = {known.bias:.3f}, σ = {known.model:.3f}, {kinds(found)}"
    right.errorbar([one.ratio for one in found], [number[one.line] + shift for one in found],
                   xerr=[one.ratio * math.hypot(one.half, one.reference_half) for one in found], fmt=mark, color=paint, markersize=2.8,
                   elinewidth=0.6, markeredgecolor="white", markeredgewidth=0.3, label=label)
    if known is not None:
        right.axvline(known.bias, color=paint, linewidth=0.8)
        right.axvspan(known.bias - 2 * known.model, known.bias + 2 * known.model, color=paint, alpha=0.07, linewidth=0)
