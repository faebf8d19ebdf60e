"""Set-ups that cannot work are refused in one line before a run begins, which names what is wrong."""

from __future__ import annotations

from typing import Any

import pytest

from dembark.common.errors import DembarkError
from dembark.validation.case.deck import prepare
from dembark.validation.case.folders import find
from dembark.validation.case.resolve import resolve


@pytest.mark.parametrize(("case", "changes", "named"), [
    ("avalanche", {"gate_place": 95.0}, "upper end"), ("avalanche", {"gate_place": 2.0}, "above the toe"),
    ("avalanche", {"slab_depth": 2.0}, "slab_depth"), ("avalanche", {"obstacle_place": 145.0}, "obstacle"),
    ("column_collapse", {"liquid_viscosity": 0.01}, "liquid_viscosity"),
    ("debarking_drum", {"filling": 0.5, "log_diameter_min": 0.24, "log_count": 10},
     r"filling 0\.5 is too high, the drum has places for .* take a lower filling"),
    ("drive_power", {"youngs_modulus": 5e6, "motion_gamma": 3.0}, "raise youngs_modulus"),
    ("dam_break_box", {"resolution": 100, "box_length": 0.01, "box_height": 0.01}, "make it 0.03 m long or high"),
    # Walls and cubes of particles end where their lattice does.
    ("dam_break_cubes", {"spacing": 0.03, "slit_pressure": 0.0, "courant": 0.36}, "column_height must be a multiple"),
    ("dam_break_cubes", {"spacing": 0.02, "slit_pressure": 0.0}, "edge must be a multiple"),
    *((case, {"motion_second_amplitude": 1e-3}, "motion_second_amplitude must be 0") for case in ("drive_power", "vibro_mixing")),
    *((case, {"grain_diameter_spread": 0.2}, "grain_diameter_spread must be 0")
      for case in ("bead_chain", "compressed_chain", "moving_walls")),
    ("drive_power", {"time_step_fraction": 0.3}, "lower time_step_fraction"),
    ("drive_power", {"cell_width": 0.015}, "must be at least 4 grain_diameter"),
    ("drive_power", {"motion": "circular"}, "shake up and down"), ("drive_power", {"motion_amplitude": 0.002}, "not motion_amplitude"),
    *((case, {side: 0.0019}, "cell_length and cell_width must be at least 4 grain_diameter")
      for case in ("bulk_density", "oedometer", "shear_cell") for side in ("cell_length", "cell_width")),
    *((case, {"liquid_content": 0.01, "bridge_volume": 8e-11}, "set liquid_content or bridge_volume, not both")
      for case in ("plug_flow", "silo")),
    ("silo", {"wall_speed": 0.0}, "cylinder_radius must be at least 7 grain_diameter, or wall_speed above 0"),
    *((case, {name: 0.1}, "need a resistance: set rolling_resistance too, or both to 0")
      for case in ("avalanche", "shear_cell") for name in ("rolling_friction", "wall_rolling_friction")),
    ("lifted_cylinder", {"rolling_resistance": "off"}, "or both to 0"),
    ("hopper_discharge", {"rolling_length": 1e-4}, "rolling_length needs a resistance"),
    ("vibro_sieve", {"motion": "none"}, r"motion must be harmonic, motion_direction z, with motion = none, motion_direction = z in case"),
    *((case, {time: 1e300}, r"would have 1e30\d steps, it may have 1e\+15, take shorter times")
      for case, time in (("silo", "measure_time"), ("single_contact", "duration"))),
    ("silo", {"bridge_volume": 1e-3}, "a bridge is larger than the grains"), ("silo", {"surface_tension": 72.0}, "surface_tension"),
    ("liquid_exchange", {"liquid_share": "fraction", "liquid_share_factor": 1.5}, "liquid_share_factor"),
    ("log_pair", {"velocity_1": -1.0}, "velocity_1"), ("log_pair", {"offset": 0.2}, "offset"),
    ("log_pair", {"target": "wall", "velocity_1": -1.0}, "velocity_1"), ("log_pile", {"width": 0.3}, "width"),
    ("penetration", {"bed": "public", "grain_count": 800}, "the public bed"),
    ("penetration", {"grain_count": 800, "box_length": 0.026, "box_width": 0.026, "ball_diameter": 0.01, "ball_height": -0.07},
     "raise ball_height"),
    # The line of centres turns during the contact, by an angle that the reference does not know.
    *(("single_contact", {"partner": partner, "sweep": sweep}, "turn their line of centres")
      for partner in ("mirror", "rest") for sweep in ("direction", "slide")),
])
def test_impossible_set_ups_are_refused(case: str, changes: dict[str, Any], named: str) -> None:
    with pytest.raises(DembarkError, match=named) as caught:
        prepare(find(case), resolve(find(case), None, None, changes))
    assert "\n" not in str(caught.value)
