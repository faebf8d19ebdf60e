"""Triaxial test: grains in a periodic cell, the rates of its sides, and the steps of the test and of the output."""

import math
from dataclasses import replace

import numpy as np

from dembark.common.errors import DembarkError
from dembark.input_decks.common import packing
from dembark.input_decks.common.packing import Packing
from dembark.input_decks.common.setup import Parameters, Setup, contacts, time_step
from dembark.physics import effective_youngs_modulus

# Inertial numbers of the rates at which a gas is compressed, and at which a cell without stress shrinks; solid fraction of the dense gas.
CLOSING, GAIN, DENSE = 0.02, 0.01, 0.5
# Times over d √(ρ/p): of the integral of the stress that is lacking, and of the rest under equal stresses, of a gas and of a lattice.
INTEGRAL, REST, LATTICE_REST = 2.0, 30.0, 10.0
# Shortest side of the cell over the largest diameter, at least: below 2 two grains could touch each other twice, across the border, and
# engines find one contact for a pair; solid fraction of the densest packings of spheres in disorder.
NARROWEST, DENSEST = 2.5, 0.64
# Rows of time.csv between two frames; share of the strain over which its rate rises.
ROWS, RAMP = 20, 0.1


def setup(p: Parameters) -> Setup:
    """A gas shrinks to DENSE, comes to rest under `confining_stress`, and is compressed by `strain` along z at `inertial_number`.
    DembarkError for a cell that becomes too narrow, and for a test of fewer steps than rows."""
    shortest = p.grain_diameter * (math.pi / 6.0 * p.grain_count / DENSEST) ** (1.0 / 3.0) * math.exp(-p.strain)
    if shortest < NARROWEST * packing.largest(p):
        raise DembarkError(f"the cell becomes {shortest:.3g} m high, grains are up to {packing.largest(p):.3g} m large",
                           "a grain would touch another one twice", "raise grain_count, or lower strain")
    step, rate = time_step(p), math.sqrt(p.confining_stress / p.grain_density) / p.grain_diameter
    closing, strain_rate = CLOSING * rate, p.inertial_number * rate
    if p.arrangement == "fcc":
        bodies, closed, rest = lattice(p), 0, LATTICE_REST
    else:
        bodies, rest = gas(p, closing), REST
        filled = bodies.volume / float(np.prod(np.ptp(bodies.box, axis=1)))
        closed = math.ceil((1.0 - (filled / DENSE) ** (1.0 / 3.0)) / closing / step)
    start, lasts = closed + math.ceil(rest / rate / step), p.strain * (1.0 + 0.5 * RAMP) / strain_rate / step
    if lasts < ROWS * (p.frames - 1):
        raise DembarkError(f"the test lasts {lasts:.0f} steps, and time.csv has {ROWS * (p.frames - 1)} rows of it", "",
                           "lower inertial_number, confining_stress or frames")
    stride = ROWS * math.ceil(lasts / (ROWS * (p.frames - 1)))
    numbers = {"closed_step": closed, "start_step": start, "ramp_steps": math.ceil(RAMP * lasts), "first": start, "stride": stride,
               "every": stride // ROWS, "steps": start + stride * (p.frames - 1), "closing_rate": closing, "gain": GAIN * rate,
               "integral_time": INTEGRAL / rate, "strain_rate": strain_rate}
    if p.arrangement == "fcc":
        numbers |= dict(zip(("cells_x", "cells_y", "cells_z"), lattice_cells(p), strict=True))
    return Setup(numbers["steps"], step, bodies, {**numbers, **contacts(p)})


def gas(p: Parameters, closing: float) -> Packing:
    """Grains far apart in a cell that is almost a cube, and that shrink with it at the rate `closing` (1/s)."""
    side = 1.15 * packing.largest(p) * math.ceil((1.3 * p.grain_count) ** (1.0 / 3.0))
    sites, top = packing.slab(p, side, side, margin=0.0, foot=0.0)
    grains = packing.grains(p, sites, [(0.0, side), (0.0, side), (0.0, top)])
    return replace(grains, velocities=-closing * (grains.positions - grains.box.mean(axis=1)))


def lattice(p: Parameters) -> Packing:
    """A face-centred cubic lattice with the rows of its square layers along x and y, whose contacts carry the confining stress: with
    6 √2 / d³ contacts in a volume each has the force p d² / √8."""
    cells, d = lattice_cells(p), p.grain_diameter
    modulus = effective_youngs_modulus(p.youngs_modulus, p.poisson_ratio, p.youngs_modulus, p.poisson_ratio)
    overlap = (0.75 * p.confining_stress * d**2 / math.sqrt(8.0) / (modulus * math.sqrt(0.25 * d))) ** (2.0 / 3.0)
    sides = (d - overlap) * np.array([1.0, 1.0, math.sqrt(2.0)])
    middles = packing.lattice(cells, tuple(sides))
    places = np.vstack([middles - 0.25 * sides, middles + 0.25 * sides])
    many, box = len(places), np.column_stack([np.zeros(3), cells * sides])
    return Packing(box, places, np.full(many, d), np.full(many, p.grain_density), np.ones(many, int))


def lattice_cells(p: Parameters) -> tuple[int, int, int]:
    """Cells along x, y, z, of d x d x √2 d, of two grains each."""
    count = round((p.grain_count / 96) ** (1.0 / 3.0))
    return 4 * count, 4 * count, 3 * count
