"""Contact problems for the benchmark of the LCP solver."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse


@dataclass(frozen=True)
class Problem:
    """w = M z + q."""

    M: NDArray[np.float64] | sparse.csc_array
    q: NDArray[np.float64]

    @property
    def dense(self) -> NDArray[np.float64]:
        """M with all its zeros."""
        return np.asarray(self.M if isinstance(self.M, np.ndarray) else self.M.toarray(), float)


def coupled(contacts: int, seed: int = 1) -> Problem:
    """A full matrix: every contact feels every other, as where all bodies press on one common body. Half of the contacts close."""
    random = np.random.default_rng(seed)
    normals = random.standard_normal((contacts, contacts))
    return Problem(normals @ normals.T / contacts + 0.5 * np.eye(contacts), random.standard_normal(contacts))


def network(contacts: int, seed: int = 1, compliance: float = 0.5, closing: float = 0.45) -> Problem:
    """Logs of unequal mass on a disordered planar lattice with vacancies; M = diag(1/s) + G^T m^-1 G, all made dimensionless.

    compliance : mean of 1/s, in units of tau^2/m: 1 / (omega tau)^2. The smaller, the farther a force is felt.
    closing : mean speed of approach in units of its scatter; about two thirds of the contacts close.
    """
    random = np.random.default_rng(seed)
    side = int(np.ceil(np.sqrt(contacts / 2.0))) + 2
    i, j = (axis.ravel() for axis in np.meshgrid(np.arange(side), np.arange(side)))
    place = np.stack([i + 0.5 * (j % 2), 0.866 * j], axis=1) + 0.08 * random.standard_normal((side * side, 2))
    present = random.random(side * side) > 0.1
    number = np.arange(side * side).reshape(side, side)
    pairs = [(number[:, :-1], number[:, 1:])]
    for shifted in (0, 1):  # rows with odd numbers lie half a log to the right
        below = number[shifted:-1:2]
        above = number[shifted + 1::2]
        pairs.append((below, above))
        pairs.append((below[:, :-1], above[:, 1:]) if shifted else (below[:, 1:], above[:, :-1]))
    a, b = (np.concatenate([pair[end].ravel() for pair in pairs]) for end in (0, 1))
    kept = present[a] & present[b]
    a, b = a[kept], b[kept]
    order = np.lexsort((b, a))[:contacts]
    a, b = a[order], b[order]
    if len(a) < contacts:
        raise ValueError(f"the lattice has {len(a)} contacts, fewer than {contacts}")
    normal = place[a] - place[b]
    normal /= np.hypot(*normal.T)[:, None]
    k = np.arange(contacts)
    entries = np.concatenate([normal[:, 0], normal[:, 1], -normal[:, 0], -normal[:, 1]])
    G = sparse.csr_array((entries, (np.concatenate([2 * a, 2 * a + 1, 2 * b, 2 * b + 1]), np.tile(k, 4))),  # noqa: N806
                         shape=(2 * side * side, contacts))
    mass = np.repeat(random.uniform(0.5, 2.0, side * side), 2)
    springs = sparse.diags_array(compliance * random.uniform(0.5, 1.5, contacts))
    M = sparse.csc_array(G.T @ sparse.diags_array(1.0 / mass) @ G + springs)  # noqa: N806
    M.sort_indices()
    return Problem(M, G.T @ random.standard_normal(2 * side * side) - closing)


def sequence(contacts: int, steps: int, seed: int = 1) -> list[Problem]:
    """The contacts of a network over some time steps: the pattern stays, all values change, the closed contacts nearly stay."""
    random = np.random.default_rng(seed)
    first = network(contacts, seed)
    scale = sparse.csc_array(first.M)
    problems, q = [], first.q
    for step in range(steps):
        M = scale.copy()  # noqa: N806
        M.data *= 1.0 + 1e-3 * np.sin(step)
        problems.append(Problem(M, q))
        q = q + 2e-3 * random.standard_normal(contacts)
    return problems


def certificate(problem: Problem, z: NDArray[np.float64]) -> float:
    """The worst of the scaled violations of z >= 0, w >= 0, z.w = 0; the same for every solver."""
    M, q = problem.M, problem.q  # noqa: N806
    root = np.sqrt(M.diagonal())
    w = M @ z + q
    most = ((np.abs(q) + abs(M) @ np.abs(z)) / root).max()
    return max(0.0, -(z * root).min() / most, -(w / root).min() / most, abs(z @ w) / most**2)
