"""The figure of the LCP solver is drawn from a stored measurement, with its data next to it."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest

from benchmarks import lcp
from dembark.common.errors import DembarkError


def row(solver: str, contacts: int, **facts: object) -> dict[str, object]:
    return {"case": "coupled", "contacts": contacts, "solver": solver, "median": 1e-6 * contacts, "min": 1e-6, "max": 1e-2, "samples": 5,
            "certificate": 1e-16, "status": "solved", **facts}


def test_redraw_writes_figure_and_data(tmp_path: Path) -> None:
    rows = [row("dembark energy", n, pivots=n, block_steps=0) for n in (10, 100)] + [row("Siconos pgs", 10, iterations=7)]
    (tmp_path / "lcp.json").write_text(json.dumps({"rows": rows}))
    lcp.redraw(tmp_path, tmp_path / "scaling.png")
    assert (tmp_path / "scaling.png").read_bytes().startswith(b"\x89PNG")
    with (tmp_path / "scaling.csv").open(encoding="utf-8", newline="") as file:
        found = list(csv.DictReader(file))
    assert [(one["solver"], one["contacts"], one["pivots"], one["iterations"]) for one in found] == [
        ("dembark energy", "10", "10", ""), ("dembark energy", "100", "100", ""), ("Siconos pgs", "10", "", "7")]
    assert [lcp.steps_of(one) for one in rows] == [10, 100, 7]


def test_nothing_to_draw_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(DembarkError, match="no measurement to draw"):
        lcp.redraw(tmp_path, tmp_path / "scaling.png")
    assert lcp.main(["--redraw", "--out", str(tmp_path)]) == 2
    assert "benchmarks.lcp" in capsys.readouterr().err


def test_a_peer_is_left_out_where_one_call_would_take_too_long() -> None:
    assert lcp.expected(row("Siconos lemke", 100), 1000) == pytest.approx(1e3 * 1e-4)
    assert lcp.expected(row("Siconos pgs", 100), 1000) == pytest.approx(1e2 * 1e-4)
