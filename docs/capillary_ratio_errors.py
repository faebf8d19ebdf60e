"""Unequal spheres and walls: the error of the effective radius R = 2 R*, and the deviation of `exact` from an independent solution.

The law for equal spheres of R = 2 R* (the approximation of Derjaguin) is what tables and formulas made for equal spheres can do; it is
compared with `exact`, which takes the spheres as they are. `exact` is compared with dembark.physics.young_laplace. Run as a script it
solves for the reference, some minutes, and writes figures/capillary_ratio_reference.csv and figures/capillary_ratio_errors.csv.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dembark.physics import capillary_force, rupture_distance
from dembark.physics.young_laplace import bridge, rupture

Array = NDArray[np.float64]

FOLDER = Path(__file__).with_name("figures")
ANGLES = (0, 30, 60)  # degrees
RATIOS = (0.5, 0.2, 0.05, 0.0)  # smaller radius over larger; 0 = wall
VOLUMES = np.geomspace(1e-6, 0.1, 21)  # over R^3, R = 2 R*
SHARES = np.append(np.linspace(0.0, 0.95, 20), 0.98)  # of the rupture distance
REFERENCE_VOLUMES = (1e-5, 1e-3, 0.1)
REFERENCE_SHARES = (0.0, 0.1, 0.5, 0.9, 0.99)


def radii(ratio: float) -> tuple[float, float]:
    """Two radii of this ratio with R = 1."""
    small = 0.5 * (1.0 + ratio)
    return small, small / ratio if ratio > 0.0 else np.inf


def effective_radius_errors(ratio: float, angle: int) -> tuple[Array, Array]:
    """Deviation of the law for equal spheres from `exact`: of the force (volumes, SHARES), of the rupture distance (volumes,)."""
    theta, volumes, pair = np.radians(angle), VOLUMES[:, None], radii(ratio)
    end = rupture_distance(volumes, theta, *pair)
    gaps = SHARES * end
    force = capillary_force(1.0, 1.0, gaps, volumes, 1.0, theta) / capillary_force(*pair, gaps, volumes, 1.0, theta) - 1.0
    return force, (rupture_distance(volumes, theta, 1.0, 1.0) / end - 1.0)[:, 0]


def reference_row(ratio: float, angle: int, volume: float) -> list[float]:
    """Rupture distance, forces at REFERENCE_SHARES of it and at rupture of the independent solution, in R and gamma R."""
    theta = float(np.radians(angle))
    end = rupture(volume, theta, ratio)
    return [ratio, angle, volume, end.gap, *(bridge(volume, share * end.gap, theta, ratio).force for share in REFERENCE_SHARES), end.force]


def read_reference() -> Array:
    """Rows of the stored reference, as of `reference_row`."""
    return np.genfromtxt(FOLDER / "capillary_ratio_reference.csv", delimiter=",", skip_header=1)


def law_errors(row: Sequence[float]) -> Array:
    """Deviation of `exact` from a row of the reference: forces at REFERENCE_SHARES, then the rupture distance."""
    ratio, angle, volume, end, *forces, _ = row
    theta, pair = np.radians(angle), radii(ratio)
    law = capillary_force(*pair, np.array(REFERENCE_SHARES) * end, volume, 1.0, theta)
    return np.append(law / np.array(forces) - 1.0, rupture_distance(volume, theta, *pair) / end - 1.0)


def _write(name: str, header: Sequence[str], rows: Iterable[Sequence[float]]) -> None:
    with (FOLDER / name).open("w", newline="", encoding="ascii") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        writer.writerows([f"{value:.8g}" for value in row] for row in rows)


def write_errors() -> None:
    """The deviations of the figure as a file."""
    rows = []
    for ratio in RATIOS:
        for angle in ANGLES:
            forces, ends = effective_radius_errors(ratio, angle)
            rows += [[ratio, angle, volume, share, round(value, 6)] for volume, line in zip(VOLUMES, forces, strict=True)
                     for share, value in zip(SHARES, line, strict=True)]
            rows += [[ratio, angle, volume, 1.0, round(value, 6)] for volume, value in zip(VOLUMES, ends, strict=True)]
    _write("capillary_ratio_errors.csv", ("radius_ratio", "contact_angle_deg", "volume_over_R3", "gap_over_rupture", "equal_spheres"), rows)


def main() -> None:
    """Solve for the reference and write the files."""
    FOLDER.mkdir(exist_ok=True)
    _write("capillary_ratio_reference.csv",
           ("radius_ratio", "contact_angle_deg", "volume_over_R3", "rupture_over_R", *(f"force_{s:g}" for s in REFERENCE_SHARES),
            "force_at_rupture"),
           (reference_row(ratio, angle, volume) for ratio in RATIOS for angle in ANGLES for volume in REFERENCE_VOLUMES))
    write_errors()


if __name__ == "__main__":
    main()
