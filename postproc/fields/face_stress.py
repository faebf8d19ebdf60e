"""The contact stress on the faces of the cells, whose balance over every cell holds to round-off.

For a Gaussian, which is a product X(x) Y(y) Z(z) of shares along the axes, the force through a face normal to x is, per contact,
f times the integral along the branch of (dG/ds) Y Z, with G the cumulative kernel at the face; the difference of G over a cell is X. X, Y,
Z and G are replaced by the polynomials through their values at points along the branch that include both ends. Products of these and
their derivatives are integrated exactly, so the forces through the six faces of a cell add up to f (X Y Z at one end - X Y Z at the
other): the force density of the contacts in the cell. This carries over the density decomposition for charge-conserving currents in
particle-in-cell codes (Esirkepov, Comput. Phys. Commun. 135 (2001) 144), which is the case of straight lines between two points.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BarycentricInterpolator

from ..contacts import ContactFrame
from ..grains import GrainFrame
from .coarse_graining import WallContacts
from .grid import Grid, check_periods, periodic_images
from .kernels import Kernel, cumulative, unit_gauss

Array = NDArray[np.float64]

_POINTS = 5  # on each panel of a branch, both ends among them
_CHUNK = 1024  # lines whose shares are held at once


@dataclass(frozen=True, eq=False)
class FaceStress:
    """Contact stress averaged over each face of the cells of `grid`, in Pa, compression positive.

    `faces[b]` has one layer more than the grid along axis b; its last index is the component a of sigma_ab, the force in direction a on
    a face normal to b.
    """

    grid: Grid
    faces: tuple[Array, Array, Array]

    def divergence(self) -> Array:
        """d sigma_ab / d x_b averaged over each cell (nx, ny, nz, 3) in N/m3, exactly: the force through its surface over its volume."""
        return sum(np.diff(face, axis=axis) / self.grid.spacing[axis] for axis, face in enumerate(self.faces))


def face_stress(grains: GrainFrame, contacts: ContactFrame | None, grid: Grid, *, width: float,
                walls: Sequence[WallContacts] = ()) -> FaceStress:
    """Contact stress of one frame on the faces of `grid`, with the Gaussian kernel of `width` (m).

    In a static frame, minus its divergence plus `boundary_force` plus density times gravity (see Fields) is zero in every cell but for
    the forces out of balance on single grains. In plain numpy: for frames of up to some ten thousand contacts.
    """
    kernel = Kernel("gaussian", float(width))
    check_periods(grid, grains)
    shapes = [tuple(count + (axis == normal) for axis, count in enumerate(grid.shape)) for normal in range(3)]
    faces = [np.zeros((*shape, 3)) for shape in shapes]
    lines = [] if contacts is None else [(contacts.first, contacts.branch, contacts.forces)]
    lines += [(wall.positions, wall.points - wall.positions, wall.forces) for wall in walls]
    for first, branch, forces in lines:
        last = first + branch
        index, shift = periodic_images(np.minimum(first, last), np.maximum(first, last), kernel.reach, grid, grains)
        for begin in range(0, len(index), _CHUNK):
            part = slice(begin, begin + _CHUNK)
            _add(first[index[part]] + shift[part], branch[index[part]], forces[index[part]], grid, kernel, faces)
    area = [grid.cell_volume / step for step in grid.spacing]
    return FaceStress(grid, tuple(face / size for face, size in zip(faces, area, strict=True)))


def _add(first: Array, branch: Array, forces: Array, grid: Grid, kernel: Kernel, faces: list[Array]) -> None:
    ends = np.stack([first, first + branch])
    start = np.clip(np.floor((ends.min(axis=0) - kernel.reach - grid.low) / grid.spacing), 0, np.array(grid.shape) - 1).astype(int)
    stop = np.clip(np.ceil((ends.max(axis=0) + kernel.reach - grid.low) / grid.spacing), 1, grid.shape).astype(int)
    counts = np.maximum(1, (stop - start).max(axis=0))
    panels = kernel.panels(float(np.sqrt((branch**2).sum(axis=1).max())))
    place, weight = unit_gauss((3 * _POINTS - 1) // 2)
    points = 0.5 - 0.5 * np.cos(np.pi * np.arange(_POINTS) / (_POINTS - 1))
    basis = BarycentricInterpolator(points, np.eye(_POINTS))
    value, slope = basis(place), basis.derivative(place)
    edges = [np.minimum(start[:, axis, None] + np.arange(counts[axis] + 1), grid.shape[axis]) for axis in range(3)]
    for panel in range(panels):
        # Cumulative kernels at the faces (lines, points, faces), and shares of the cells between them.
        spots = first[:, None, :] + (panel + points[:, None]) / panels * branch[:, None, :]
        below = [
            cumulative(kernel, grid.low[axis] + edges[axis][:, None, :] * grid.spacing[axis] - spots[:, :, axis, None]) for axis in range(3)
        ]
        shares = [np.einsum("qr,prn->pqn", value, np.diff(face, axis=2)) for face in below]
        through = [np.einsum("qr,prn->pqn", slope, face) for face in below]
        for normal in range(3):
            factors = [through[axis] if axis == normal else shares[axis] for axis in range(3)]
            flux = np.einsum("q,pqi,pqj,pqk->pijk", weight, *factors, optimize=True)
            index = [edges[axis] if axis == normal else np.minimum(edges[axis][:, :-1], grid.shape[axis] - 1) for axis in range(3)]
            # A window that reaches beyond the grid repeats the last face, which counts once.
            once = np.diff(edges[normal], axis=1, prepend=-1) > 0
            flux *= once.reshape(len(once), *(-1 if axis == normal else 1 for axis in range(3)))
            np.add.at(faces[normal], (index[0][:, :, None, None], index[1][:, None, :, None], index[2][:, None, None, :]),
                      flux[..., None] * forces[:, None, None, None, :])
