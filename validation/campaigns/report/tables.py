"""The quantities of a campaign as one table: rows for CSV, LaTeX and the page."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from dembark.validation.judge.result import QuantityRecord, as_json, as_row
from dembark.validation.report.figures import engine_name
from dembark.validation.report.numbers import deviation, with_interval, with_unit

from .sweeps import Sweep

_SPECIAL = {"&": r"\&", "%": r"\%", "#": r"\#", "_": r"\_", "$": r"\$", "{": r"\{", "}": r"\}", "~": r"\textasciitilde{}",
            "^": r"\textasciicircum{}", "\\": r"\textbackslash{}", "−": "$-$", "±": r"$\pm$", "·": r"$\cdot$", "–": "--", "λ": r"$\lambda$",
            "σ": r"$\sigma$", "ρ": r"$\rho$", "μ": r"$\mu$", "θ": r"$\theta$", "τ": r"$\tau$", "ω": r"$\omega$", "π": r"$\pi$",
            "√": r"$\surd$", "≥": r"$\ge$", "≤": r"$\le$", "→": r"$\to$", "½": r"$\frac12$", "¼": r"$\frac14$", "¾": r"$\frac34$",
            "²": "$^2$", "³": "$^3$", "⁻": "$^{-}$", "∝": r"$\propto$", "°": r"$^\circ$", "∞": r"$\infty$", "×": r"$\times$",
            "ṽ": r"$\tilde v$"}
_POWERS = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")


def write_table_csv(path: Path, sweep: Sweep) -> None:
    """All quantities of a sweep: a row for each of each point and engine, a column for each swept parameter."""
    pd.DataFrame([{"case": sweep.case, "variant": point.variant, "engine": engine, **{axis: point.values[axis] for axis in sweep.axes}}
                  | as_row(as_json(one))
                  for point in sweep.points for engine, result in sorted(point.results.items()) for one in result.quantities],
                 ).rename(columns={"name": "quantity"}).to_csv(path, index=False)


def latex(sweep: Sweep, quantities: Sequence[QuantityRecord]) -> str:
    """A LaTeX `tabular` of the chosen quantities with their intervals; it needs no package, XeLaTeX or an engine with UTF-8."""
    names = {one.name for one in quantities}
    head = [*(axis.replace("_", " ") for axis in sweep.axes), "engine", "quantity", "value", "reference", "deviation", "verdict"]
    lines = [r"\begin{tabular}{" + "r" * len(sweep.axes) + "llrrrl}", r"\hline", " & ".join(map(_escape, head)) + r" \\", r"\hline"]
    for point in sweep.points:
        for engine, result in sorted(point.results.items()):
            lines.extend(" & ".join(_escape(cell) for cell in _cells(sweep, point.values, engine, one)) + r" \\"
                         for one in result.quantities if one.name in names)
    return "\n".join([*lines, r"\hline", r"\end{tabular}", ""])


def _cells(sweep: Sweep, values: Mapping[str, Any], engine: str, one: QuantityRecord) -> Iterable[str]:
    yield from (f"{value:.6g}" if isinstance(value := values[axis], float) else str(value) for axis in sweep.axes)
    yield engine_name(engine)
    yield one.title
    yield with_unit(with_interval(one.value, one.interval), one.unit)
    yield with_interval(one.reference, one.reference_interval) if one.reference is not None else ""
    yield "" if one.deviation is None else deviation(one)
    yield {"information": "", "open": "open", "uncontrolled": "not counted", "calibrated": "calibrated"}.get(one.standing, one.verdict)


def _escape(text: str) -> str:
    powers = re.sub(r"·10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)", lambda found: "\0" + found.group(1).translate(_POWERS) + "\1", text)
    plain = "".join(_SPECIAL.get(letter, letter) for letter in powers)
    return plain.replace("\0", r"$\cdot10^{").replace("\1", "}$")
