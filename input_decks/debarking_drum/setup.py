"""Debarking drum: its radius, or the number of its logs, output steps, and logs on the lowest places in the drum."""

import math

import numpy as np

from dembark.common.errors import DembarkError
from dembark.input_decks.common import packing
from dembark.input_decks.common.setup import Parameters, Setup

# Rows of output in a revolution, each a whole number of steps.
ROWS = 200


def setup(p: Parameters) -> Setup:
    """Diameters are the middles of n equal parts of their range: the same set for every seed, so that the filling is met exactly. Places
    are a lattice of triangles, a little wider than the thickest log; the seed says which log has which diameter."""
    if (p.bark_force is None) != (p.wood_force is None) or (p.cleared_width is not None and p.bark_force is None):
        raise DembarkError("bark_force and wood_force belong together, and cleared_width needs both", "", "set both, or none of the three")
    mean, span = 0.5 * (p.log_diameter_min + p.log_diameter_max), p.log_diameter_max - p.log_diameter_min
    n, square = p.logs, mean**2 + span**2 / 12.0 * (1.0 - 1.0 / p.logs**2)
    radius = 0.5 * math.sqrt(n * square / p.filling) if p.drum_radius is None else p.drum_radius

    period = 2.0 * math.pi / p.drum_speed
    line_density = 0.25 * math.pi * p.log_density * p.log_length
    every = math.ceil(period * math.sqrt(p.log_stiffness / (line_density * p.log_diameter_min**2)) / p.time_step_fraction / ROWS)
    steps, stride = ROWS * every * (p.run_in + p.revolutions), ROWS * every // p.frames

    spacing = 1.02 * p.log_diameter_max
    reach, rise = math.ceil(radius / spacing), math.sqrt(3.0) * spacing
    numbers = np.arange(-reach, reach + 1)
    k, i, shift = (axis.ravel() for axis in np.meshgrid(numbers, numbers, [0.0, 0.5], indexing="ij"))
    sites = np.column_stack(((i + shift) * spacing, np.zeros(len(k)), k * rise + shift * rise))
    sites = sites[np.hypot(sites[:, 0], sites[:, 2]) <= radius - 0.52 * p.log_diameter_max]
    if len(sites) < n:
        raise DembarkError(f"filling {p.filling:g} is too high", f"the drum has places for {len(sites)} of {n} logs only",
                           "take a lower filling" if p.drum_radius is None else "take fewer or thinner logs")
    diameters = p.log_diameter_min + span * (packing.rank(n, p.seed) + 0.5) / n
    box = [(-1.1 * radius, 1.1 * radius), (-0.5 * spacing, 0.5 * spacing), (-1.1 * radius, 1.1 * radius)]
    masses = line_density * diameters**2
    logs = packing.bodies(box, sites[:n], 0.5 * diameters, masses)
    return Setup(steps, period / (ROWS * every), logs, {
        "logs": n, "inner_radius": radius, "load_weight": p.gravity * masses.sum(),
        "every": every, "stride": stride, "first": steps - stride * (p.frames - 1)})
