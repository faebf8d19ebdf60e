"""Mixing and segregation: a dilute bed in a vessel, large grains among it, the vessel's walls, and the steps of output."""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from dembark.input_decks.common import packing
from dembark.input_decks.common.motion import amplitude, motion
from dembark.input_decks.common.setup import Parameters, Setup, contacts, rectangle
from dembark.input_decks.common.vibration import fixed_phases, suitable_step


def setup(p: Parameters) -> Setup:
    """The bed falls into the vessel at rest; then the amplitude grows, and the frames begin."""
    frequency = p.motion_frequency
    still = math.ceil(p.settle_time * frequency)
    moving = motion(p, start=still / frequency)
    speed = 2.0 * math.pi * frequency * amplitude(p)
    suitable = min(suitable_step(sort, speed) for sort in (p, second_material(p)))
    step, numbers = fixed_phases(frequency, suitable, still + math.ceil(p.motion_ramp), p.periods, rows=2)
    biggest = packing.largest(p) * (1.0 if p.mixture == "equal" else p.size_ratio)
    reach = amplitude(p)
    margin = 0.15 * biggest
    sites, height = packing.slab(p, p.vessel_width, p.vessel_depth, margin, foot=margin, rows=p.dimensions == 2, size=biggest)
    # Grains thrown off the surface fly no higher than this.
    top = height + margin + 4.0 * reach + 0.5 * (2.0 * speed) ** 2 / p.gravity
    box = [(-biggest, p.vessel_width + biggest), (0.0, p.vessel_depth), (-reach - 2.0 * biggest, top + 2.0 * biggest + reach)]
    grains = packing.grains(p, sites, box)
    if p.dimensions == 2:
        grains = replace(grains, positions=grains.positions * [1, 0, 1] + [0, 0.5 * p.vessel_depth, 0])
    second = second_sort(p, grains)
    grains = replace(grains, diameters=np.where(second, p.size_ratio, 1.0) * grains.diameters,
                     densities=np.where(second, p.density_ratio, 1.0) * grains.densities)
    walls = {"vessel": vessel(p, reach, top)}
    return Setup(numbers["steps"], step, grains, {**numbers, **contacts(p, skin=0.2)}, walls, {"motion_words": moving.words})


def second_material(p: Parameters) -> Parameters:
    """The parameters with the density of the second sort, whose grains press deeper into each other."""
    return Parameters(**{**vars(p), "grain_density": p.density_ratio * p.grain_density})


def second_sort(p: Parameters, grains: packing.Packing) -> NDArray[np.bool_]:
    """Which grains (n,) are large or dense: none, some by the seed, or the lowest one nearest to the middle."""
    count = len(grains.diameters)
    if p.mixture == "two_sorts":
        return packing.rank(count, p.seed) < round(p.second_part * count)
    found = np.zeros(count, bool)
    if p.mixture == "intruder":
        off = np.abs(grains.positions[:, 0] - 0.5 * p.vessel_width)
        found[np.lexsort((off, np.round(grains.positions[:, 2] / p.grain_diameter)))[0]] = True
    return found


def vessel(p: Parameters, reach: float, top: float) -> packing.Array:
    """Floor and side walls as triangles (n, 3, 3) in m, in panels about as long as the period is deep, for LIGGGHTS cannot place elements
    that are much larger than the period."""
    def panels(length: float) -> tuple[int, float]:
        count = max(1, round(length / p.vessel_depth))
        return count, length / count

    across, along = (0.0, p.vessel_depth, 0.0), panels(p.vessel_width)
    count, rise = panels(top - reach)
    floor = [rectangle((along[1] * k, 0.0, 0.0), (along[1], 0.0, 0.0), across) for k in range(along[0])]
    sides = [rectangle((x, 0.0, rise * k), across, (0.0, 0.0, rise)) for x in (0.0, p.vessel_width) for k in range(count)]
    return np.vstack(floor + sides)
