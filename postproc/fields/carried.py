"""What grains and contacts carry onto the grid, in the columns of FieldSums."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dembark.postproc.fields import sums as column
from dembark.postproc.fields.sums import symmetric_parts
from dembark.postproc.spheres import volume

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Grains:
    """n grains: `places` (n, 3) in the box, `masses`, `radii` (n,), `velocities` (n, 3), `peculiar` (n, 3): those of which the kinetic
    energy is taken, `touches` (n,): numbers of contacts, `liquid` (n,): volumes of liquid or None; SI units."""

    places: Array
    masses: Array
    radii: Array
    velocities: Array
    peculiar: Array
    touches: Array
    liquid: Array | None

    def values(self, index: Index, place: Array) -> Array:
        """Columns (k, 32) of the grains `index` (k,) at `place` (k, 3) relative to the middle of the grid."""
        values = np.zeros((len(index), column.GRAIN_COLUMNS))
        mass, velocity, peculiar = self.masses[index], self.velocities[index], self.peculiar[index]
        momentum = mass[:, None] * velocity
        values[:, column.MASS] = mass
        values[:, column.MOMENTUM] = momentum
        values[:, column.ENERGY] = symmetric_parts(mass[:, None] * peculiar, peculiar)
        values[:, column.PLACE] = mass[:, None] * place
        values[:, column.SPREAD] = symmetric_parts(mass[:, None] * place, place)
        values[:, column.SHEAR] = (momentum[:, :, None] * place[:, None, :]).reshape(-1, 9)
        values[:, column.NUMBER] = 1.0
        values[:, column.VOLUME] = volume(self.radii[index])
        values[:, column.TOUCHES] = self.touches[index]
        if self.liquid is not None:
            values[:, column.LIQUID] = self.liquid[index]
        return values


@dataclass(frozen=True, eq=False)
class Contacts:
    """m contacts: `first`, `branch`, `forces` (m, 3) as in ContactFrame, `pairs` (m, 2): rows of their grains, `touching` (m,),
    `radii` (n,), `velocities` (n, 3) and `omegas` (n, 3; None when unknown) of the grains, `liquid` and `power` (m,) or None; SI units."""

    first: Array
    branch: Array
    forces: Array
    pairs: Index
    touching: NDArray[np.bool_]
    radii: Array
    velocities: Array
    omegas: Array | None
    liquid: Array | None
    power: Array | None

    def values(self, index: Index) -> Array:
        """Columns (k, 20) of the contacts `index` (k,)."""
        values = np.zeros((len(index), column.CONTACT_COLUMNS))
        branch, forces, touching = self.branch[index], self.forces[index], self.touching[index]
        length = np.sqrt((branch**2).sum(axis=1))
        normal = branch / np.maximum(length, 1e-300)[:, None]
        values[:, column.STRESS] = -(forces[:, :, None] * branch[:, None, :]).reshape(-1, 9)
        values[:, column.FABRIC] = symmetric_parts(normal * touching[:, None], normal)
        values[:, column.TOUCHING] = touching
        values[:, column.COUNT] = 1.0
        if self.liquid is not None:
            values[:, column.BRIDGED] = self.liquid[index]
        if self.omegas is not None:
            values[:, column.POWER], values[:, column.FRICTION] = self._power(self.omegas, index, forces, normal, length)
        if self.power is not None:
            values[:, column.POWER] = self.power[index]
        return values

    def _power(self, omegas: Array, index: Index, forces: Array, normal: Array, length: Array) -> tuple[Array, Array]:
        """Power (k,) of the contact forces that the grains lose (W), and its tangential part."""
        one, two = self.pairs[index].T
        half = 0.5 * (self.radii[one] + self.radii[two] - length)
        spin = (self.radii[one] - half)[:, None] * omegas[one] + (self.radii[two] - half)[:, None] * omegas[two]
        relative = self.velocities[one] - self.velocities[two] + np.cross(spin, normal)
        total = -(forces * relative).sum(axis=1)
        return total, total + (forces * normal).sum(axis=1) * (relative * normal).sum(axis=1)
