"""Dam break in space: a column that ends at x = 0, a tank around y = 0 with its floor at z = 0, and a box on it."""

from dataclasses import replace

from dembark.common.errors import DembarkError
from dembark.input_decks.common.setup import Parameters, Setup
from dembark.input_decks.common.water import fluid_setup, full_spacings, wall_layers

from .sensors import GAUGES, sensors


def setup(p: Parameters) -> Setup:
    """Column, tank and box with sides of full spacings. The box keeps the places of its face and its top, the column that of its front:
    the lowest layer of the box is up to half a spacing off the lattice of the floor."""
    dx = p.spacing
    column, end, top = (full_spacings(one, dx) for one in (p.column_length, p.tank_length - p.column_length, p.tank_height))
    box = p.scene == "box"
    side = 0.5 * p.across * dx
    thick = wall_layers(p) * dx
    # A slab's period is its width.
    wide = side + thick if box else side
    sizes = {name: max(dx, full_spacings(one, dx)) for name, one in (("box_x", p.box_length), ("box_y", p.box_width))}
    sizes |= {"box_z": p.box_height, "box_foot": p.box_height - max(dx, full_spacings(p.box_height, dx))}
    seen, near = sensors(p.scene, p.distance if box else end, sizes["box_z"], sizes["box_x"]), 2.0 * p.smoothing * dx
    if not seen:
        raise DembarkError(f"a box of {p.box_length:g} m by {p.box_height:g} m carries no sensor", "", "make it 0.03 m long or high")
    low, high = ([pick(place[axis] for place in seen.values()) + sign * near for axis in range(3)] for pick, sign in ((min, -1), (max, 1)))
    numbers = {"spacing": dx, "sound_speed": p.sound_speed, "depth": p.column_depth, "filled_at_rest": 1, "grain_count": p.grain_count,
               "particle_mass": p.fluid_density * dx**3, "column": column, "tank_end": end, "tank_top": top, "side": side, "thick": thick,
               "low_y": -wide, "high_y": wide, "low_z": -thick, "high_z": top + thick, **sizes,
               **{f"seen_{name}_{axis}": ends[k] for name, ends in (("low", low), ("high", high)) for k, axis in enumerate("xyz")}}
    made = fluid_setup(p, (-column - thick, end + thick, -wide, wide), p.rows, **numbers)
    return replace(made, tables={"gauge": tuple(GAUGES.values())})
