"""The bed that is repeated sideways, and the numbers of the scaling table, without an engine."""

import pandas as pd
import pytest

from benchmarks import mpi_scaling
from benchmarks.beds import Bed
from benchmarks.mpi_scaling import Point, bed_of, main, planned, rows, tiled
from dembark.common.errors import DembarkError

BED = """settled bed

2 atoms
1 atom types

0 0.1 xlo xhi
0 0.1 ylo yhi
-0.005 0.5 zlo zhi

Atoms

1 1 0.005 2500 0.02 0.03 0.0025
2 1 0.005 2500 0.07 0.01 0.0074
"""


@pytest.mark.parametrize("times", [1, 2, 3])
def test_a_tiled_bed_holds_every_grain_at_each_place(times):
    lines = tiled(BED, times).splitlines()
    assert lines[2] == f"{2 * times**2} atoms" and lines[7] == "-0.005 0.5 zlo zhi" and lines[9:11] == ["Atoms", ""]
    assert float(lines[5].split()[1]) == pytest.approx(0.1 * times) and lines[6].endswith("ylo yhi")
    grains = [line.split() for line in lines[11:]]
    assert sorted(int(row[0]) for row in grains) == list(range(1, 2 * times**2 + 1))
    places = {(round(float(x) % 0.1, 9), round(float(y) % 0.1, 9), float(z)) for *_, x, y, z in grains}
    assert places == {(0.02, 0.03, 0.0025), (0.07, 0.01, 0.0074)}
    assert len({(row[4], row[5]) for row in grains}) == 2 * times**2
    assert all(0 <= float(row[k]) <= 0.1 * times for row in grains for k in (4, 5))


def test_only_beds_that_are_whole_tiles(tmp_path, monkeypatch):
    monkeypatch.setattr(mpi_scaling, "settled_bed", lambda grains: Bed(tmp_path / f"bed-{grains}.data"))
    (tmp_path / "bed-20000.data").write_text(BED)
    assert bed_of(2500) == Bed(tmp_path / "bed-2500.data")
    bed = bed_of(80000)
    assert bed.width == pytest.approx(0.2) and bed.path.read_text() == tiled(BED, 2)
    for grains in (1, 40000, 20001):
        with pytest.raises(DembarkError, match="choose among 2500, 20000, 80000"):
            bed_of(grains)


def test_speed_up_is_over_one_core():
    points = [Point("liggghts", 1000, 1, 100), Point("liggghts", 1000, 4, 100), Point("yade", 1000, 2, 10)]
    rates = {points[0].name: [1e6, 5e5, 2.5e5], points[1].name: [5e5], points[2].name: [5e3]}
    table = rows(points, pd.DataFrame([{"subject": name, "rate": rate} for name, found in rates.items() for rate in found]))
    assert table[0][4:7] == ["5e+05", "2.5e+05-1e+06", "1.00"]
    # 4 cores at the rate of one: four times as fast.
    assert table[1][4] == "5e+05" and table[1][6] == "4.00"
    assert table[2][6] == "" and table[0][7] == f"{1e6 * 1000 / 5e5 / 3600:.2g} h"


def test_samples_are_about_the_same_work():
    points = planned(["liggghts", "yade"], [1000, 100000], [1, 2], 1e6)
    assert len(points) == 8
    assert [(point.grains * point.steps) for point in points if point.engine == "liggghts"] == [10**6] * 4
    assert min(point.steps for point in points) == 10


@pytest.mark.parametrize("words", [["--cores", "9999"], ["--rounds", "0"], ["--grains", "-5"]])
def test_a_mistake_gets_one_line(words, capsys):
    assert main(words) == 2
    assert capsys.readouterr().err.startswith("dembark: --")
