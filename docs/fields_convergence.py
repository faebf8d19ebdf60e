"""How the momentum balance of a packing at rest closes on grids of growing fineness.

Run as a script it writes figures/fields_convergence.csv and .png beside it, in a few seconds. The packing is a lattice shaken by 15 % of
its spacing between a floor and four walls; its forces solve the balance of every grain.
"""

from __future__ import annotations

import csv
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from dembark.postproc.fields.coarse_graining import coarse_grain
from dembark.postproc.fields.face_stress import face_stress
from dembark.postproc.fields.grid import Grid

HERE = Path(__file__).parent
FIGURES = HERE / "figures"
WIDTHS = (0.5, 0.8, 1.2)  # over the mean spacing of the grains
COUNTS = (8, 12, 16, 24, 32)
LOW, HIGH = -4.0, 7.0  # holds all the kernels of a packing of 3 by 3 by 3 spacings
HEADER = ("width", "cell_over_width", "residual_cell_averages", "residual_faces")


def row(packing: tuple, width: float, count: int) -> list[float]:
    """Largest residuals of -div sigma + t + rho g over the largest load of a cell: central differences of averages, and faces."""
    grains, contacts, wall, gravity = packing
    grid = Grid((LOW,) * 3, (HIGH,) * 3, (count,) * 3)
    fields = coarse_grain(grains, contacts, grid, width=width, walls=[wall]).fields()
    load = fields.boundary_force + fields.density[..., None] * gravity
    averages = sum(np.gradient(fields.stress[..., axis], grid.spacing[axis], axis=axis) for axis in range(3))
    faces = face_stress(grains, contacts, grid, width=width, walls=[wall]).divergence()
    scale = np.abs(load).max()
    return [width, grid.spacing[0] / width, np.abs(load - averages).max() / scale, np.abs(load - faces).max() / scale]


def main() -> None:
    """Compute, write and draw."""
    sys.path.insert(0, str(HERE.parent / "postproc" / "tests"))
    from packings import packing_at_rest

    rows = [row(packing_at_rest(), width, count) for width in WIDTHS for count in COUNTS]
    with (FIGURES / "fields_convergence.csv").open("w", newline="", encoding="ascii") as handle:
        writer = csv.writer(handle, lineterminator="\n")
        writer.writerow(HEADER)
        writer.writerows([f"{value:.6g}" for value in one] for one in rows)
    table = np.array(rows)
    figure, axes = plt.subplots(figsize=(5.5, 4.0), layout="constrained")
    for number, width in enumerate(WIDTHS):
        part = table[table[:, 0] == width]
        axes.loglog(part[:, 1], part[:, 2], "o-", color=f"C{number}", label=f"cell averages, width {width:g} d")
        axes.loglog(part[:, 1], part[:, 3], "s--", color=f"C{number}", label=f"faces, width {width:g} d")
    slope = np.array([0.3, 1.0])
    axes.loglog(slope, 0.05 * slope**2, "k:", label="second order")
    axes.set(xlabel="cell / width", ylabel="largest residual of the balance / largest load", ylim=(1e-17, 10.0))
    axes.set_xticks([0.3, 0.5, 1.0, 2.0, 3.0], ["0.3", "0.5", "1", "2", "3"])
    axes.tick_params(axis="x", which="minor", labelbottom=False)
    axes.legend(fontsize="small")
    figure.savefig(FIGURES / "fields_convergence.png", dpi=130)


if __name__ == "__main__":
    main()
