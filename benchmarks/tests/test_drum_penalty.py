"""The drum's benchmark."""

import math

import numpy as np
import pytest

from benchmarks import drum_penalty
from benchmarks.drum_resume import last_step


@pytest.mark.parametrize("turn", [0.01, 0.05])
def test_restitution_is_that_of_the_formula(turn):
    mean, half = drum_penalty.restitution(turn, "theta 1")
    assert mean == pytest.approx(math.exp(-0.5 * math.pi * turn), rel=turn**2)
    assert half < turn**2
    for law in ("theta 0.5", "penalty"):
        assert drum_penalty.restitution(turn, law)[0] == pytest.approx(1.0, abs=turn**3)


def test_implicit_law_never_gives_energy_and_the_explicit_one_does():
    assert all(drum_penalty.restitution(turn, "theta 1")[0] < 1.0 for turn in (0.5, 1.0, 1.9, 4.0, 20.0))
    mean, half = drum_penalty.restitution(1.9, "penalty")
    assert mean + half > 1.5


def test_logs_fill_the_drum_as_told():
    places, diameters, radius = drum_penalty.logs()
    assert len(places) == len(diameters) == drum_penalty.LOGS
    assert (diameters**2).sum() / (2.0 * radius) ** 2 == pytest.approx(drum_penalty.FILLING)
    distance = np.hypot(*(places[:, None] - places).T) + 10.0 * np.eye(len(places))
    assert distance.min() > drum_penalty.HIGH
    assert (np.hypot(*places.T) + 0.5 * diameters < radius).all()


def test_energy_in_overlaps(tmp_path):
    """Two logs 1 mm into each other, one of them 2 mm into the shell."""
    _, _, radius = drum_penalty.logs()
    x = radius - 0.1 + 0.002
    frame = "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n2\nITEM: BOX BOUNDS ff ff ff\n0 1\n0 1\n0 1\n"
    frame += f"ITEM: ATOMS id x y radius \n1 {x!r} 0 0.1\n2 {x - 0.199!r} 0 0.1\n"
    (tmp_path / "logs.dump").write_text(2 * frame)
    pair, wall = 5e6, 1e7 * 5e7 / 6e7
    assert drum_penalty.overlap_energy(tmp_path) == pytest.approx([0.5 * pair * 1e-6 + 0.5 * wall * 4e-6], rel=1e-6)


def test_both_decks_have_the_same_stiffness():
    words = drum_penalty.deck("penalty", 1e-4, 1.0, 10, turning=True)
    pair, wall, *_ = (float(word) for word in words.split("global kn peratomtypepair 2 ")[1].split("\n")[0].split())
    fix = drum_penalty.deck("theta 1", 1e-4, 1.0, 10, turning=True)
    log, shell = (float(fix.split(f"{before}stiffness ")[1].split()[0]) for before in ("lcp/impact ", f"0 0 {drum_penalty.logs()[2]!r} "))
    assert (1.0 / pair, 1.0 / wall) == (pytest.approx(2.0 / log), pytest.approx(1.0 / log + 1.0 / shell))
    assert "run 10000\n" in words and "run 10000\n" in fix


def test_many_logs_turn_at_the_same_froude_number_and_stiffer_ones_keep_their_damping_ratio():
    count = 400
    froude = [drum_penalty.drum_speed(n) ** 2 * drum_penalty.logs(n)[2] for n in (drum_penalty.LOGS, count)]
    assert froude[0] == pytest.approx(froude[1])
    assert drum_penalty.drum_speed(drum_penalty.LOGS) == drum_penalty.SPEED
    soft, stiff = (drum_penalty.deck("theta 1", 1e-4, 1.0, 0, turning=True, count=count, stiffer=by) for by in (1.0, 4.0))
    for word, factor in (("stiffness", 4.0), ("contact_damping", 2.0)):
        a, b = (float(words.split(f"{word} ")[1].split()[0]) for words in (soft, stiff))
        assert b == pytest.approx(factor * a)
    assert drum_penalty.highest_frequency(4.0) == pytest.approx(2.0 * drum_penalty.highest_frequency())
    assert "dump" not in soft and "compute" not in soft and "run 10000\n" in soft  # what is timed writes nothing


def test_a_run_that_fails_says_why(tmp_path):
    spent, failed = drum_penalty.spent_by("units si\nrun 1\n", tmp_path)
    assert spent > 0.0 and "ERROR" in failed


def test_cells_of_a_run_that_lost_its_logs():
    assert drum_penalty.cells({"failed": "ERROR"})[:3] == ["lost logs"] * 3
    assert drum_penalty.cells(None) == ["–"] * 5


def test_usable_step_ends_at_the_first_that_is_wrong():
    def entry(turn, value, half=1.0):
        return {"turn": turn, "moment": [value, half]} if value else {"turn": turn, "failed": "lost"}

    reference = {"moment": (100.0, 1.0)}
    rows = [entry(0.1, 100.0), entry(0.5, 108.0), entry(1.0, 130.0), entry(2.0, 100.0)]
    assert drum_penalty.usable(rows, reference) == 0.5
    assert drum_penalty.usable([entry(1.0, None)], reference) is None
    assert drum_penalty.usable([entry(0.1, 115.0, 10.0), entry(0.5, 125.0, 90.0)], reference) == 0.1


def test_reference_leaves_out_the_law_with_numerical_loss():
    small, next_one, *_ = drum_penalty.LARGE_STEPS
    rows = [{"law": law, "turn": turn, "moment": [value, 3.0]} for law, turn, value in (
        ("theta 1", small, 0.0), ("theta 0.5", small, 100.0), ("penalty", next_one, 110.0), ("penalty", 4.0, 1e9))]
    assert drum_penalty.reference_of(rows, "moment") == pytest.approx((105.0, 3.0 / np.sqrt(2.0)))


def test_rows_of_a_run_that_is_under_way(tmp_path):
    assert last_step(tmp_path) == 0
    (tmp_path / "time.csv").write_text("step,time\n10,1\n20,2\n3")
    assert last_step(tmp_path) == 20
