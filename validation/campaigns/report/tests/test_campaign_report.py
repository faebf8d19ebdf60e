"""The campaign report on results with a known answer: a law that is exact, with the error of the time step added."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from dembark.validation.campaigns.report import figures, tables
from dembark.validation.campaigns.report.sweeps import Sweep, numerical_errors, sweeps
from dembark.validation.case import folders
from dembark.validation.judge.result import QuantityRecord, Result
from dembark.validation.report.gather import Page


def quantity(name: str, value: float | None, half: float | None = 0.01, **more: Any) -> QuantityRecord:
    interval = None if half is None or value is None else (value - half, value + half)
    return QuantityRecord(**{"name": name, "value": value, "verdict": "info", "label": name, "interval": interval, **more})


def content(variant: str, engine: str, *quantities: QuantityRecord) -> Result:
    return Result("silo", variant, engine, tuple(quantities), provenance={"commit": "a" * 40})


def sweep(case: str, axes: tuple[str, ...], points: dict[str, dict[str, Any]], contents: tuple[Result, ...] = (),
          **more: Any) -> Sweep:
    pages = {one.variant: Page(case, one.variant, Path()) for one in contents}
    for one in contents:
        pages[one.variant].results[one.engine] = one
    facts = {"case": case, "axes": axes,
             "points": [{"variant": variant, "values": values, **more} for variant, values in points.items()]}
    return sweeps([facts], pages.values(), folders.discover())[0]


def grid(frictions: tuple[float, ...] = (0.2, 0.4, 0.8), radii: tuple[float, ...] = (0.02, 0.04)) -> Sweep:
    points = {f"f{one}-r{two}": {"wall_friction": one, "cylinder_radius": two} for one in frictions for two in radii}
    contents = tuple(
        content(name, engine, quantity("k", values["wall_friction"] * values["cylinder_radius"], reference=1.0, tolerance=0.1,
                                       verdict="fail" if values["wall_friction"] == 0.8 else "pass"))
        for name, values in points.items() for engine in ("liggghts", "yade"))
    return sweep("silo", ("wall_friction", "cylinder_radius"), points, contents)


def steps(engine_error: float, half: float, **more: Any) -> Sweep:
    points = {f"h{h}": {"time_step_fraction": h} for h in (0.05, 0.1, 0.2)}
    contents = tuple(content(name, "yade", quantity("k", 1.0 + engine_error * values["time_step_fraction"] ** 2, half))
                     for name, values in points.items())
    return sweep("silo", ("time_step_fraction",), points, contents, **more)


def test_a_grid_gives_lines_and_maps() -> None:
    one = grid()
    assert one.along == "wall_friction"
    lines = one.lines("wall_friction", "yade", "k")
    assert [others for others, _ in lines] == [{"cylinder_radius": 0.02}, {"cylinder_radius": 0.04}]
    assert [place for place, _ in lines[0][1]] == [0.2, 0.4, 0.8]
    assert figures.map_axes(one) == ("wall_friction", "cylinder_radius")
    assert figures.study_figure(one, one.quantities()) is not None
    drawn = figures.map_figure(one, "yade", one.quantities())
    assert drawn is not None
    texts = {text.get_text() for text in drawn.axes[0].texts}
    assert texts == {f"{friction * radius:.3g}" for friction in (0.2, 0.4, 0.8) for radius in (0.02, 0.04)}
    assert len(drawn.axes[0].patches) == 2


def test_axes_have_units() -> None:
    one = sweep("silo", ("wall_friction", "cylinder_radius", "gravity"), {"a": {}})
    assert [one.label(axis) for axis in one.axes] == ["wall friction", "cylinder radius / m", "gravity / (m/s^2)"]
    assert sweep("a case that has gone", ("grain_diameter",), {"a": {}}).label("grain_diameter") == "grain diameter"


def test_points_that_were_not_measured_leave_gaps() -> None:
    points = {"a": {"wall_friction": 0.2, "wall": "smooth"}, "b": {"wall_friction": 0.4, "wall": "rough"}}
    one = sweep("silo", ("wall_friction", "wall"), points, (content("a", "yade", quantity("k", math.nan), quantity("l", 1.0)),))
    assert one.lines("wall_friction", "yade", "k") == []
    assert not one.numeric("wall") and one.levels("wall") == ["smooth", "rough"]
    assert figures.study_figure(one, one.quantities()) is not None
    assert figures.map_figure(one, "yade", one.quantities()) is not None


def test_numerical_error_is_told_from_scatter() -> None:
    (exact,) = numerical_errors([steps(2.0, 1e-6)])
    assert exact.found.kind == "monotone" and exact.found.order == pytest.approx(2.0) and exact.found.extrapolated == pytest.approx(1.0)
    assert exact.finest == 0.05
    (noisy,) = numerical_errors([steps(2.0, 0.1)])
    assert noisy.found.kind == "scatter" and noisy.found.order is None and noisy.found.uncertainty > 0.1


def test_a_second_order_scheme_that_shows_its_order_takes_the_small_factor() -> None:
    """The error at the finest step, 2 h², times 1.25; what shows another order than the formal one takes 3."""
    (right,) = numerical_errors([steps(2.0, 1e-6, formal_orders={"time_step_fraction": 2.0})])
    assert right.formal_order == 2.0 and right.found.uncertainty == pytest.approx(1.25 * 2.0 * 0.05**2)
    (wrong,) = numerical_errors([steps(2.0, 1e-6)])
    assert wrong.formal_order == 1.0 and wrong.found.uncertainty == pytest.approx(3.0 * 2.0 * 0.05**2 * 3.0)


def test_table_holds_every_quantity_once(tmp_path: Path) -> None:
    one = grid()
    tables.write_table_csv(tmp_path / "t.csv", one)
    lines = (tmp_path / "t.csv").read_text().splitlines()
    assert lines[0].startswith("case,variant,engine,wall_friction,cylinder_radius,quantity")
    assert len(lines) == 1 + 6 * 2


def test_latex_escapes_what_latex_would_read() -> None:
    one = sweep("silo", ("grain_count",), {"a": {"grain_count": 3}},
                (content("a", "yade", quantity("k", 1.5e-7, 1e-9, label="σ_zz & 50 % of #1", unit="m^2")),))
    text = tables.latex(one, one.quantities())
    row = next(line for line in text.splitlines() if "YADE" in line)
    assert row.count(" & ") == 6 and r"$\sigma$\_zz \& 50 \% of \#1" in row and r"$\cdot10^{-7}$" in row


def test_axes_of_figures_have_units_and_what_failed_comes_first() -> None:
    contents = (content("a", "yade", quantity("p", 1.0, unit="Pa"), quantity("failed", 1.0, verdict="fail", compared=False)),
                content("b", "yade", quantity("p", 2.0, unit="Pa"), quantity("failed", 1.0, verdict="pass", compared=False)))
    one = sweep("silo", ("cylinder_radius",), {"a": {"cylinder_radius": 0.02}, "b": {"cylinder_radius": 0.04}}, contents)
    assert [found.name for found in one.quantities()] == ["failed", "p"]
    drawn = figures.study_figure(one, one.quantities())
    assert drawn is not None
    assert [(axes.get_xlabel(), axes.get_ylabel()) for axes in drawn.axes] == [("cylinder radius / m", "dimensionless"),
                                                                               ("cylinder radius / m", "Pa")]
