"""Vibrated layer: a dilute layer above a plate in a periodic box, the levels of the plate's motion, and the steps of output."""

import math
from itertools import pairwise

import numpy as np

from dembark.input_decks.common import packing
from dembark.input_decks.common.drive_levels import levels
from dembark.input_decks.common.motion import amplitude, motion
from dembark.input_decks.common.setup import Parameters, Setup, contacts, rectangle
from dembark.input_decks.common.vibration import fixed_phases, suitable_step


def setup(p: Parameters) -> Setup:
    """The layer falls on the plate at rest; then the amplitude grows to that of the first level, and later from level to level."""
    frequency, d_max = p.motion_frequency, packing.largest(p)
    still = math.ceil(p.settle_time * frequency)
    first = motion(p, start=still / frequency)
    planned = levels(vars(p))
    speed = 2.0 * math.pi * (frequency * amplitude(p) * max(one.gamma for one in planned) / planned[0].gamma
                             + p.motion_second_frequency * p.motion_second_amplitude)
    start, last = still + planned[0].start, planned[-1]
    step, numbers = fixed_phases(frequency, suitable_step(p, speed), start, last.start + p.periods - planned[0].start, rows=2)
    words = (*first.words, *(word for one, other in pairwise(planned)
                             for word in change(p, other.gamma - one.gamma, (still + other.start - p.run_in - p.level_ramp) / frequency)))
    reach, foot = speed / (2.0 * math.pi * frequency), 0.15 * d_max + p.strip_rise * p.grain_diameter * (p.floor == "strips")
    sites, height = packing.slab(p, p.layer_length, p.layer_depth, margin=0.0, foot=foot)
    top = foot + height + 4.0 * reach + 0.5 * (1.3 * speed) ** 2 / p.gravity
    box = [(0.0, p.layer_length), (0.0, p.layer_depth), (-reach - 2.0 * d_max, top)]
    grains = packing.grains(p, sites, box)
    return Setup(numbers["steps"], step, grains, {**numbers, **contacts(p, skin=0.2), "rest_periods": still, "plate_speed": speed},
                 {"plate": strips(p) if p.floor == "strips" else plate(p)}, {"motion_words": words})


def change(p: Parameters, gamma: float, start: float) -> tuple[str, ...]:
    """Words of a motion that from `start` (s) on adds the acceleration `gamma` (g), in phase with that of the first level."""
    amplitude = gamma * p.gravity / (2.0 * math.pi * p.motion_frequency) ** 2
    return ("harmonic", "amplitude", "0", "0", f"{amplitude:.17g}", "frequency", f"{p.motion_frequency:.17g}", "phase",
            f"{p.motion_phase:.17g}", "start", f"{start:.17g}", "ramp", f"{p.level_ramp}")


def plate(p: Parameters) -> packing.Array:
    """Triangles (n, 3, 3) in m of the level z = 0, in panels about as wide as the period along y is deep, for LIGGGHTS cannot place
    elements that are much larger than the period."""
    panels = max(1, round(p.layer_length / p.layer_depth))
    side = p.layer_length / panels
    return np.vstack([rectangle((side * k, 0.0, 0.0), (side, 0.0, 0.0), (0.0, p.layer_depth, 0.0)) for k in range(panels)])


def strips(p: Parameters) -> packing.Array:
    """The same of strips along y, from valleys at z = 0 up to ridges and down again."""
    pairs = max(1, round(p.layer_length / (2.0 * p.strip_width * p.grain_diameter)))
    side, rise = p.layer_length / (2 * pairs), p.strip_rise * p.grain_diameter
    return np.vstack([rectangle((side * k, 0.0, rise * (k % 2)), (side, 0.0, rise * (1 - 2 * (k % 2))), (0.0, p.layer_depth, 0.0))
                      for k in range(2 * pairs)])
