"""Vibrating conveyor: a block or a bed on a plate in a periodic box, and a motion of the plate at an angle to the horizontal."""

import math
from types import SimpleNamespace

import numpy as np

from dembark.input_decks.common import packing
from dembark.input_decks.common.motion import amplitude, motion
from dembark.input_decks.common.setup import Parameters, Setup, contacts, strip
from dembark.input_decks.common.vibration import fixed_phases, highest_speed, suitable_step
from dembark.physics import WallMotion


def along(p: Parameters) -> float:
    """Amplitude (m) of the plate along the conveyor, which belongs to its vertical one."""
    return amplitude(p) / math.tan(p.throw_angle)


def plate_motion(p: Parameters, start: float) -> WallMotion:
    """The plate's motion, from `start` (s) on: both components in phase."""
    level = SimpleNamespace(**{**vars(p), "motion_direction": "x", "motion_gamma": None, "motion_amplitude": along(p)})
    return WallMotion(" ".join(map(str, (*motion(p, start=start).words, *motion(level, start=start).words))))


def setup(p: Parameters) -> Setup:
    """Grains fall on the plate at rest, for full periods; then the amplitude grows and stays."""
    frequency, d_max = p.motion_frequency, packing.largest(p)
    still = math.ceil(p.settle_time * frequency)
    step, numbers = fixed_phases(frequency, suitable_step(p, highest_speed(p) / math.sin(p.throw_angle)),
                                 still + p.motion_ramp + p.run_in, p.periods)
    sites, height = packing.slab(p, p.cell_width, p.cell_depth, margin=0.0, foot=0.15 * d_max)
    box = [(0.0, p.cell_width), (0.0, p.cell_depth), (-amplitude(p) - 2.0 * d_max, height + p.headroom)]
    if p.grain_count == 1:
        place = np.array([[0.5 * p.cell_width, 0.5 * p.cell_depth, 0.5 * p.grain_diameter + 1e-6]])
        one = np.ones(1)
        grains = packing.Packing(np.array(box), place, p.grain_diameter * one, p.grain_density * one, one.astype(np.int64))
    else:
        grains = packing.grains(p, sites, box)
    plate = strip((0.0, 0.0, 0.0), (p.cell_width, 0.0, 0.0), p.cell_depth)
    return Setup(numbers["steps"], step, grains, {**numbers, **contacts(p, skin=0.2)}, {"plate": plate},
                 {"motion_words": plate_motion(p, still / frequency).words})
