"""Linear complementarity problems with a symmetric positive definite matrix: w = M z + q, w >= 0, z >= 0, z.w = 0."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dembark import _physics

if TYPE_CHECKING:
    # Scipy takes a third of a second to import, which those who solve nothing need not wait for.
    from scipy import sparse

Matrix: TypeAlias = "ArrayLike | sparse.sparray | sparse.spmatrix"
LCP_METHODS = ("auto", "energy", "block", "murty", "pgs")


@dataclass(frozen=True)
class LcpCertificate:
    """How well an answer fulfils the conditions; dimensionless.

    With d_i = sqrt(M_ii), s_i = |q_i| + sum_j |M_ij z_j| and S = max s_i / d_i:

    z_violation : max(0, -z_i d_i) / S
    w_violation : max(0, -w_i / d_i) / S
    complementarity : |z.w| / S^2
    """

    z_violation: float
    w_violation: float
    complementarity: float

    @property
    def worst(self) -> float:
        """The largest of the three."""
        return max(self.z_violation, self.w_violation, self.complementarity)


@dataclass(frozen=True)
class LcpResult:
    """The answer to w = M z + q, w >= 0, z >= 0, z.w = 0, and what it took."""

    z: NDArray[np.float64] = field(repr=False)  # (n,), >= 0, units of q / M
    w: NDArray[np.float64] = field(repr=False)  # (n,), units of q; exactly 0 where z > 0 (but for pgs)
    pivots: int  # single exchanges w_i <-> z_i; sweeps of pgs
    block_steps: int  # steps that exchanged all violated indices at once
    islands: int  # connected parts of the graph of M, solved apart
    used_fallback: bool  # a rule stalled or came back to a set that it had left, and a safer one took over
    certificate: LcpCertificate
    status: str  # 'solved' or 'iteration_limit'

    @property
    def active(self) -> NDArray[np.bool_]:
        """(n,) flags, z_i > 0: the `start` for a problem that is nearly the same."""
        return self.z > 0.0


class LcpSolver:
    """The solver with its work space: for sequences of problems.

    Matrices with the pattern of the last one use its islands and its fill-reducing order again. Not for several threads at once.

    >>> solver = LcpSolver()
    >>> first = solver.solve([[2.0, 1.0], [1.0, 2.0]], [-5.0, -6.0])
    >>> first.z.round(12).tolist()
    [1.333333333333, 2.333333333333]
    >>> solver.solve([[2.0, 1.0], [1.0, 2.0]], [-5.0, -6.1], start=first.active).pivots
    0
    """

    def __init__(self) -> None:
        self._solver = _physics.LcpSolver()

    def solve(self, M: Matrix, q: ArrayLike, *, method: str = "auto", start: ArrayLike | None = None,  # noqa: N803
              tolerance: float = 1e-12, max_iterations: int | None = None, check: bool = True) -> LcpResult:
        """As `solve_lcp`. `check=False` leaves out the tests of symmetry, definiteness and finite numbers: for matrices that have them
        by construction. What is not definite may then be answered or reported, as it turns out."""
        from scipy import sparse

        right = _vector(q)
        n = len(right)
        limit = _limit(max_iterations)
        flags = np.zeros(0, dtype=bool) if start is None else _flags(start, n)
        rest = (flags, _physics.LcpOptions(method, float(tolerance), limit, bool(check)))
        if sparse.issparse(M):
            matrix = _columns(M, n)
            return _result(self._solver.solve_columns(matrix.indptr, matrix.indices, matrix.data, right, *rest))
        matrix = _dense(M, n)
        if matrix.flags.f_contiguous or not matrix.flags.c_contiguous:
            return _result(self._solver.solve_dense(np.asfortranarray(matrix), right, *rest))
        try:  # rows of a symmetric matrix are its columns
            return _result(self._solver.solve_dense(matrix.T, right, *rest))
        except ValueError:  # ... of others they are not, and the message names entries
            return _result(self._solver.solve_dense(np.asfortranarray(matrix), right, *rest))


def solve_lcp(M: Matrix, q: ArrayLike, *, method: str = "auto", start: ArrayLike | None = None,  # noqa: N803
              tolerance: float = 1e-12, max_iterations: int | None = None) -> LcpResult:
    """Solve w = M z + q, w >= 0, z >= 0, z.w = 0 with M symmetric positive definite; the solution exists and is unique.

    M : (n, n), dense or any scipy.sparse matrix; both triangles. Any units: they go with q (M z) and z.
    q : (n,)
    method : 'auto'    energy for small islands; sweeps and conjugate gradients for large ones, then block where those take too long
             'energy'  the energy criterion (G. N. Kolesnikov, Resources and Technology 10 (2013)): exchange w_i <-> z_i where -q_i^2 / M_ii
                       of the transformed system is most negative, the exchange that releases the most energy; ties: the lower index
             'block'   all violated indices at once (Judice & Pires, Computers & Operations Research 21 (1994) 587)
             'murty'   least index (Murty, Opsearch 11 (1974) 138): slow, ends for certain
             'pgs'     projected Gauss-Seidel, for comparison
    start : (n,) flags or the z of a like problem: the set {z_i > 0} to begin with. It changes the number of steps, not the answer.
            pgs starts from 0 always.
    tolerance : of the certificate, between 0 and 1. pgs stops there; the other methods end with the exact set up to rounding, and take
            0.01 tolerance for rounding where that is more.
    max_iterations : most pivots, block steps or sweeps per island; None = own choice, 1000 n + 1000 (pgs: 100000 sweeps)

    Raises ValueError with one line that names the entry when M is not symmetric (to 1e-12), not positive definite (to rounding: also when
    singular) or not finite, or when the shapes do not fit; TypeError for what are no numbers. Unknowns count from 0.

    >>> M = np.array([[4.0, -1.0, 0.0, 0.0], [-1.0, 4.0, -1.0, 0.0], [0.0, -1.0, 4.0, -1.0], [0.0, 0.0, -1.0, 4.0]])
    >>> answer = solve_lcp(M, [-4.0, 3.0, -4.0, 2.0])
    >>> answer.z.tolist(), answer.w.tolist(), answer.pivots
    ([1.0, 0.0, 1.0, 0.0], [0.0, 1.0, 0.0, 1.0], 2)
    """
    return LcpSolver().solve(M, q, method=method, start=start, tolerance=tolerance, max_iterations=max_iterations)


def _floats(name: str, value: Any, what: str) -> NDArray[np.float64]:
    try:
        return np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise TypeError(f"{name} must be {what} of real numbers, not {type(value).__name__}") from None


def _vector(q: ArrayLike) -> NDArray[np.float64]:
    vector = _floats("q", q, "a vector")
    if vector.ndim != 1:
        raise ValueError(f"q must be a vector (n,), not an array of shape {vector.shape}")
    return np.ascontiguousarray(vector)


def _shape(shape: tuple[int, ...], n: int) -> None:
    if len(shape) != 2 or shape[0] != shape[1]:
        raise ValueError(f"M must be a square matrix (n, n), not an array of shape {shape}")
    if shape[0] != n:
        raise ValueError(f"q must have one entry per row of M, {shape[0]}, not {n}")


def _dense(M: ArrayLike, n: int) -> NDArray[np.float64]:  # noqa: N803
    matrix = _floats("M", M, "a square matrix")
    if n == 0 and matrix.size == 0:
        return matrix.reshape(0, 0)
    _shape(matrix.shape, n)
    return matrix


def _columns(M: sparse.sparray | sparse.spmatrix, n: int) -> sparse.csc_array:  # noqa: N803
    from scipy import sparse

    _shape(M.shape, n)
    matrix = sparse.csc_array(M)
    if np.iscomplexobj(matrix.data):
        raise TypeError("M must be a square matrix of real numbers, not complex ones")
    if not matrix.has_canonical_format:
        matrix = matrix.copy()
        matrix.sum_duplicates()
    if matrix.nnz >= 2**31:
        raise ValueError(f"M must have fewer than 2^31 stored entries, not {matrix.nnz}")
    if matrix.dtype != np.float64 or matrix.indices.dtype != np.int32 or matrix.indptr.dtype != np.int32:
        parts = matrix.data.astype(np.float64), matrix.indices.astype(np.int32), matrix.indptr.astype(np.int32)
        matrix = sparse.csc_array(parts, shape=(n, n))
    return matrix


def _flags(start: ArrayLike, n: int) -> NDArray[np.bool_]:
    flags = np.ascontiguousarray(_floats("start", start, "a vector of flags or") > 0.0)
    if flags.shape != (n,):
        raise ValueError(f"start must have one flag per unknown, shape ({n},), not {flags.shape}")
    return flags


def _limit(max_iterations: int | None) -> int:
    if max_iterations is None:
        return 0
    if isinstance(max_iterations, bool) or int(max_iterations) != max_iterations or not 1 <= max_iterations < 2**31:
        raise ValueError(f"max_iterations must be None or a whole number from 1 on, not {max_iterations!r}")
    return int(max_iterations)


def _result(values: tuple[Any, ...]) -> LcpResult:
    z, w, pivots, block_steps, islands, used_fallback, certificate, solved = values
    status = "solved" if solved else "iteration_limit"
    return LcpResult(z, w, pivots, block_steps, islands, used_fallback, LcpCertificate(*certificate), status)
