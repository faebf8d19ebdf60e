"""Log cradle: a row of equal logs along x, the first of which moves."""

import numpy as np

from dembark.input_decks.common import packing
from dembark.input_decks.common.setup import Parameters, Setup, strides


def setup(p: Parameters) -> Setup:
    """The first log begins at the origin; nothing leaves the box on the way."""
    output = strides(p.duration, p.time_step, p.frames - 1)
    spacing = 2.0 * p.radius + p.gap
    places, velocities = np.zeros((2, p.log_count, 3))
    places[:, 0] = np.arange(p.log_count) * spacing
    velocities[0, 0] = p.velocity
    reach = p.log_count * spacing + 2.0 * p.velocity * output["steps"] * p.time_step + 1.0
    box = [(-reach, reach), (-1.0, 1.0), (-1.0, 1.0)]
    logs = packing.bodies(box, places, np.full(p.log_count, p.radius), p.mass, velocities=velocities)
    return Setup(output["steps"], p.time_step, logs, output)
