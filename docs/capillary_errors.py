"""Deviation of the capillary models from an independent solution of Young and Laplace's equation.

The reference is dembark.physics.young_laplace, which shoots on the differential equation and shares nothing with the models. Run as a
script it solves for the grid below, about two minutes, and writes figures/capillary_errors.csv beside it.
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dembark.physics import CAPILLARY_MODELS, capillary_force, rupture_distance
from dembark.physics.young_laplace import bridge, rupture_gap

Array = NDArray[np.float64]

FILE = Path(__file__).with_name("figures") / "capillary_errors.csv"
ANGLES = (0, 30, 60)  # degrees
VOLUMES = np.geomspace(1e-6, 0.1, 21)  # over R^3
# Shares of the rupture distance. The force has a vertical tangent at rupture itself, where no relative deviation of a force means much.
GAPS = np.array([0.0, 0.01, 0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99, 0.999])
HEADER = ("contact_angle_deg", "volume_over_R3", "gap_over_rupture", "gap_over_R", "force_reference", *CAPILLARY_MODELS)


def row(angle: int, volume: float, share: float) -> list[float]:
    """One line of the file: forces over gamma R, models by their deviation model/reference - 1."""
    theta = float(np.radians(angle))
    gap = share * rupture_gap(volume, theta)
    reference = bridge(volume, gap, theta).force
    models = [capillary_force(1.0, 1.0, gap, volume, 1.0, theta, model=model) / reference - 1.0 for model in CAPILLARY_MODELS]
    return [angle, volume, share, gap, reference, *models]


def rupture_row(angle: int, volume: float) -> list[float]:
    """Deviation of each model's rupture distance, in the same columns; the gap share is written as 1 and no force is given."""
    theta = float(np.radians(angle))
    gap = rupture_gap(volume, theta)
    return [angle, volume, 1.0, gap, np.nan, *(rupture_distance(volume, theta, 1.0, 1.0, model=m) / gap - 1.0 for m in CAPILLARY_MODELS)]


def read() -> dict[str, Array]:
    """Columns of the file."""
    table = np.genfromtxt(FILE, delimiter=",", names=True)
    return {name: np.asarray(table[name]) for name in table.dtype.names}


def main() -> None:
    """Solve for the grid and write the file."""
    FILE.parent.mkdir(exist_ok=True)
    with FILE.open("w", newline="", encoding="ascii") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(HEADER)
        for angle in ANGLES:
            for volume in VOLUMES:
                for share in GAPS:
                    writer.writerow(f"{value:.7g}" for value in row(angle, float(volume), float(share)))
                writer.writerow(f"{value:.7g}" for value in rupture_row(angle, float(volume)))


if __name__ == "__main__":
    main()
