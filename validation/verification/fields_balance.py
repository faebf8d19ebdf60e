"""Momentum balance in coarse-grained fields of a heap at rest, and the force on its base."""

from __future__ import annotations

import numpy as np

from dembark.postproc.fields.coarse_graining import coarse_grain
from dembark.postproc.fields.field_set import FieldSet
from dembark.postproc.fields.grid import Grid
from dembark.postproc.fields.kernels import Kernel
from dembark.postproc.walls import PlaneWall
from dembark.postproc.walls.patches import plane_patches
from dembark.postproc.walls.stress import wall_stress

from . import scenes
from .item import Curve, Item, Panel, exact, order
from .scenes import GRAVITY, Network

_SPACINGS = np.array([0.1, 0.06, 0.04, 0.03])  # m, of a heap of 1 m
_WIDTHS = {"lucy": 0.35, "gaussian": 0.15}


def residual(network: Network, kernel: str, width: float, spacing: float) -> tuple[float, float]:
    """Largest and root-mean-square |div sigma - rho g - t| over the largest rho g, with central differences on cells of `spacing` (m)."""
    fields = _fields(network, kernel, width, spacing)
    step = fields.grid.spacing
    assert fields.contact_stress is not None
    left = fields.boundary_force - sum(np.gradient(fields.contact_stress[..., axis], step[axis], axis=axis) for axis in range(3))
    left[..., 2] -= fields.density * GRAVITY
    size = np.sqrt((left[1:-1, 1:-1, 1:-1] ** 2).sum(axis=-1)) / (fields.density.max() * GRAVITY)
    held = fields.density[1:-1, 1:-1, 1:-1] > 0.0
    return float(size.max()), float(np.sqrt((size[held] ** 2).mean()))


def _fields(network: Network, kernel: str, width: float, spacing: float) -> FieldSet:
    margin = Kernel(kernel, width).reach + 2.0 * spacing
    count = int(np.ceil((1.0 + 2.0 * margin) / spacing))
    grid = Grid(np.full(3, -margin), np.full(3, count * spacing - margin), (count,) * 3)
    return coarse_grain(network.frame, network.links, grid, kernel=kernel, width=width, walls=[network.base]).fields()


def balance() -> Item:
    """Residual of the balance of momentum against the grid's spacing, and against the kernel's width."""
    network = scenes.heap()
    by_spacing = {kernel: np.array([residual(network, kernel, width, spacing) for spacing in _SPACINGS])
                  for kernel, width in _WIDTHS.items()}
    widths = np.array([0.2, 0.3, 0.45])
    by_width = np.array([residual(network, "lucy", width, 0.07)[1] for width in widths])
    fall = by_spacing["lucy"][:, 1]
    return Item(
        "balance",
        "Static balance: ∇·σ = ρ g + wall forces",
        f"A heap of {len(network.frame.ids)} grains at random positions on a base; its {len(network.links.ids)} contacts carry forces "
        "of any direction under which each grain is in equilibrium to round-off. The fields must then satisfy ∇·σ − ρ g − t = 0 in every "
        "cell, t being the coarse-grained force of the base (Weinhart et al. 2012). The divergence is taken by central differences, which "
        "have an error that is second order in the spacing over the width of the kernel; there is no other error.",
        [order("balance_order", "residual (rms, Lucy's kernel): exponent of the spacing", _SPACINGS[-2:], fall[-2:], 2.0,
               "central differences", "gravity doubled", detail="the two finest grids")],
        [Panel("Residual against the spacing", "spacing / width", "rms of |∇·σ − ρ g − t| / max ρ g", [
            *(Curve(kernel, _SPACINGS / _WIDTHS[kernel], found[:, 1]) for kernel, found in by_spacing.items()),
            Curve("slope 2", _SPACINGS / _WIDTHS["lucy"], fall[0] * (_SPACINGS / _SPACINGS[0]) ** 2, theory=True)]),
         Panel("Residual against the width", "width (m; cells of 0.07 m)", "rms of |∇·σ − ρ g − t| / max ρ g", [
             Curve("lucy", widths, by_width), Curve("slope −2", widths, by_width[0] * (widths[0] / widths) ** 2, theory=True)])],
        "Left: one width for each kernel (Lucy 0.35 m, Gaussian 0.15 m). Right: one grid. The Gaussian is truncated at three widths, "
        "where it still has 1 % of its height: "
        "on very fine grids differences stop converging because of this jump. Lucy's kernel is smooth.",
    )


def wall_forces() -> Item:
    """Force of the base from patches and from the field, against the sum over the contacts and the weight."""
    network = scenes.heap()
    total, weight = network.base.forces.sum(axis=0), float(network.frame.masses.sum()) * GRAVITY
    fields = _fields(network, "gaussian", 0.12, 0.06)
    of_field = fields.boundary_force.sum(axis=(0, 1, 2)) * fields.grid.cell_volume
    frame = scenes.with_wall(network)
    load = wall_stress([frame], PlaneWall("base"), plane_patches(PlaneWall("base"), *[np.linspace(-0.1, 1.1, 7)] * 2))
    of_patches = (load.mean * load.patches.areas[:, None]).sum(axis=0)
    return Item(
        "wall_forces",
        "Force on a wall",
        "The same heap: the force on the patches of the base, the wall term of the coarse-grained balance, and the sum over the "
        "contacts of the base must be equal, and the vertical component must be the weight.",
        [exact("wall_force_patches", "integrated normal stress of the patches over the force of the contacts, − 1",
               of_patches[0] / total[2] - 1.0, "Newton's third law", "a base with a hundredth too much force"),
         exact("wall_force_field", "integrated wall force density − force of the contacts, over the weight",
               float(np.abs(of_field - total).max()) / weight, "Weinhart et al. 2012", "a base with a hundredth too much force"),
         exact("wall_force_weight", "vertical force of the contacts over the weight, − 1", total[2] / weight - 1.0, "Newton's second law",
               "gravity doubled")],
    )
