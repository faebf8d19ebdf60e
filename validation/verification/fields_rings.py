"""Averages around an axis in closed form against three-dimensional fields that are averaged over shells."""

from __future__ import annotations

import numpy as np
from scipy.special import erf

from dembark.postproc.fields.coarse_graining import coarse_grain
from dembark.postproc.fields.grid import Grid
from dembark.postproc.fields.kernels import CUTOFF
from dembark.postproc.fields.rings import Rings, RingSums
from dembark.postproc.fields.rings import coarse_grain as ring_fields

from . import scenes
from .item import Array, Curve, Item, Panel, exact
from .scenes import GRAVITY, Network

_WIDTH = 0.15
_RADIUS = 0.75


def rings() -> Item:
    """Mass and momentum balance of ring-shaped cells, and their stress against that of ever finer cubes."""
    network = _centred(scenes.heap())
    cells = Rings.around(_RADIUS, 1.0, _WIDTH, 0.1)
    fields, _ = ring_fields(network.frame, network.links, [network.base], cells, np.ones((len(cells.heights), 1)),
                                   lambda place: np.ones((len(place), 1)))
    unbalanced = np.abs(fields.unbalanced(cells, GRAVITY)).max() / (fields.mean("mass", cells).max() * GRAVITY)
    cut = 1.0 - float(erf(CUTOFF / np.sqrt(2.0))) ** 3
    spacings = np.array([0.1, 0.07, 0.05, 0.035])
    errors = np.array([_against_cubes(network, cells, fields, spacing) for spacing in spacings])
    return Item(
        "rings",
        "Average around an axis",
        "Fields over radius and height, as on the pages of silos, are averaged around the axis before they are put on a grid. Mass must be "
        "conserved, the vertical momentum that flows through the faces of each ring must balance weight and base force of the heap "
        "at rest, and averages of the three-dimensional fields over the same shells must converge to the same stresses for small cubes.",
        [exact("ring_mass", "mass in the rings over that of the grains, − 1", fields.mass.sum() / network.frame.masses.sum() - 1.0,
               "closed form", "a grain without its mass"),
         exact("ring_balance", "balance of vertical momentum in the worst ring, over max ρ g", float(unbalanced), "momentum balance",
               "gravity doubled", tolerance=1e-3,
               detail="errors of Gauss's rule along the lines and of the tables of the kernel; the tolerance is that of the cases")],
        [Panel("Rings against cubes", "spacing of the cubes / width", "largest difference / largest stress", [
            Curve("σ$_{zz}$, σ$_{rr}$, σ$_{rz}$", spacings / _WIDTH, errors),
            Curve("truncation of the cubes' Gaussian", spacings / _WIDTH, np.full(len(spacings), cut), theory=True)])],
        "The difference on fine grids is the part of the Gaussian beyond three widths, 0.8 %, which the three-dimensional kernel omits.",
    )


def _centred(network: Network) -> Network:
    shift = np.array([0.5, 0.5, 0.0])
    frame, links, base = network.frame, network.links, network.base
    place = frame.positions - shift
    moved = scenes.grains(place, frame.radii, low=-np.ones(3), high=np.full(3, 2.0))
    return Network(moved, scenes.contacts(links.first - shift, links.branch, links.forces, links.ids - 1),
                   type(base)(base.points - shift, base.positions - shift, base.forces))


def _against_cubes(network: Network, cells: Rings, fields: RingSums, spacing: float) -> float:
    half, low = 1.2, -0.6
    across, up = int(np.ceil(2.0 * half / spacing)), int(np.ceil(2.2 / spacing))
    grid = Grid(np.array([-half, -half, low]), np.array([half, half, low + up * spacing]), (across, across, up))
    stress = coarse_grain(network.frame, network.links, grid, width=_WIDTH, walls=[network.base]).fields().contact_stress
    assert stress is not None
    place = grid.points()[..., :2]
    radius = np.maximum(np.hypot(place[..., 0], place[..., 1]), 1e-12)
    turn = np.zeros((*radius.shape, 3, 3))
    outward = place / radius[..., None]
    turn[..., 0, :2], turn[..., 1, 0], turn[..., 1, 1], turn[..., 2, 2] = outward, -outward[..., 1], outward[..., 0], 1.0
    turned = turn @ stress @ np.swapaxes(turn, -1, -2)
    shares = _shell_shares(grid, cells.radial)
    inside = (cells.heights > 0.0) & (cells.heights < 1.0)
    worst, largest = 0.0, 0.0
    for (row, column), name in (((2, 2), "zz"), ((0, 0), "rr"), ((2, 0), "zr")):
        layers = np.tensordot(shares, turned[:, :, :, row, column], axes=([1, 2], [0, 1])) / shares.sum(axis=(1, 2))[:, None]
        mine = fields.mean(name, cells)
        other = np.array([np.interp(cells.heights, grid.centres(2), layer) for layer in layers])
        keep = np.ix_(cells.radii < _RADIUS, inside)
        worst, largest = max(worst, float(np.abs(other - mine)[keep].max())), max(largest, float(np.abs(mine).max()))
    return worst / largest


def _shell_shares(grid: Grid, radial: Array, parts: int = 8) -> Array:
    """Share (k, nx, ny) of each column of cells in the shells between the radii `radial`, by points within the cell."""
    fine = [((np.arange(parts * grid.shape[axis]) + 0.5) / parts * grid.spacing[axis] + grid.low[axis]) for axis in (0, 1)]
    shell = np.digitize(np.hypot(fine[0][:, None], fine[1]), radial) - 1
    blocks = shell.reshape(grid.shape[0], parts, grid.shape[1], parts)
    return np.stack([(blocks == number).mean(axis=(1, 3)) for number in range(len(radial) - 1)])
