"""Accumulators of coarse graining: sums per cell that are additive over frames, and the fields that follow from them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from dembark.common.errors import DembarkError

from .field_set import FieldSet
from .grid import Grid
from .kernels import Kernel

Array = NDArray[np.float64]

# Columns of FieldSums.grains; symmetric tensors are stored as xx yy zz xy xz yz.
MASS, MOMENTUM, ENERGY, PLACE, SPREAD, SHEAR = 0, slice(1, 4), slice(4, 10), slice(10, 13), slice(13, 19), slice(19, 28)
NUMBER, VOLUME, TOUCHES, LIQUID, GRAIN_COLUMNS = 28, 29, 30, 31, 32
# Columns of FieldSums.contacts.
STRESS, FABRIC, TOUCHING, POWER, FRICTION, BRIDGED, COUNT, CONTACT_COLUMNS = slice(0, 9), slice(9, 15), 15, 16, 17, 18, 19, 20

_PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


def symmetric_parts(first: Array, second: Array) -> Array:
    """Components xx yy zz xy xz yz (n, 6) of the products of `first` (n, 3) and `second` (n, 3)."""
    return np.stack([first[:, a] * second[:, b] for a, b in _PAIRS], axis=1)


def full_tensor(parts: Array) -> Array:
    """Tensors (..., 3, 3) of components xx yy zz xy xz yz (..., 6)."""
    return parts[..., [[0, 3, 4], [3, 1, 5], [4, 5, 2]]]


@dataclass(frozen=True, eq=False)
class FieldSums:
    """Sums over `frames` frames per cell of `grid`; `+` adds frames. `coarse_grain` makes one of one frame.

    `grains` (nx, ny, nz, 32), `contacts` (nx, ny, nz, 20; None without contacts) and `boundary` (nx, ny, nz, 3) hold what is carried
    times its share in the cell: summed over the cells of a grid that holds everything they are the sums over grains and contacts.
    `peculiar`: kinetic energies are about a given mean velocity; `liquid`, `power`: what the frames hold.
    """

    grid: Grid
    kernel: Kernel
    frames: int
    grains: Array
    contacts: Array | None
    boundary: Array
    peculiar: bool = False
    liquid: bool = False
    power: bool = False

    def __add__(self, other: FieldSums) -> FieldSums:
        """The sums of both; DembarkError when they differ in grid, kernel or in what they hold."""
        alike = ("kernel", "peculiar", "liquid", "power")
        different = [name for name in alike if getattr(self, name) != getattr(other, name)]
        if not self.grid.same(other.grid):
            different.append("grid")
        if (self.contacts is None) != (other.contacts is None):
            different.append("contacts")
        if different:
            raise DembarkError(f"the sums differ in {', '.join(different)}", "averaging fields over frames", "use the same for all frames")
        contacts = None if self.contacts is None or other.contacts is None else self.contacts + other.contacts
        return replace(self, frames=self.frames + other.frames, grains=self.grains + other.grains, contacts=contacts,
                       boundary=self.boundary + other.boundary)

    def fields(self, *, shear_corrected: bool = False) -> FieldSet:
        """The fields, averaged over the frames.

        Kinetic stress and temperature are of v' about the mean velocity of the cell (Goldhirsch 2010), in which a gradient of the mean
        velocity counts as fluctuation. With `shear_corrected`, v' is about the affine velocity field fitted to the grains that the
        kernel sees, and the stress no longer grows with the square of the width. Where `mean_velocity` was given, v' is about that.
        """
        volume = self.frames * self.grid.cell_volume
        grains = self.grains
        mass, momentum = grains[..., MASS], grains[..., MOMENTUM]
        mean, centre = ratio(momentum, mass), ratio(grains[..., PLACE], mass)
        gradient = self._velocity_gradient(mean, centre)
        kinetic = full_tensor(grains[..., ENERGY])
        if not self.peculiar:
            kinetic = kinetic - np.nan_to_num(momentum[..., :, None] * mean[..., None, :])
            if shear_corrected:
                spread = full_tensor(grains[..., SPREAD]) - grains[..., PLACE][..., :, None] * centre[..., None, :]
                kinetic = kinetic - gradient @ spread @ np.swapaxes(gradient, -1, -2)
        kinetic = kinetic / volume
        density = mass / volume
        contacts = self.contacts
        values = {"density": density, "momentum": momentum / volume, "velocity": mean, "solid_fraction": grains[..., VOLUME] / volume,
                  "kinetic_stress": kinetic, "temperature": ratio(np.maximum(np.trace(kinetic, axis1=-2, axis2=-1), 0.0), 3.0 * density),
                  "velocity_gradient": gradient, "strain_rate": 0.5 * (gradient + np.swapaxes(gradient, -1, -2)),
                  "vorticity": np.stack([gradient[..., c, b] - gradient[..., b, c] for b, c in ((1, 2), (2, 0), (0, 1))], axis=-1),
                  "boundary_force": self.boundary / volume, "grain_count": grains[..., NUMBER]}
        liquid = grains[..., LIQUID]
        if contacts is not None:
            contact_stress = contacts[..., STRESS].reshape(*self.grid.shape, 3, 3) / volume
            values |= {"contact_stress": contact_stress, "stress": contact_stress + kinetic,
                       "coordination": ratio(grains[..., TOUCHES], grains[..., NUMBER]),
                       "fabric": ratio(full_tensor(contacts[..., FABRIC]), contacts[..., TOUCHING]), "contact_count": contacts[..., COUNT]}
            if self.power:
                values |= {"dissipated_power": contacts[..., POWER] / volume, "friction_power": contacts[..., FRICTION] / volume}
            liquid = liquid + contacts[..., BRIDGED]
        if self.liquid:
            values["liquid_content"] = liquid / volume
        return FieldSet(self.grid, self.frames, values)

    def _velocity_gradient(self, mean: Array, centre: Array) -> Array:
        """Gradient (nx, ny, nz, 3, 3) of the affine velocity field fitted by least squares, weighted by mass and kernel; 1/s.

        NaN where the grains do not span the directions in which the grid has more than one cell.
        """
        grains = self.grains
        axes = [axis for axis in range(3) if self.grid.shape[axis] > 1]
        result = np.zeros((*self.grid.shape, 3, 3))
        if not axes:
            return result
        mass = grains[..., MASS, None, None]
        moment = ratio(full_tensor(grains[..., SPREAD]), mass[..., 0, 0])
        spread = moment - centre[..., :, None] * centre[..., None, :]
        shear = ratio(grains[..., SHEAR].reshape(*self.grid.shape, 3, 3), mass[..., 0, 0]) - mean[..., :, None] * centre[..., None, :]
        spread, shear = spread[..., axes, :][..., axes], shear[..., axes]
        seen = np.asarray(np.isfinite(spread).all(axis=(-2, -1)))
        # In a dense packing the spread is at least the kernel's variance. A millionth of it is what round-off leaves, or, of kernels that
        # are narrow compared with the cells, the last digits of the moment that the square of the centre was taken off.
        rounding = 1e-12 * np.trace(moment[seen], axis1=-2, axis2=-1)
        seen[seen] = np.linalg.eigvalsh(spread[seen])[:, 0] > np.maximum(1e-6 * self.kernel.variance, rounding)
        result[...] = np.nan
        found = np.zeros((int(seen.sum()), 3, 3))
        found[..., axes] = np.swapaxes(np.linalg.solve(spread[seen], np.swapaxes(shear[seen], -1, -2)), -1, -2)
        result[seen] = found
        return result


def ratio(sums: Array, weights: Array) -> Array:
    """`sums` (..., *more) over `weights` (...), NaN where nothing was weighed."""
    weights = weights.reshape(*weights.shape, *(1,) * (sums.ndim - weights.ndim))
    return np.divide(sums, weights, out=np.full(sums.shape, np.nan), where=weights > 0.0)
