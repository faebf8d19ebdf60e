"""Dam break: a column at the left wall of a tank."""

from dembark.input_decks.common.setup import Parameters, Setup
from dembark.input_decks.common.water import fluid_setup, full_spacings, wall_layers


def setup(p: Parameters) -> Setup:
    """The tank is 0 < x < length, y > 0, open above."""
    length, top = (full_spacings(one, p.spacing) for one in (p.tank_length * p.column_width, 1.25 * p.depth))
    thick = wall_layers(p) * p.spacing
    numbers = {"spacing": p.spacing, "sound_speed": p.sound_speed, "depth": p.depth, "filled_at_rest": 0, "grain_count": p.grain_count}
    return fluid_setup(p, (-thick, length + thick, -thick, 2.0 * top), **numbers, tank_right=length, tank_top=top)
