"""Vibratory hardening: grains in a trough around a part, and the steps of output at fixed phases of the drive."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from dembark.common.errors import DembarkError
from dembark.input_decks.common import packing
from dembark.input_decks.common.bodies import read_body
from dembark.input_decks.common.motion import amplitude, motion
from dembark.input_decks.common.setup import Array, Parameters, Setup, contacts
from dembark.input_decks.common.trough import polygon, prism, sites, trough
from dembark.input_decks.common.vibration import fixed_phases, highest_speed, sample_stride, suitable_step
from dembark.postproc.walls.mesh import cut

from .throws import aimed

FOLDER = Path(__file__).parent


def setup(p: Parameters) -> Setup:
    """The part moves with the trough, or rests in it."""
    still = math.ceil(p.settle_time * p.motion_frequency)
    moving = motion(p, start=still / p.motion_frequency)
    fastest = max(highest_speed(p), p.thrown_speed or 0.0)
    step, numbers = fixed_phases(p.motion_frequency, suitable_step(p, fastest), still + p.motion_ramp + p.run_in, p.periods)
    centre, depth = np.array([0.0, 0.0, -0.2 * p.trough_width]), 2.0 * p.grain_diameter
    part = part_mesh(p, depth) + centre
    reach = float(np.linalg.norm((part - centre)[..., [0, 2]], axis=2).max())
    turn = np.linspace(still, still + p.motion_ramp + 1.0, 100 * (math.ceil(p.motion_ramp) + 1)) / p.motion_frequency
    travel = float(np.linalg.norm(moving.displacement(turn), axis=1).max())
    # A grain on the trough is farther from the part than the deck looks for grains on the part, by `near`.
    room = p.grain_diameter + 0.65 * packing.largest(p)
    clear = 0.3 * p.trough_width - (travel if p.part_held == "at_rest" else 0.0)
    if clear < reach + room:
        raise DembarkError(f"the trough is too narrow for the part, which reaches {reach:.3g} m from its centre",
                           "grains would touch both at once", f"raise trough_width, or take a part that reaches less than "
                           f"{max(0.0, clear - room):.3g} m")
    places, top = sites(p, (centre[0], centre[2], reach))
    beyond = amplitude(p) + 2.0 * p.grain_diameter
    wide, high = 0.5 * p.trough_width + beyond, max(p.trough_side, top) + beyond
    # A part longer than the layer is wide has to be in the box of the engine.
    half = max(depth, float(np.abs(part[..., 1]).max()))
    bodies = packing.grains(p, places, [(-wide, wide), (-half, half), (-wide, high)])
    bodies = replace(bodies, positions=bodies.positions * [1, 0, 1])
    if p.thrown_speed is not None:
        meet = (numbers["first"] + 0.5 * numbers["period_steps"]) * step
        bodies = aimed(bodies, float(part[..., 2].max()), p.thrown_speed, meet, p.gravity)
    more = {"drive_speed": highest_speed(p), "begin": still * numbers["period_steps"], "sample": sample_stride(p, fastest, step),
            "part_reach": reach}
    return Setup(numbers["steps"], step, bodies, {**numbers, **more, **contacts(p, skin=0.2)},
                 {"trough": trough(p.trough_width, p.trough_side, p.strips, depth), "part": part}, {"motion_words": moving.words})


def part_mesh(p: Parameters, depth: float) -> Array:
    """Triangles (n, 3, 3) in m of the part about the origin: a prism with the `depth` (m) of the layer, or that of part.stl."""
    if p.part == "polygon":
        return prism(polygon(p.part_diameter, p.part_corners, (0.0, 0.0)), depth)
    body = read_body(FOLDER / "part.stl")
    mesh = body.triangles - body.mass.centre
    section = mesh[..., [0, 2]]
    if np.abs(section).max() > p.trough_width:
        raise DembarkError(f"part.stl is {np.ptp(section, axis=(0, 1)).max():g} m wide", "it was drawn in mm, maybe", "write the file in m")
    if not len(cut(mesh)):
        raise DembarkError("the layer of grains misses part.stl", "the plane through its centre of mass across y does not cut it",
                           "take another part")
    return mesh
