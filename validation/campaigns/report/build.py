"""The report of a campaign's folder: its chapters in the report that profiles have too."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from dembark.common.errors import RunError
from dembark.common.files import write_atomic
from dembark.validation.campaigns import targets
from dembark.validation.campaigns.spec import SweepSpec, read
from dembark.validation.judge.result import Comparison
from dembark.validation.judge.tally import tally
from dembark.validation.report.build import write
from dembark.validation.report.figures import engine_name
from dembark.validation.report.gather import ReportData, gather
from dembark.validation.report.sections import embed

from . import calibration, figures, sensitivity, tables
from .sweeps import Point, Sweep, numerical_errors, sweeps

# A page that shows everything shows nothing: the rest is in the tables.
_PANELS = 9
_BARS = {"morris": "Mean absolute elementary effect μ* of each parameter over its range, with bootstrapped 95 % intervals; below the "
                   "dashed line, a tenth of the largest, a parameter does not matter.",
         "saltelli": "Total Sobol index of each parameter, with bootstrapped 95 % intervals; below the dashed line, a twentieth of the "
                     "variance, a parameter does not matter."}


def build(folder: Path) -> Path:
    """Write `report.html`, `report.pdf` and `figures/` into a campaign's `folder` and return the path of the HTML file.

    RunError when there is nothing measured or a file cannot be written; the HTML comes last, so that it never stands there with an older
    PDF.
    """
    gathered = gather(folder)
    if not any(page.results for page in gathered.pages):
        raise RunError(f"nothing to report in {folder}", "no run of the campaign has been measured yet", "see 'dembark status'")
    return write(gathered, lambda drawn: _chapters(gathered, drawn))


def _chapters(gathered: ReportData, drawn: Path) -> dict[str, Any]:
    found = sweeps(gathered.summary.get("sweeps", ()), gathered.pages, gathered.cases)
    file = gathered.folder / "campaign.toml"
    # Conditions between parameters, which a fit keeps, are in the file only.
    specs = read(file).sweeps if file.is_file() and any(one.sample.get("targets") for one in found) else (None,) * len(found)
    for number, (one, spec) in enumerate(zip(found, specs, strict=True), start=1):
        if spec and spec.sample and (known := one.sample.get("targets")):
            targets.refuse_changed(gathered.folder, number, known, spec.sample.facts().get("targets", {}))
    return {"title": f"Campaign {gathered.summary.get('campaign') or gathered.folder.name}",
            "sweeps": [_sweep(one, spec, gathered, drawn) for one, spec in zip(found, specs, strict=True)],
            "errors": numerical_errors(found)}


def _sweep(sweep: Sweep, spec: SweepSpec | None, gathered: ReportData, drawn: Path) -> dict[str, Any]:
    quantities = sweep.quantities()
    # A sample has a panel for each parameter.
    chosen, name = quantities[:max(1, _PANELS // len(sweep.axes)) if sweep.sample else _PANELS], sweep.name
    tables.write_table_csv(drawn / f"{name}.csv", sweep)
    write_atomic(drawn / f"{name}.tex", tables.latex(sweep, quantities).encode())
    study = figures.study_figure(sweep, chosen)
    shown = [embed(study, drawn, f"{name}-study",
                   "Quantities along the sweep with 95 % intervals; grey dashed: reference of each point.")] if study else []
    points = figures.sample_figure(sweep, chosen)
    shown += [embed(points, drawn, f"{name}-sample", "Quantities at the points of the sample with 95 % intervals.")] if points else []
    maps = {engine: figures.map_figure(sweep, engine, chosen) for engine in sweep.engines}
    shown += [embed(one, drawn, f"{name}-map-{engine}", f"{engine_name(engine)} over both parameters; red frames mark failed checks.")
              for engine, one in maps.items() if one]
    effects = sensitivity.sensitivities(sweep, quantities)
    if bars := figures.sensitivity_figure(effects, _PANELS):
        sensitivity.write_csv(drawn / f"{name}-sensitivity.csv", effects)
        shown.append(embed(bars, drawn, f"{name}-sensitivity", _BARS[sweep.sample["design"]], [f"{name}-sensitivity.csv"]))
    fits = calibration.fits(sweep, spec) if spec else []
    for one in fits:
        if spec and (posterior := figures.posterior_figure(sweep, one)):
            place = Path("calibration", name, one.base, one.engine)
            calibration.write_files(gathered.folder / place, str(gathered.summary["campaign"]), one, spec)
            shown.append(embed(posterior, drawn, f"{name}-posterior-{one.base}-{one.engine}",
                               f"{engine_name(one.engine)}: posterior; dashed: 95 % intervals, cross: most probable point.",
                               [f"../{place}/{file}" for file in ("posterior.csv", "fitted.toml")]))
    compared = {page.variant: page.comparison for page in gathered.pages if page.case == sweep.case}
    return {"sweep": sweep, "shown": len(chosen), "left_out": len(quantities) - len(chosen), "figures": shown,
            "fits": fits, "effects": effects, "negligible": sensitivity.negligible_everywhere(effects),
            "verdicts": [_verdicts(sweep, point, compared.get(point.variant)) for point in sweep.points]}


def _verdicts(sweep: Sweep, point: Point, comparison: Comparison | None) -> dict[str, Any]:
    """One line of the table of checks: the tally of each engine and of the comparison of the engines, and what failed."""
    groups: dict[str, Any] = {engine_name(engine): result.quantities for engine, result in sorted(point.results.items())}
    groups |= {"comparison of the engines": comparison.quantities} if comparison else {}
    return {"values": {axis: point.values[axis] for axis in sweep.axes}, "counts": {who: tally(found) for who, found in groups.items()},
            "failed": [f"{who}: {one.title}" for who, found in groups.items() for one in found if one.standing == "failed"]}
