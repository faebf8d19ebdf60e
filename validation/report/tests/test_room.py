"""Text in figures stays within its panel."""

from __future__ import annotations

import sys
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
    """The canvas on which the figure was drawn, so that extents of texts are known."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return canvas


@pytest.mark.parametrize("vertical", [False, True])
def test_titles_and_labels_of_a_panel_do_not_reach_the_next(vertical: bool) -> None:
    one = {**full_size.profile(1, 0), "title": LONG, "along": LONG, "across": LONG, "note": LONG + LONG, "vertical": vertical}
    figure = figures.panels_figure([[("liggghts", one)]] * 4)
    canvas = drawn(figure)
    for axes in figure.axes:
        own = axes.get_window_extent()
        for text in (axes.title, axes._left_title, *axes.texts):
            assert text.get_window_extent(canvas.get_renderer()).x1 <= own.x1 + 1.0
        label = axes.yaxis.label.get_window_extent(canvas.get_renderer())
        assert own.y0 - 1.0 <= label.y0 and label.y1 <= own.y1 + 1.0
        assert label.x0 >= 0.0
        below = axes.xaxis.label.get_window_extent(canvas.get_renderer())
        assert own.x0 - 1.0 <= below.x0 and below.x1 <= own.x1 + 1.0


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


def test_studies_of_a_case_stand_in_one_printed_figure(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    full_size.write(tmp_path, ("silo",), variants=1)
    for name in ("study-step", "study-stiffness"):
        place = tmp_path / "silo" / name / "yade"
        place.mkdir(parents=True)
        result.write(place / "metrics.json", Result("silo", name, "yade", (), tmp_path.name, profiles=(full_size.profile(1, 0),)))
    printed: list[str] = []
    monkeypatch.setattr(build_module, "write_pdf", lambda html, path: printed.append(html))
    report.build(tmp_path)
    assert printed[0].count("Silo, studies; bands") == 1
    assert (tmp_path / "figures" / "silo-studies-1.svg").is_file() and not (tmp_path / "figures" / "silo-studies-2.svg").exists()
