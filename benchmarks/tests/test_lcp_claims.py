"""The tableau of the published rule, its counterexample, the problems of logs and their files, and the methods that are compared."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import mmread
from scipy.optimize import nnls

from benchmarks import lcp_claims, lcp_logs
from benchmarks.lcp_cases import Problem, certificate, network
from dembark.common.errors import DembarkError
from dembark.physics import solve_lcp


def test_the_counterexample_takes_four_pivots_for_two_contacts_and_the_energy_rises():
    M, q = (np.array(part, float) for part in lcp_claims.COUNTEREXAMPLE)  # noqa: N806
    way = lcp_claims.gauss_jordan(M, q)
    assert (np.linalg.eigvalsh(M) > 0.0).all()
    assert (way.exchanged, way.ended) == ([2, 0, 1, 2], True)
    assert (way.z > 0.0).tolist() == [True, True, False]
    assert way.energy[-1] > way.energy[-2]
    assert way.energy[-1] == pytest.approx(0.5 * way.z @ M @ way.z + q @ way.z)
    result = solve_lcp(M, q, method="energy")
    assert (result.pivots, result.active.sum(), result.used_fallback) == (4, 2, False)
    np.testing.assert_allclose(result.z, way.z, rtol=1e-12)


@pytest.mark.parametrize(("name", "exchanged"), [("example 1", [0, 2]), ("example 2", [1, 3]), ("example 3", [0])])
def test_published_examples_take_their_published_pivots(name, exchanged):
    way = lcp_claims.gauss_jordan(*(np.array(part, float) for part in lcp_claims.PUBLISHED[name]))
    assert way.exchanged == exchanged
    assert (np.diff(way.energy) < 0.0).all()


@given(st.integers(1, 30), st.integers(0, 10**6))
@settings(max_examples=100, deadline=None)
def test_in_a_row_of_logs_the_rule_is_minimal(count, seed):
    """Its matrix has no positive number off the diagonal; then a contact that has closed stays closed."""
    problem = lcp_claims.row_of_logs(count, np.random.default_rng(seed))
    way = lcp_claims.gauss_jordan(problem.dense, problem.q)
    assert way.ended
    assert len(way.exchanged) == (way.z > 0.0).sum()
    assert (np.diff(way.energy) < 0.0).all()
    assert certificate(problem, way.z) < 1e-12


@pytest.mark.parametrize("make", [lcp_logs.drum, lcp_logs.pile])
def test_the_problems_are_those_of_the_impact_model(make):
    """Forces of the first step of a run, whose velocities are those of the full step, from the same logs."""
    logs = make(12)
    dt = 0.2 / logs.omega
    system = logs.system(theta=1.0)
    system.run(0.0, dt)
    forces = np.array([contact["normal_force"] for contact in system.contacts()])
    problem = lcp_logs.problem(logs, dt, kick=0.5)
    found = solve_lcp(problem.M, problem.q).z
    assert (forces > 0.0).sum() > 3
    np.testing.assert_allclose(np.sort(found[found > 0.0]), np.sort(forces[forces > 0.0]), rtol=1e-9)


def test_files_hold_the_problems_and_their_solutions(tmp_path):
    assert lcp_logs.main([str(tmp_path), "--logs", "12"]) == 0
    assert len(list(tmp_path.glob("*.mtx"))) == 18
    for name, expected in lcp_logs.problems(12).items():
        stem = name.replace(" ", "_")
        M, q, z = (mmread(tmp_path / f"{stem}_{part}.mtx") for part in "Mqz")  # noqa: N806
        np.testing.assert_allclose(M.toarray(), expected.dense, rtol=0.0, atol=1e-15 * expected.dense.max())  # one triangle is written
        np.testing.assert_allclose(q.ravel(), expected.q, rtol=1e-15)
        solved = solve_lcp(M.tocsc(), q.ravel())
        np.testing.assert_allclose(solved.z, z.ravel(), rtol=0.0, atol=1e-11 * z.max())
        assert (z > 0.0).sum() >= 3
        # Another method, which only knows the file: M is G^T G, and z is the solution of non-negative least squares.
        factor = np.linalg.cholesky(M.toarray()).T
        other = nnls(factor, -np.linalg.solve(factor.T, q.ravel()))[0]
        np.testing.assert_allclose(other, z.ravel(), rtol=0.0, atol=1e-8 * z.max())
    assert lcp_logs.main([str(tmp_path), "--logs", "5"]) == 2


def test_every_method_finds_the_answer_of_the_others():
    problem = network(30)
    exact = solve_lcp(problem.M, problem.q).z
    sweeps = lcp_claims.Sweeps(problem)
    for row in (lcp_claims.by_dembark(problem, "murty"), lcp_claims.by_sweeps(problem, sweeps.nncg()),
                lcp_claims.by_least_squares(problem)):
        assert row["certificate"] < 1e-11
        assert row["steps"] > 0
    *_, last = (z for z, _ in zip(sweeps.pgs(), range(200), strict=False))
    np.testing.assert_allclose(last, exact, atol=1e-9)
    # Conjugate gradients need fewer sweeps where sweeps alone are slow.
    stiff = network(100, compliance=1e-3)
    assert lcp_claims.by_sweeps(stiff, lcp_claims.Sweeps(stiff).nncg())["steps"] < 0.5 * lcp_claims.by_sweeps(
        stiff, lcp_claims.Sweeps(stiff).pgs())["steps"]


def test_interior_point_finds_the_answer():
    pytest.importorskip("clarabel")
    row = lcp_claims.by_interior_point(network(50))
    assert row["status"] == "Solved"
    assert row["certificate"] < 1e-9


def test_survey_counts_what_is_there():
    rows = lcp_claims.survey((3, 10), 4)
    assert {row["family"] for row in rows} == {"row of logs", "network", "network, stiff", "coupled", "random"}
    assert all(row["differs_from_tableau"] == 0 and row["returned"] == 0 for row in rows)
    assert all(row["minimal"] == 1.0 and row["rises"] == 0.0 for row in rows if row["family"] == "row of logs")


def test_published_set():
    kept, refused = lcp_claims.published_set()
    assert (sorted(kept), refused) == (["Siconos deudeu", "Siconos mmc", "Siconos trivial"], 14)


def test_redraw(tmp_path):
    small = Problem(np.array(lcp_claims.COUNTEREXAMPLE[0], float), np.array(lcp_claims.COUNTEREXAMPLE[1], float))
    found = {"survey": lcp_claims.survey((3,), 1), "comparison": lcp_claims.compare({"pile 40": small}, ()),
             "paths": {"3 × 3": lcp_claims.gauss_jordan(small.M, small.q).energy}, "curves": {"PGS": [0.1, 1e-3]}}
    (tmp_path / "lcp_claims.json").write_text(json.dumps({"rows": found}))
    lcp_claims.redraw(tmp_path, tmp_path / "figure.png")
    assert (tmp_path / "figure.png").read_bytes().startswith(b"\x89PNG")
    assert "dembark energy" in (tmp_path / "figure.csv").read_text(encoding="utf-8")
    assert "| 3 " in lcp_claims.survey_table(found["survey"])
    assert "| dembark energy | 4 |" in lcp_claims.comparison_table(found["comparison"])
    with pytest.raises(DembarkError, match="no measurement to draw"):
        lcp_claims.redraw(tmp_path / "nowhere", tmp_path / "figure.png")
