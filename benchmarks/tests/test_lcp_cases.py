"""The problems of the LCP benchmark are what they say, and its goals are read from the right rows."""

import numpy as np
import pytest

from benchmarks.lcp import goals, measure
from benchmarks.lcp_cases import certificate, coupled, network, sequence
from dembark.physics import solve_lcp


@pytest.mark.parametrize("contacts", [10, 100, 1000])
def test_network_is_a_network_of_contacts(contacts):
    problem = network(contacts)
    M = problem.M.toarray()  # noqa: N806
    assert M.shape == (contacts, contacts)
    np.testing.assert_allclose(M, M.T, rtol=1e-13)
    assert np.linalg.eigvalsh(M).min() > 0.2
    assert (M != 0.0).sum(axis=0).max() <= 11  # a contact shares a log with ten others at most
    closed = solve_lcp(problem.M, problem.q).active.mean()
    assert 0.4 < closed < 0.95


def test_sequence_keeps_the_pattern_and_changes_every_value():
    first, second = sequence(100, 2)
    np.testing.assert_array_equal(first.M.indices, second.M.indices)
    assert (first.M.data != second.M.data).all()
    assert (first.q != second.q).all()


def test_certificate_tells_answers_from_others():
    problem = coupled(30)
    z = solve_lcp(problem.M, problem.q).z
    assert certificate(problem, z) < 1e-14
    assert certificate(problem, z + 0.01) > 1e-4
    assert certificate(problem, -z) > 1e-2
    assert certificate(problem, 0.0 * z) > 1e-2


def test_goals_are_ratios_of_medians():
    rows = [{"case": "coupled", "contacts": 800, "solver": solver, "median": median}
            for solver, median in (("Siconos lemke", 0.3), ("Siconos pgs", 0.05), ("dembark auto", 0.02), ("dembark energy", 0.2))]
    rows.append({"case": "network, warm", "contacts": 1000, "solver": "dembark auto", "median": 5e-4})
    found = {goal["goal"]: (round(goal["value"], 9), goal["met"]) for goal in goals(rows)}
    assert found == {"coupled, 800: dembark auto faster than Siconos lemke by": (15.0, True),
                     "coupled, 800: dembark auto faster than Siconos pgs by": (2.5, True),
                     "coupled, 800: dembark energy faster than Siconos lemke by": (1.5, False),
                     "network, warm, 1000: dembark auto, s": (5e-4, True)}


@pytest.mark.full
def test_small_measurement(tmp_path):
    assert measure(tmp_path, 1, wall=False, quick=True) == []
    text = (tmp_path / "lcp.md").read_text(encoding="utf-8")
    assert "| coupled | 10 | dembark energy |" in text
    assert {path.name for path in tmp_path.iterdir()} == {"lcp.csv", "lcp.json", "lcp.md", "lcp.png"}


@pytest.mark.parametrize("compliance", [1e-3, 1e-5, 1e-7, 1e-9])
def test_networks_that_are_rigid_against_a_step_need_no_single_pivots(compliance):
    """Far beyond the stiffness that is measured: block pivots stall there."""
    problem = network(800, compliance=compliance)
    result = solve_lcp(problem.M, problem.q)
    assert (result.status, result.pivots) == ("solved", 0)
    assert result.block_steps < 100
    assert certificate(problem, result.z) < 1e-12
