"""Walls of particles are as thick as the kernel reaches, in all cases with a fluid."""

from __future__ import annotations

from pathlib import Path

import pytest

from dembark.validation.case.deck import prepare, write
from dembark.validation.case.folders import find
from dembark.validation.case.resolve import resolve


@pytest.mark.parametrize(("smoothing", "layers"), [(1.0, 2), (1.3, 3), (2.0, 4), (2.1, 5), (2.5, 5)])
@pytest.mark.parametrize("case", ["water_tank", "dam_break"])
def test_walls_in_the_plane_are_as_thick_as_the_kernel_reaches(case: str, smoothing: float, layers: int) -> None:
    numbers = prepare(find(case), resolve(find(case), changes={"smoothing": smoothing})).numbers
    assert -numbers["low_x"] / numbers["spacing"] == pytest.approx(layers + 0.5)


def test_walls_of_the_flume_are_as_thick_as_the_kernel_reaches(tmp_path: Path) -> None:
    found = {}
    for variant in ("three", "potential"):
        case = find("dam_break_cubes")
        folder = tmp_path / variant
        folder.mkdir()
        write(case, "liggghts", resolve(case, None, variant), folder)
        found[variant] = next(line.split()[-1] for line in (folder / "liggghts.in").read_text().splitlines() if " thick " in line)
    assert found == {"three": "3*${spacing}", "potential": "5*${spacing}"}
