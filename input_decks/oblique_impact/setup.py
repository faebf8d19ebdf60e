"""Oblique impact: a sphere for each measured angle and each set of inputs, all of which touch the plane z = 0 at the same time."""

import csv
from pathlib import Path

import numpy as np

from dembark.input_decks.common.packing import Packing
from dembark.input_decks.common.setup import Parameters, Setup, strides

MEASURED = Path(__file__).with_name("reference") / "kharaz_2001.csv"
# Each set of inputs after the first lowers one of them by its uncertainty.
INPUTS = ("speed", "friction", "restitution", "poisson_ratio", "target_poisson_ratio")


def setup(p: Parameters) -> Setup:
    """Sphere k of set s is body s n + k, counted from 0, of type s + 1; n: measured angles. The types of the planes follow."""
    with MEASURED.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    angles, readings = (np.radians([float(row[key]) for row in rows]) for key in ("angle", "angle_digitised"))
    sets = [vars(p), *({**vars(p), name: getattr(p, name) - getattr(p, f"{name}_uncertainty")} for name in INPUTS), vars(p)]
    incidence = np.concatenate([np.tile(angles, len(sets) - 1), angles - readings])
    kinds = np.repeat(np.arange(len(sets)), len(angles))
    speeds = np.array([one["speed"] for one in sets])[kinds]
    normal, zero = speeds * np.cos(incidence), np.zeros(len(kinds))
    places = np.column_stack([4.0 * p.radius * np.arange(len(kinds)), zero, p.radius + normal * p.lead_steps * p.time_step])
    box = np.array([(-4.0 * p.radius, places[-1, 0] + 4.0 * p.radius), (-4.0 * p.radius, 4.0 * p.radius), (-p.radius, 8.0 * p.radius)])
    packing = Packing(box, places, zero + 2.0 * p.radius, zero + p.density, kinds + 1,
                      np.column_stack([zero, speeds * np.sin(incidence), -normal]), type_count=2 * len(sets))
    output = strides(p.duration, p.time_step, 20)

    def column(*names: str) -> tuple[float, ...]:
        return tuple(one[name] for name in names for one in sets)

    return Setup(output["steps"], p.time_step, packing, {**output, "skin": 0.2 * p.radius}, tables={
        "restitutions": column("restitution"), "frictions": column("friction"),
        "youngs_moduli": column("youngs_modulus", "target_youngs_modulus"),
        "poisson_ratios": column("poisson_ratio", "target_poisson_ratio")})
