"""Samples in turn, their ratios, and the page of a benchmark."""

import json

import pytest

from benchmarks import frame, run
from benchmarks.beds import HERE, bed_of, read_log
from dembark.common.errors import RunError

LOG = """Loop time of 3.5 on 1 procs for 1000 steps with 20 atoms, finish time X
Pair  time (%) = 2.5 (80)
Comm  time (%) = 0.5 (14)
Loop time of 1.25 on 1 procs for 400 steps with 20 atoms, finish time X
Pair  time (%) = 0.75 (60)
Comm  time (%) = 0.25 (20)

Nlocal:    10 ave 12 max 8 min
Histogram: 1 0 0 0 0 0 0 0 0 1
Nghost:    5.5 ave 6 max 5 min
"""
LAMMPS = """Loop time of 2 on 1 procs for 400 steps with 20 atoms

50.0% CPU use with 1 MPI tasks x no OpenMP threads

MPI task timing breakdown:
Section |  min time  |  avg time  |  max time  |%varavg|  %CPU | %total
-----------------------------------------------------------------------
Pair    | 1.5        | 1.6        | 1.7        |   0.0 |  25.0 | 80.00
Neigh   | 0          | 0          | 0          |   0.0 | 100.0 |  0.00
Comm    | 0.1        | 0.2        | 0.3        |   0.0 |  50.0 | 10.00

Nlocal:             10 ave          12 max           8 min
"""


def test_last_run_of_a_log():
    counts = {"own": 10.0, "most": 12.0}
    assert read_log(LOG) == {"loop": 1.25, "pair": 0.75, "comm": 0.25, "own": 10.0, "most": 12.0, "halo": 5.5}
    assert read_log(LAMMPS.replace("of 2", "of 9") + LAMMPS, wall_clock=False) == {"loop": 1.0, "pair": 0.4, "comm": 0.1} | counts
    assert read_log(LAMMPS) == {"loop": 2.0, "pair": 1.6, "comm": 0.2} | counts


@pytest.mark.parametrize(("text", "what"),
                         [("", "no timings"), ("ERROR: lost atoms (x.cpp:1)\n", "lost atoms"),
                          (LOG + "Loop time of 9 on 1 procs", "no timings")])
def test_log_without_timings(text, what):
    with pytest.raises(RunError, match=what):
        read_log(text)


def subjects(order):
    """A reference whose machine slows down from round to round, and a subject that takes half as long."""
    def take(name, factor):
        def sample():
            order.append(name)
            turn = order.count(name)
            return {"loop": 2.0 * turn * factor, "pair": turn * factor}
        return sample

    return {"a": take("a", 1.0), "b": take("b", 0.5)}


def test_rounds_alternate_and_ratios_are_of_one_round():
    order = []
    samples = frame.in_turn("c", subjects(order), 4)
    assert "".join(order) == "abbaabba"
    reference, subject = frame.summary(samples, ("pair", "loop"))
    assert (reference["subject"], reference["pair_ratio_median"]) == ("a", 1.0)
    assert subject["pair_median"] == 1.25
    assert [subject[f"loop_ratio_{which}"] for which in ("median", "min", "max")] == [0.5] * 3


def test_a_row_says_what_was_missed(monkeypatch):
    monkeypatch.setitem(run.GOALS, "b", 0.49)
    _, row = frame.summary(frame.in_turn("c", subjects([]), 1), ("pair", "loop"))
    assert run.cells(row) == ["c", "b", "0.500 (0.500-0.500)", "0.500 (0.500-0.500)", "1.000 (1.000-1.000)", "0.500 (0.500-0.500)",
                              "<= 0.49 MISSED"]


def test_a_page_and_its_data(tmp_path, capsys):
    frame.write(tmp_path / "new", "bench", "Title", [frame.markdown(("a", "b"), [(1, 2)])], [{"a": 1}], frame.facts(("numpy",), grains=20))
    page = (tmp_path / "new/bench.md").read_text()
    assert page.startswith("# Title\n\n| a | b |\n| --- | --- |\n| 1 | 2 |\n") and "grains 20" in page and page in capsys.readouterr().out
    content = json.loads((tmp_path / "new/bench.json").read_text())
    assert content["rows"] == [{"a": 1}] and {"cpu", "load", "load_after", "numpy", "commit"} <= content["provenance"].keys()


def test_bridge_of_the_stock_model_has_our_volume():
    """(V_i + V_j) * content * 0.05 of the stock model, in units of the radius, is the 1e-3 that ours is given."""
    text = (HERE / "replay.in").read_text()
    content = float(text.split("variable liquid index ")[1].split()[0])
    assert 2 * 1333.333333e-3 * 3.141592653589793 * content * 0.05 == pytest.approx(1e-3, rel=1e-6)


def test_beds_of_two_sizes_have_half_of_the_volume_each():
    bed, given = bed_of(20000, 10.0)
    assert (given["large"], bed.diameter, bed.ratio) == (20, 0.002, 10.0)
    assert given["large"] * 10.0**3 == pytest.approx(20000 - given["large"], rel=0.01)
    # There is room for all: the bed is below the top of the region that is filled, and the large ones fit side by side.
    assert bed.width >= 3 * 0.02 - 1e-12 and given["high"] < given["top"]
    assert given["step"] == pytest.approx(2e-5 * bed.diameter / 0.005)
    one, alone = bed_of(20000, 1.0)
    assert (one.diameter, one.width, alone) == (0.005, 0.1, {"count": 20000})


@pytest.mark.parametrize("words", [["--only", "wet", "--size-ratio", "10"], ["--rounds", "0"], ["--size-ratio", "99"]])
def test_wrong_option(words, capsys):
    assert run.main(words) == 2
    assert capsys.readouterr().err.startswith("dembark: --")
