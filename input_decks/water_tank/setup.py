"""Water in a tank in the plane: a lattice that fills it, less a body or with a slot in the floor, and walls."""

import math
from typing import Any

import numpy as np

from dembark.input_decks.common.setup import Parameters, Setup
from dembark.input_decks.common.water import fluid_setup, full_spacings, wall_layers

SQUARE = ("floating", "falling", "drifting")


def setup(p: Parameters) -> Setup:
    """The tank is 0 < x < tank_right, y > 0, open above but for the box of the cylinder. A slot is in the middle of the floor."""
    dx, closed = p.spacing, p.scene == "cylinder"
    right, depth = full_spacings(p.tank_width, dx), full_spacings(p.water_depth, dx)
    if p.scene == "slot" or p.scene in SQUARE:
        # As many particles left of the slot or block as right of it.
        right = p.size + 2.0 * full_spacings(0.5 * (p.tank_width - p.size), dx)
    if p.scene == "drifting":
        depth = p.size + 2.0 * full_spacings(0.5 * (p.water_depth - p.size), dx)
    # A block begins a tenth of its side too high.
    low = full_spacings(p.water_depth - (p.body_density / p.fluid_density - 0.1) * p.size, dx)
    half, square = 0.5 * p.size, p.scene in SQUARE
    middle, body_y = 0.5 * right, {"floating": low + half, "falling": depth}.get(p.scene, 0.5 * depth)
    x, y = np.meshgrid((np.arange(round(right / dx)) + 0.5) * dx - middle, (np.arange(round(depth / dx)) + 0.5) * dx - body_y)
    within = np.zeros(x.shape, bool)
    if square:
        within = (np.abs(x) < half) & (np.abs(y) < half)
    elif closed:
        within = x**2 + y**2 < half**2
    # The block rises above the water.
    count = round(p.size / dx) ** 2 if square else int(within.sum())
    mass, pushed = p.body_density * count * dx**2, p.run_time - 0.5 * p.ramp
    # Its own mass and as much of water are accelerated.
    body: dict[str, Any] = {"middle": middle, "body_y": body_y, "half": half, "body_count": count, "body_mass": mass,
                               "body_inertia": mass * p.size**2 / 6.0, "load": 4.0 * mass * p.moved * dx / pushed**2}
    # A jet falls until the end.
    fall = 2.0 * math.sqrt(2.0 * p.gravity * depth) * p.run_time + 0.5 * p.gravity * p.run_time**2 if p.scene == "slot" else 0.0
    thick, top = wall_layers(p) * dx, depth if closed else depth + full_spacings(p.headroom, dx)
    if p.scene == "drifting":
        room = full_spacings(p.headroom, dx)
        return fluid_setup(p, (-room, right + room, -room, depth + room), spacing=dx, sound_speed=p.sound_speed, depth=depth,
                           filled_at_rest=1, tank_right=right, grain_count=x.size - int(within.sum()), **body)
    above = thick if closed else full_spacings(p.headroom, dx)
    return fluid_setup(p, (-thick, right + thick, -thick - full_spacings(fall, dx), top + above),
                       spacing=dx, sound_speed=p.sound_speed, depth=depth, filled_at_rest=1, tank_right=right, tank_top=top, thick=thick,
                       grain_count=x.size - int(within.sum()), **body)
