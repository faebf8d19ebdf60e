"""Problems of others: the published examples of the energy criterion and Siconos's test data."""

from pathlib import Path

import numpy as np
import pytest
from scipy import sparse

from dembark.physics import solve_lcp

DATA = Path(__file__).with_name("lcp_data")
DEFINITE = ["lcp_deudeu", "lcp_trivial", "lcp_mmc"]
OTHERS = sorted(path.stem for path in DATA.glob("*.dat") if path.stem not in DEFINITE)
EXACT = ["auto", "energy", "block", "murty"]

PUBLISHED = [
    ([[4, -1, 0, 0], [-1, 4, -1, 0], [0, -1, 4, -1], [0, 0, -1, 4]], [-4, 3, -4, 2], [1, 0, 1, 0], [0, 1, 0, 1], 2),
    ([[100, -2, -3, -4], [-2, 50, -6, -7], [-3, -6, 100, -11], [-4, -7, -11, 200]], [1, -2, 3, -4],
     [0, 0.043011, 0, 0.021505], [0.827957, 0, 2.505376, 0], 2),
    ([[4, -1, 2, 0], [-1, 4, -1, 0], [2, -1, 4, -1], [0, 0, -1, 4]], [-4, 1, -2, 0], [1, 0, 0, 0], [0, 0, 0, 0], 1),
]


def problem(name):
    """M and q of a file; M is stored by columns."""
    words = (DATA / f"{name}.dat").read_text(encoding="utf-8").split()
    n, storage, rows, columns = (int(word) for word in words[:4])
    assert (storage, rows, columns) == (0, n, n)
    numbers = np.array(words[6:6 + n * n + n], dtype=float)
    return numbers[:n * n].reshape((n, n), order="F"), numbers[n * n:]


def check(M, q, result, tolerance=1e-12):  # noqa: N803
    """The defining conditions, scaled by what is added up."""
    scale = np.abs(q) + np.abs(M) @ np.abs(result.z)
    assert (result.z >= 0.0).all()
    assert (np.abs(M @ result.z + q - result.w) <= tolerance * scale.max()).all()
    assert (result.w >= -tolerance * scale.max()).all()
    assert np.abs(result.z * result.w).max() <= tolerance * scale.max() * max(1.0, result.z.max())
    assert result.certificate.worst <= tolerance
    assert result.status == "solved"


@pytest.mark.parametrize("method", ["auto", "energy"])
@pytest.mark.parametrize(("M", "q", "z", "w", "pivots"), PUBLISHED)
def test_published_examples(M, q, z, w, pivots, method):  # noqa: N803
    result = solve_lcp(M, q, method=method)
    np.testing.assert_allclose(result.z, z, atol=5e-7)
    np.testing.assert_allclose(result.w, w, atol=5e-7)
    assert (result.pivots, result.block_steps, result.used_fallback) == (pivots, 0, False)


@pytest.mark.parametrize("method", [*EXACT, "pgs"])
@pytest.mark.parametrize(("name", "z"), [("lcp_deudeu", [4 / 3, 7 / 3]), ("lcp_trivial", 1.0 / np.arange(1, 10)), ("lcp_mmc", None)])
def test_definite_data(name, z, method):
    M, q = problem(name)  # noqa: N806
    for matrix in (M, sparse.csc_array(M)):
        result = solve_lcp(matrix, q, method=method)
        check(M, q, result)
        if z is not None:
            np.testing.assert_allclose(result.z, z, rtol=1e-9 if method == "pgs" else 1e-14)


def test_reading_of_the_asymmetric_problem():
    """Its known answer fulfils the conditions; only the symmetry that the method needs is missing."""
    M, q = problem("lcp_ortiz")  # noqa: N806
    z = np.array([2 / 3, 0.0, 1 / 3, 0.0])
    w = M @ z + q
    assert w.min() >= -1e-15
    assert abs(z @ w) < 1e-15
    with pytest.raises(ValueError, match=r"M\[0,1\] = 1 but M\[1,0\] = -1"):  # stored by columns: the file's second number is M[1,0]
        solve_lcp(M, q)


@pytest.mark.parametrize("method", [*EXACT, "pgs"])
@pytest.mark.parametrize("name", OTHERS)
def test_other_data_are_refused(name, method):
    M, q = problem(name)  # noqa: N806
    for matrix in (M, sparse.csr_array(M)):
        line = r"^LCP: M is not (symmetric: M\[\d+,\d+\] = .* but M\[\d+,\d+\] = |positive definite: .*\d)"
        with pytest.raises(ValueError, match=line) as error:
            solve_lcp(matrix, q, method=method)
        assert "\n" not in str(error.value)


@pytest.mark.parametrize("name", ["lcp_CPS_1", "lcp_CPS_5"])
def test_singular_data_are_named_so(name):
    with pytest.raises(ValueError, match="not positive definite"):
        solve_lcp(*problem(name))
