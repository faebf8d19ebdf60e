"""Log pair: two logs, or one before a wall, that touch after the lead time."""

import math

from dembark.input_decks.common import packing
from dembark.input_decks.common.setup import Parameters, Setup, strides


def setup(p: Parameters) -> Setup:
    """Log 2 begins at the origin; a wall stands with its surface there. Nothing leaves the box on the way."""
    output = strides(p.duration, p.time_step, p.frames - 1)
    touch = p.radius_1 + p.radius_2
    if p.target == "wall":
        places = [(-(p.radius_1 + p.velocity_1 * p.lead_time), 0.0, 0.0)]
    else:
        apart = math.sqrt(touch**2 - p.offset**2) + (p.velocity_1 - p.velocity_2) * p.lead_time
        places = [(-apart, p.offset, 0.0), (0.0, 0.0, 0.0)]
    reach = 1.0 + touch + (abs(p.velocity_1) + abs(p.velocity_2)) * (output["steps"] * p.time_step + p.lead_time)
    n = len(places)
    logs = packing.bodies([(-reach, reach), (-reach, reach), (-1.0, 1.0)], places, [p.radius_1, p.radius_2][:n], [p.mass_1, p.mass_2][:n],
                          types=[1, 2][:n], type_count=2, velocities=[(p.velocity_1, 0.0, 0.0), (p.velocity_2, 0.0, 0.0)][:n])
    return Setup(output["steps"], p.time_step, logs, output)
