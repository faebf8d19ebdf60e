"""The LCP solver: conditions, uniqueness, islands, warm starts, hard matrices, bad input."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import sparse

from dembark.physics import LcpSolver, solve_lcp

EXACT = ["auto", "energy", "block", "murty"]


# Plain block steps from this start go round in a circle (found by trying).
CYCLE_M = [[79.0, 6.0, 38.0, -5.0, 28.0], [6.0, 118.0, 11.0, 83.0, -82.0], [38.0, 11.0, 66.0, -3.0, 4.0], [-5.0, 83.0, -3.0, 88.0, -37.0],
           [28.0, -82.0, 4.0, -37.0, 99.0]]
CYCLE_Q = [-1.0, -2.0, -1.0, 0.0, 2.0]
CYCLE_START = [True, False, False, False, True]


def random_problem(n, seed, shift=0.1, rank=None):
    """G G^T + shift, full, with a random right-hand side."""
    random = np.random.default_rng(seed)
    G = random.standard_normal((n, rank or n))  # noqa: N806
    return G @ G.T / n + shift * np.eye(n), random.standard_normal(n)


def network(logs, seed, compliance=0.1):
    """Compliance matrix of contacts between neighbours on a disordered lattice of logs x logs bodies, and random gaps."""
    random = np.random.default_rng(seed)
    i, j = (axis.ravel() for axis in np.meshgrid(np.arange(logs), np.arange(logs)))
    place = np.stack([i + 0.5 * (j % 2), 0.866 * j], axis=1) + 0.1 * random.standard_normal((logs * logs, 2))
    pairs = [(a, b) for a, b in product(range(logs * logs), repeat=2) if a < b and np.hypot(*(place[a] - place[b])) < 1.2]
    a, b = np.array(pairs).T
    normal = (place[a] - place[b]) / np.hypot(*(place[a] - place[b]).T)[:, None]
    k = np.arange(len(a))
    G = sparse.csr_array((np.concatenate([normal[:, 0], normal[:, 1], -normal[:, 0], -normal[:, 1]]),  # noqa: N806
                          (np.concatenate([2 * a, 2 * a + 1, 2 * b, 2 * b + 1]), np.tile(k, 4))), shape=(2 * logs * logs, len(a)))
    return sparse.csc_array(G.T @ G + compliance * sparse.eye_array(len(a))), G.T @ random.standard_normal(2 * logs * logs) - 0.1


def check(M, q, result, tolerance=1e-12):  # noqa: N803
    """The defining conditions, scaled to a unit diagonal, and the certificate recomputed."""
    M = M.toarray() if sparse.issparse(M) else np.asarray(M)  # noqa: N806
    root = np.sqrt(np.diag(M))
    w = M @ result.z + q
    most = ((np.abs(q) + np.abs(M) @ result.z) / root).max(initial=0.0)
    assert (result.z >= 0.0).all()
    assert (w / root).min(initial=0.0) >= -tolerance * most
    assert abs(result.z @ w) <= tolerance * max(most, 1e-300) ** 2
    np.testing.assert_allclose(result.w / root, w / root, rtol=0.0, atol=2.0 * tolerance * most)
    assert result.certificate.worst <= tolerance
    assert result.status == "solved"


def enumerated(M, q):  # noqa: N803
    """The solution by trying every active set."""
    n = len(q)
    best, least = None, np.inf
    for flags in product([False, True], repeat=n):
        active = np.array(flags)
        z = np.zeros(n)
        z[active] = np.linalg.solve(M[np.ix_(active, active)], -q[active])
        violation = max(-z.min(), -(M @ z + q)[~active].min(initial=0.0), 0.0)
        if violation < least:
            best, least = z, violation
    return best


entries = st.integers(-6, 6).map(float)


@st.composite
def small_problems(draw):
    """Definite matrices of small whole numbers, so that ties and degenerate answers are common, with scaled rows now and then."""
    n = draw(st.integers(1, 6))
    G = np.array(draw(st.lists(entries, min_size=n * n, max_size=n * n))).reshape(n, n)  # noqa: N806
    M = G @ G.T + draw(st.sampled_from([0.25, 1.0, 8.0])) * np.eye(n)  # noqa: N806
    units = 10.0 ** np.array(draw(st.lists(st.integers(-5, 5), min_size=n, max_size=n))) if draw(st.booleans()) else np.ones(n)
    return M, np.array(draw(st.lists(entries, min_size=n, max_size=n))), units


@settings(max_examples=300, deadline=None)
@given(small_problems(), st.sampled_from(EXACT), st.data())
def test_small_problems_against_enumeration(given_problem, method, data):
    """Scaling rows and columns by units changes z to z / units and nothing else."""
    M, q, units = given_problem  # noqa: N806
    start = data.draw(st.none() | st.lists(st.booleans(), min_size=len(q), max_size=len(q)))
    scaled = M * units[:, None] * units
    result = solve_lcp(scaled, q * units, method=method, start=start)
    check(scaled, q * units, result)
    expected = enumerated(M, q)
    np.testing.assert_allclose(result.z * units, expected, rtol=1e-7, atol=1e-9 * (1.0 + np.abs(expected).max()))


@pytest.mark.parametrize("method", EXACT)
@pytest.mark.parametrize("n", [2, 30, 45, 120])
def test_methods_agree(n, method):
    M, q = random_problem(n, n)  # noqa: N806
    result = solve_lcp(M, q, method=method)
    check(M, q, result)
    np.testing.assert_allclose(result.z, solve_lcp(M, q, method="pgs", tolerance=1e-14).z, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("method", ["auto", "block", "energy", "murty", "pgs"])
def test_sparse_network(method):
    M, q = network(12, 3)  # noqa: N806
    result = solve_lcp(M, q, method=method)
    check(M, q, result)
    np.testing.assert_allclose(result.z, solve_lcp(M.toarray(), q).z, rtol=0.0, atol=1e-9)
    assert 50 < result.active.sum() < len(q) - 20


def test_energy_rule_pivot_by_pivot():
    """The number of pivots is that of a plain tableau with the same rule."""
    for seed in range(20):
        M, q = random_problem(15, seed)  # noqa: N806
        table, value, active, pivots = M.copy(), q.copy(), np.zeros(15, dtype=bool), 0
        while value.min() < -1e-12:
            i = np.where(value < 0.0, value**2 / np.diag(table), -1.0).argmax()
            column, row = table[:, i].copy(), table[i].copy()
            pivot = table[i, i]
            value, entry = value - column * (value[i] / pivot), -value[i] / pivot
            table = table - np.outer(column, row) / pivot
            table[i], table[:, i], table[i, i], value[i] = -row / pivot, column / pivot, 1.0 / pivot, entry
            active[i] ^= True
            pivots += 1
        result = solve_lcp(M, q, method="energy")
        assert (result.pivots, result.active.tolist()) == (pivots, active.tolist())


def test_ties_are_broken_the_same_way():
    """Equal logs in a row, equally pressed: every energy is tied, and runs repeat to the last bit, dense or sparse."""
    n = 24
    M = 2.0 * np.eye(n) - 0.5 * (np.eye(n, k=1) + np.eye(n, k=-1))  # noqa: N806
    q = -np.ones(n)
    first = solve_lcp(M, q, method="energy")
    for matrix in (M, sparse.csc_array(M), np.asfortranarray(M)):
        again = solve_lcp(matrix, q, method="energy")
        assert again.z.tobytes() == first.z.tobytes()
        assert again.pivots == first.pivots == n
    assert solve_lcp(M, q, method="energy", max_iterations=1).active.tolist() == [True, *[False] * (n - 1)]


@pytest.mark.parametrize("method", EXACT)
def test_islands_are_solved_apart(method):
    blocks = [random_problem(n, n)[0] for n in (1, 2, 7, 50, 3)]
    q = np.random.default_rng(5).standard_normal(63)
    mixed = np.random.default_rng(6).permutation(63)
    M = sparse.block_diag(blocks).toarray()[np.ix_(mixed, mixed)]  # noqa: N806
    result = solve_lcp(M, q[mixed], method=method)
    check(M, q[mixed], result)
    assert result.islands == solve_lcp(sparse.csc_array(M), q[mixed], method=method).islands == len(blocks)
    ends = np.cumsum([len(block) for block in blocks])
    parts = [solve_lcp(block, part, method=method).z for block, part in zip(blocks, np.split(q, ends[:-1]), strict=True)]
    np.testing.assert_allclose(result.z, np.concatenate(parts)[mixed], rtol=0.0, atol=1e-11)


@pytest.mark.parametrize("method", EXACT)
def test_warm_start_gives_the_same_answer(method):
    """From the solution no exchange is left; from anything else the answer is the same."""
    for M, q in (random_problem(60, 1), random_problem(8, 2), network(9, 4)):  # noqa: N806
        cold = solve_lcp(M, q, method=method)
        exact = solve_lcp(M, q, method=method, start=cold.active)
        assert exact.pivots + exact.block_steps == 0
        assert solve_lcp(M, q, method=method, start=cold.z).pivots == 0
        for seed in range(5):
            warm = solve_lcp(M, q, method=method, start=np.random.default_rng(seed).random(len(q)) < 0.5)
            np.testing.assert_allclose(warm.z, cold.z, rtol=0.0, atol=1e-11)


def test_sequence_with_one_solver():
    """The same pattern with new values, then other patterns and sizes: what a solver keeps never shows in the answer."""
    solver, start = LcpSolver(), None
    M, q = network(10, 7)  # noqa: N806
    random = np.random.default_rng(8)
    for step in range(6):
        q = q + 0.02 * random.standard_normal(len(q))
        result = solver.solve(M * (1.0 + 0.01 * step), q, start=start)
        np.testing.assert_allclose(result.z, solve_lcp(M * (1.0 + 0.01 * step), q).z, rtol=0.0, atol=1e-11)
        start = result.active
    for matrix, right in (network(6, 1), random_problem(70, 1), random_problem(3, 1), network(10, 7)):
        check(matrix, right, solver.solve(matrix, right))
    with pytest.raises(ValueError, match="positive definite"):
        solver.solve([[1.0, 2.0], [2.0, 1.0]], [-1.0, -1.0])
    check(M, q, solver.solve(M, q))


@pytest.mark.parametrize("method", EXACT)
@pytest.mark.parametrize("n", [6, 60])
def test_ill_conditioned(n, method):
    """Condition numbers up to 1e12 of the scaled matrix."""
    random = np.random.default_rng(n)
    for exponent in (4, 8, 12):
        basis = np.linalg.qr(random.standard_normal((n, n)))[0]
        M = basis * np.logspace(0, -exponent, n) @ basis.T  # noqa: N806
        M = (M + M.T) / 2  # noqa: N806
        q = random.standard_normal(n)
        check(M, q, solve_lcp(M, q, method=method))


@pytest.mark.parametrize("method", EXACT)
def test_bad_units_of_rows(method):
    """Rows in units that differ by 1e24 are no harder than the scaled problem."""
    M, q = random_problem(50, 11)  # noqa: N806
    units = 10.0 ** np.random.default_rng(1).integers(-12, 13, 50)
    plain, scaled = solve_lcp(M, q, method=method), solve_lcp(M * units[:, None] * units, q * units, method=method)
    np.testing.assert_allclose(scaled.z * units, plain.z, rtol=0.0, atol=1e-12)
    assert scaled.active.tolist() == plain.active.tolist()


@pytest.mark.parametrize("method", EXACT)
def test_degenerate(method):
    """z_i = w_i = 0 in half of the rows: rounding there is no violation."""
    for seed in range(10):
        n = 12 if seed % 2 else 56
        M, _ = random_problem(n, seed)  # noqa: N806
        z = np.where(np.arange(n) % 4 == 0, 1.0 + np.arange(n), 0.0)
        w = np.where(np.arange(n) % 4 == 1, 2.0, 0.0)
        result = solve_lcp(M, w - M @ z, method=method)
        np.testing.assert_allclose(result.z, z, rtol=0.0, atol=1e-10)
        check(M, w - M @ z, result)


def test_rules_that_stall_fall_back():
    """Block steps that go round in a circle begin elsewhere, and say so."""
    M = np.array(CYCLE_M)  # noqa: N806
    q = np.array(CYCLE_Q)
    result = solve_lcp(M, q, method="block", start=CYCLE_START)
    assert result.used_fallback
    assert result.block_steps > 0
    check(M, q, result)
    np.testing.assert_allclose(result.z, enumerated(M, q), atol=1e-10)


@pytest.mark.parametrize("method", [*EXACT, "pgs"])
def test_least_sizes(method):
    for empty in (np.zeros((0, 0)), [], sparse.csc_array((0, 0))):
        nothing = solve_lcp(empty, [], method=method)
        assert (nothing.z.shape, nothing.w.shape, nothing.islands, nothing.status) == ((0,), (0,), 0, "solved")
    pressed, open_ = solve_lcp([[2.0]], [-3.0], method=method), solve_lcp([[2.0]], [3.0], method=method)
    assert (pressed.z.tolist(), pressed.w.tolist()) == ([1.5], [0.0])
    assert (open_.z.tolist(), open_.w.tolist()) == ([0.0], [3.0])
    assert solve_lcp(np.eye(3), np.zeros(3), method=method).z.tolist() == [0.0, 0.0, 0.0]


def test_iteration_limit_is_reported():
    M, q = random_problem(60, 2)  # noqa: N806
    for method, most in (("energy", 3), ("murty", 3), ("pgs", 2)):
        result = solve_lcp(M, q, method=method, max_iterations=most)
        assert (result.status, result.pivots) == ("iteration_limit", most)
    assert solve_lcp(M, q, method="pgs", tolerance=1e-4).pivots < solve_lcp(M, q, method="pgs").pivots


BAD = [
    ([[2.0, 1.0], [0.5, 2.0]], r"not symmetric: M\[0,1\] = 1 but M\[1,0\] = 0\.5"),
    ([[2.0, 1.0], [0.0, 2.0]], r"not symmetric: M\[0,1\] = 1 but M\[1,0\] = 0"),
    ([[2.0, 0.0], [0.25, 2.0]], r"not symmetric: M\[0,1\] = 0 but M\[1,0\] = 0\.25"),
    ([[1.0, 2.0], [2.0, 1.0]], r"not positive definite: its Cholesky pivot in row 1 is -3"),
    ([[1.0, 1.0], [1.0, 1.0]], r"not positive definite: its Cholesky pivot in row 1 is 0"),
    ([[1.0, 0.0], [0.0, -2.0]], r"not positive definite: M\[1,1\] = -2 must be > 0"),
    ([[1.0, 0.0], [0.0, 0.0]], r"not positive definite: M\[1,1\] = 0 must be > 0"),
    ([[1.0, np.nan], [np.nan, 2.0]], r"M\[(0,1|1,0)\] is nan; every entry must be a finite number"),
    ([[1.0, 0.0], [0.0, np.inf]], r"M\[1,1\] is inf; every entry must be a finite number"),
]


@pytest.mark.parametrize("method", [*EXACT, "pgs"])
@pytest.mark.parametrize(("M", "line"), BAD)
def test_bad_matrices_are_refused(M, line, method):  # noqa: N803
    big = np.eye(60)
    big[7:9, 7:9] = M
    full = random_problem(60, 1)[0]
    full[7:9, 7:9] = M
    for order in ("C", "F"):
        with pytest.raises(ValueError, match=line):
            solve_lcp(np.array(M, order=order), [-1.0, -1.0], method=method)
    with pytest.raises(ValueError, match=line):
        solve_lcp(sparse.csr_array(M), [-1.0, -1.0], method=method)
    for matrix in (big, full, sparse.csc_array(big)):
        with pytest.raises(ValueError, match=r"not symmetric: M\[7,8\]|M\[[78],[78]\] (is|=) |pivot in row \d+ is"):
            solve_lcp(matrix, np.ones(60), method=method)


@pytest.mark.parametrize(("arguments", "line"), [
    (dict(M=np.eye(2), q=[1.0, np.nan]), r"q\[1\] is nan"),
    (dict(M=np.eye(2), q=[1.0]), "q must have one entry per row of M, 2, not 1"),
    (dict(M=np.ones((2, 3)), q=[1.0, 1.0]), r"M must be a square matrix \(n, n\), not an array of shape \(2, 3\)"),
    (dict(M=sparse.csc_array((2, 3)), q=[1.0, 1.0]), r"M must be a square matrix \(n, n\), not an array of shape \(2, 3\)"),
    (dict(M=[1.0, 2.0], q=[1.0, 1.0]), r"not an array of shape \(2,\)"),
    (dict(M=np.eye(2), q=[[1.0, 1.0]]), r"q must be a vector \(n,\)"),
    (dict(M=np.eye(2), q=[1.0, 1.0], start=[True]), r"start must have one flag per unknown, shape \(2,\), not \(1,\)"),
    (dict(M=np.eye(2), q=[1.0, 1.0], method="lemke"), "method must be 'auto', 'energy', 'block', 'murty' or 'pgs', not 'lemke'"),
    (dict(M=np.eye(2), q=[1.0, 1.0], tolerance=0.0), "tolerance must be between 0 and 1, not 0"),
    (dict(M=np.eye(2), q=[1.0, 1.0], tolerance=np.nan), "tolerance must be between 0 and 1, not nan"),
    (dict(M=np.eye(2), q=[1.0, 1.0], max_iterations=0), "max_iterations must be None or a whole number from 1 on, not 0"),
])
def test_bad_arguments_are_refused(arguments, line):
    with pytest.raises(ValueError, match=line) as error:
        solve_lcp(**arguments)
    assert "\n" not in str(error.value)


def test_wrong_types_are_refused():
    with pytest.raises(TypeError, match="q must be a vector of real numbers, not str"):
        solve_lcp(np.eye(1), "many")
    with pytest.raises(TypeError, match="M must be a square matrix of real numbers, not list"):
        solve_lcp([["a"]], [1.0])
