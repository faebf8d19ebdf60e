"""Statistics, logs and order of the benchmarks, without an engine."""

import pytest

from benchmarks.measure import HERE, Comparison, Sample, Subject, bed_of, read_lammps, read_log, spread
from benchmarks.run import main, markdown
from dembark.common.errors import RunError

LOG = """Loop time of 3.5 on 1 procs for 1000 steps with 20 atoms, finish time X
Pair  time (%) = 2.5 (80)
Loop time of 1.25 on 1 procs for 400 steps with 20 atoms, finish time X
Pair  time (%) = 0.75 (60)
"""


def test_last_run_of_a_log():
    assert read_log(LOG) == Sample(loop=1.25, pair=0.75)


@pytest.mark.parametrize(("text", "what"),
                         [("", "no timings"), ("ERROR: lost atoms (x.cpp:1)\n", "lost atoms"),
                          (LOG + "Loop time of 9 on 1 procs", "no timings")])
def test_log_without_timings(text, what):
    with pytest.raises(RunError, match=what):
        read_log(text)


LAMMPS = """Loop time of 2 on 1 procs for 400 steps with 20 atoms

50.0% CPU use with 1 MPI tasks x no OpenMP threads

MPI task timing breakdown:
Section |  min time  |  avg time  |  max time  |%varavg|  %CPU | %total
-----------------------------------------------------------------------
Pair    | 1.5        | 1.6        | 1.7        |   0.0 |  25.0 | 80.00
Neigh   | 0          | 0          | 0          |   0.0 | 100.0 |  0.00
"""


def test_last_run_of_lammps():
    text = LAMMPS.replace("of 2", "of 9") + LAMMPS
    assert read_lammps(text, wall_clock=False) == Sample(loop=1.0, pair=0.4)
    assert read_lammps(text, wall_clock=True) == Sample(loop=2.0, pair=1.6)
    with pytest.raises(RunError, match="lost atoms"):
        read_lammps("ERROR: lost atoms", wall_clock=False)


def test_spread():
    assert spread([3.0, 1.0, 2.0, 10.0]) == {"median": 2.5, "min": 1.0, "max": 10.0, "count": 4}


def subjects(order: list[str]) -> list[Subject]:
    """A reference whose machine slows down from round to round, and a subject that takes half as long."""
    def take(name: str, factor: float):
        def sample() -> Sample:
            order.append(name)
            turn = order.count(name)
            return Sample(loop=2.0 * turn * factor, pair=turn * factor)
        return sample

    return [Subject("a", take("a", 1.0)), Subject("b", take("b", 0.5))]


def test_rounds_alternate_and_ratios_are_of_one_round():
    order: list[str] = []
    comparison = Comparison("c", subjects(order), 10, {"b": 0.49})
    comparison.run(4, lambda line: None)
    assert "".join(order) == "abbaabba"
    reference, subject = comparison.rows()
    assert reference["goal"] is None and reference["met"] is None
    assert subject["pair"]["median"] == 1.25
    assert subject["pair_ratio"] == {"median": 0.5, "min": 0.5, "max": 0.5, "count": 4}
    assert subject["met"] is False


def test_table_says_what_was_missed():
    comparison = Comparison("c", subjects([]), 10, {"b": 0.49})
    comparison.run(1, lambda line: None)
    facts = {"grains": 20, "diameter": 0.005, "size_ratio": 1.0, "clock": "processor time", "rounds": 1, "date": "d", "cpu": "c",
             "cores": 2, "load": 1.0, "load_after": 1.0, "commit": None, "dirty": None, "versions": {"dembark": "0", "yade": None}}
    text = markdown(comparison.rows(), facts)
    assert "| c | b | 0.500 (0.500-0.500) | 0.500 (0.500-0.500) | 1.000 (1.000-1.000) | 0.500 (0.500-0.500) | <= 0.49 MISSED |" in text
    assert "commit none" in text and "yade" not in text


def test_bridge_of_the_stock_model_has_our_volume():
    """(V_i + V_j) * content * 0.05 of the stock model, in units of the radius, is the 1e-3 that ours is given."""
    text = (HERE / "replay.in").read_text()
    content = float(text.split("variable liquid index ")[1].split()[0])
    assert 2 * 1333.333333e-3 * 3.141592653589793 * content * 0.05 == pytest.approx(1e-3, rel=1e-6)


def test_beds_of_two_sizes_have_half_of_the_volume_each():
    bed, given = bed_of(20000, 10.0)
    assert (given["large"], bed.diameter, bed.ratio) == (20, 0.002, 10.0)
    assert given["large"] * 10.0**3 == pytest.approx(20000 - given["large"], rel=0.01)
    # There is room for all: the bed is below the top of the region that is filled, and the large ones fit beside each other.
    assert bed.width >= 3 * 0.02 - 1e-12 and given["high"] < given["top"]
    assert given["step"] == pytest.approx(2e-5 * bed.diameter / 0.005)
    one, alone = bed_of(20000, 1.0)
    assert (one.diameter, one.width, alone) == (0.005, 0.1, {"count": 20000})


def test_wrong_option(capsys):
    assert main(["--only", "wet", "--size-ratio", "10"]) == 2
    assert "is for dry beds" in capsys.readouterr().err
    assert main(["--rounds", "0"]) == 2
    assert capsys.readouterr().err.startswith("dembark: --rounds")
