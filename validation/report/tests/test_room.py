"""Text in figures stays within its panel."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import full_size
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from dembark.validation import report
from dembark.validation.judge import result
from dembark.validation.judge.result import Result
from dembark.validation.report import figures, scatter
from dembark.validation.report.gather import Row

LONG = "the mean height of the middle of the mass of all grains of the smaller kind above the moving floor"
build_module = sys.modules[report.build.__module__]


def drawn(figure: Figure) -> FigureCanvasAgg:
    """The canvas on which the figure was drawn, with as many dots as in the PDF, for letters are whole dots wide."""
    figure.set_dpi(220.0)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return canvas


@pytest.mark.parametrize("scale", [1.0, -3e-3, 1e5])
@pytest.mark.parametrize("vertical", [False, True])
def test_titles_and_labels_of_a_panel_do_not_reach_the_next(vertical: bool, scale: float) -> None:
    panels = []
    for text in (LONG, LONG, "σ_zz " * 40, "σ_zz " * 40):
        one = {**full_size.profile(1, 0), "title": text, "along": text, "across": text, "note": text + text, "vertical": vertical}
        for key in ("place",) if vertical else ("value", "low", "high", "reference"):
            one[key] = [scale * value for value in one[key]]
        panels.append([("liggghts", one)])
    figure = figures.panels_figure(panels)
    renderer = drawn(figure).get_renderer()
    for number, axes in enumerate(figure.axes):
        own = axes.get_window_extent()
        for label in (axes.title, axes._left_title, *axes.texts):
            assert label.get_window_extent(renderer).x1 <= own.x1 + 1.0
        aside, below = (axis.label.get_window_extent(renderer) for axis in (axes.yaxis, axes.xaxis))
        assert own.y0 - 1.0 <= aside.y0 and aside.y1 <= own.y1 + 1.0
        assert aside.x0 >= (figure.axes[number - 1].get_window_extent().x1 if number % 2 else 0.0)
        assert own.x0 - 1.0 <= below.x0 and below.x1 <= own.x1 + 1.0


def test_references_with_intervals_have_an_entry_of_their_own() -> None:
    line = full_size.profile(1, 0)
    points = {**line, "reference_low": line["reference"], "reference_high": line["reference"]}
    figure = figures.panels_figure([[("liggghts", line)], [("liggghts", points)]])
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["reference", "LIGGGHTS", "reference with interval"]


def test_a_panel_needs_no_labels() -> None:
    figure = figures.panels_figure([[("liggghts", {**full_size.profile(1, 0), "title": "", "along": "", "across": ""})]])
    assert figure.axes[0].get_ylabel() == ""


def test_names_of_lines_do_not_lie_over_the_other_panel() -> None:
    record = full_size.quantity(3, 0)
    rows = [Row("silo", f"{'wide mmmmmm ' * 3}, dry", "silo-dry", "yade",
                type(record)(**{**record.__dict__, "label": f"{number} WIDE WORDS {LONG.upper()}"})) for number in range(3)]
    figure = scatter.figure(scatter.points(rows))
    assert figure is not None
    canvas = drawn(figure)
    left, right = figure.axes
    ends = (text.get_window_extent(canvas.get_renderer()) for text in left.get_xticklabels())
    end = max(one.x1 for one in ends if one.x0 < left.get_window_extent().x1)  # those of ticks beyond the axis are not drawn
    assert all(label.get_window_extent(canvas.get_renderer()).x0 >= end for label in right.get_yticklabels())


def test_what_fits_is_left_as_it_is_and_what_does_not_ends_at_a_word() -> None:
    assert figures.shortened("a few words", 3.0, 8.0) == "a few words"
    short = figures.shortened(LONG, 2.0, 8.0)
    assert short.endswith(" …") and LONG.startswith(short[:-2]) and figures.text_width(short, 8.0) <= 2.0
    lines = figures.text_lines(LONG, 1.0, 8.0)
    assert " ".join(lines) == LONG and all(figures.text_width(line, 8.0) <= 1.0 for line in lines)
    assert figures.text_lines("Donaudampfschifffahrt", 0.1, 8.0) == ["Donaudampfschifffahrt"]
    assert figures.shortened("Donaudampfschifffahrt", 0.1, 8.0) == "Donaudampfschifffahrt"


def test_studies_of_a_case_stand_side_by_side(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two panels of each of five studies: five figures in the HTML, two of six and four panels in the PDF."""
    full_size.write(tmp_path, ("silo",), variants=1)
    for number in range(5):
        for engine in ("liggghts", "yade")[: 1 + number % 2]:
            place = tmp_path / "silo" / f"study-{number}" / engine
            place.mkdir(parents=True)
            curves = tuple(full_size.profile(one, 0) for one in range(4 if engine == "liggghts" else 1))
            result.write(place / "metrics.json", Result("silo", f"study-{number}", engine, (), tmp_path.name, profiles=curves))
    printed: list[str] = []
    panels: list[int] = []
    draw = figures.panels_figure

    def counted(some: Sequence[figures.Entries], columns: int = 2) -> Figure:
        panels.append(len(some))
        return draw(some, columns)

    monkeypatch.setattr(build_module, "write_pdf", lambda html, path: printed.append(html))
    monkeypatch.setattr(figures, "panels_figure", counted)
    report.build(tmp_path)
    assert printed[0].count("Silo, studies; bands") == 2 and "Silo, study" not in printed[0]
    assert panels[-2:] == [6, 4] and max(panels) == 6
    full = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "Silo, studies" not in full and full.count("Silo, study") == 5 + 3 + 2
