"""Vibratory hardening: grains in a trough around a clamped part, and the steps of output at fixed phases of the drive."""

import math
from dataclasses import replace

from dembark.input_decks.common import packing
from dembark.input_decks.common.motion import amplitude, motion
from dembark.input_decks.common.setup import Parameters, Setup, contacts
from dembark.input_decks.common.trough import polygon, prism, sites, trough
from dembark.input_decks.common.vibration import fixed_phases, highest_speed, impact, suitable_step

# Samples of the grains on the part in an impact at the trough's highest speed.
SAMPLES = 12


def setup(p: Parameters) -> Setup:
    """Part and trough move as one."""
    still = math.ceil(p.settle_time * p.motion_frequency)
    moving = motion(p, start=still / p.motion_frequency)
    step, numbers = fixed_phases(p.motion_frequency, suitable_step(p, highest_speed(p)), still + p.motion_ramp + p.run_in, p.periods)
    centre = (0.0, -0.2 * p.trough_width)
    places, top = sites(p, (*centre, 0.5 * p.part_diameter))
    depth = 2.0 * p.grain_diameter
    reach = amplitude(p) + 2.0 * p.grain_diameter
    wide, high = 0.5 * p.trough_width + reach, max(p.trough_side, top) + reach
    bodies = packing.grains(p, places, [(-wide, wide), (-depth, depth), (-wide, high)])
    bodies = replace(bodies, positions=bodies.positions * [1, 0, 1])
    _, lasts = impact(p, highest_speed(p))
    samples = max(1, int(lasts / (SAMPLES * step)))
    more = {"drive_speed": highest_speed(p), "begin": still * numbers["period_steps"], "sample": samples}
    part = prism(polygon(p.part_diameter, p.part_corners, centre), depth)
    return Setup(numbers["steps"], step, bodies, {**numbers, **more, **contacts(p, skin=0.2)},
                 {"trough": trough(p.trough_width, p.trough_side, p.strips, depth), "part": part}, {"motion_words": moving.words})
