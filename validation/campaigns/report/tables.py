"""The quantities of a campaign as one table: rows for CSV, LaTeX and the page."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from dembark.validation.campaigns.report.sweeps import Sweep
from dembark.validation.report.figures import engine_name, write_csv
from dembark.validation.report.numbers import percent, with_interval

COLUMNS = ("case", "variant", "engine", "quantity", "unit", "value", "low", "high", "reference", "reference_low", "reference_high",
           "deviation", "tolerance", "verdict")
_SPECIAL = {"&": r"\&", "%": r"\%", "#": r"\#", "_": r"\_", "$": r"\$", "{": r"\{", "}": r"\}", "~": r"\textasciitilde{}",
            "^": r"\textasciicircum{}", "\\": r"\textbackslash{}", "−": "$-$", "±": r"$\pm$", "·": r"$\cdot$", "–": "--", "λ": r"$\lambda$",
            "σ": r"$\sigma$", "ρ": r"$\rho$", "μ": r"$\mu$", "θ": r"$\theta$", "τ": r"$\tau$", "ω": r"$\omega$", "π": r"$\pi$",
            "√": r"$\surd$", "≥": r"$\ge$", "≤": r"$\le$", "→": r"$\to$", "½": r"$\frac12$", "¼": r"$\frac14$", "¾": r"$\frac34$",
            "²": "$^2$", "³": "$^3$", "⁻": "$^{-}$", "∝": r"$\propto$", "°": r"$^\circ$", "∞": r"$\infty$", "×": r"$\times$", "ṽ": r"$\tilde v$"}
_POWERS = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")


def rows(sweep: Sweep) -> list[dict[str, Any]]:
    """One row for each quantity of each point and engine, the swept values first."""
    found = []
    for point in sweep.points:
        for engine, metrics in sorted(point.metrics.items()):
            for one in metrics["quantities"]:
                low, high = one.get("interval") or (None, None)
                reference_low, reference_high = one.get("reference_interval") or (None, None)
                found.append({**{axis: point.values[axis] for axis in sweep.axes}, "case": sweep.case, "variant": point.variant,
                              "engine": engine, "quantity": one["name"], "unit": one["unit"], "value": one["value"], "low": low, "high": high,
                              "reference": one.get("reference"), "reference_low": reference_low, "reference_high": reference_high,
                              "deviation": one.get("deviation"), "tolerance": one.get("tolerance"), "verdict": one.get("verdict")})
    return found


def write_table_csv(path: Path, sweep: Sweep) -> None:
    """All quantities of a sweep, a column for each swept parameter."""
    header = [*COLUMNS[:3], *sweep.axes, *COLUMNS[3:]]
    write_csv(path, header, ([row[name] for name in header] for row in rows(sweep)))


def latex(sweep: Sweep, quantities: Sequence[Mapping[str, Any]]) -> str:
    """A LaTeX `tabular` of the chosen quantities with their intervals; it needs no package, XeLaTeX or an engine with UTF-8."""
    names = {one["name"]: one for one in quantities}
    head = [*(axis.replace("_", " ") for axis in sweep.axes), "engine", "quantity", "value", "reference", "deviation", "verdict"]
    lines = [r"\begin{tabular}{" + "r" * len(sweep.axes) + "llrrrl}", r"\hline", " & ".join(map(_escape, head)) + r" \\", r"\hline"]
    for point in sweep.points:
        for engine, metrics in sorted(point.metrics.items()):
            for one in metrics["quantities"]:
                if one["name"] in names:
                    lines.append(" & ".join(_escape(cell) for cell in _cells(sweep, point.values, engine, one)) + r" \\")
    return "\n".join([*lines, r"\hline", r"\end{tabular}", ""])


def _cells(sweep: Sweep, values: Mapping[str, Any], engine: str, one: Mapping[str, Any]) -> Iterable[str]:
    unit = "" if one["unit"] == "1" else f" {one['unit']}"
    yield from (f"{value:.6g}" if isinstance(value := values[axis], float) else str(value) for axis in sweep.axes)
    yield engine_name(engine)
    yield one["label"]
    yield with_interval(one["value"], one.get("interval")) + unit
    yield with_interval(one["reference"], one.get("reference_interval")) if one.get("reference") is not None else ""
    relative = one.get("deviation_kind") != "absolute"
    yield "" if one.get("deviation") is None else percent(one["deviation"]) if relative else f"{one['deviation']:.2g}"
    yield one["verdict"] if one.get("tolerance") is not None else ""


def _escape(text: str) -> str:
    powers = re.sub(r"·10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)", lambda found: "\0" + found.group(1).translate(_POWERS) + "\1", text)
    plain = "".join(_SPECIAL.get(letter, letter) for letter in powers)
    return plain.replace("\0", r"$\cdot10^{").replace("\1", "}$")
