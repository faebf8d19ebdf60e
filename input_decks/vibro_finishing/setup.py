"""Vibratory finishing: grains and a part above the bottom of a trough, and the steps of output at fixed phases of the drive."""

import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from dembark.common.errors import DembarkError
from dembark.input_decks.common import packing
from dembark.input_decks.common.motion import TABLE, amplitude, motion, table_length
from dembark.input_decks.common.setup import Number, Parameters, Setup, contacts
from dembark.input_decks.common.trough import prism, sites, sites_within, trough
from dembark.input_decks.common.vibration import fixed_phases, highest_speed, sample_stride, suitable_step
from dembark.physics import WallMotion
from dembark.postproc.walls.mesh import cut, read_stl

from .free_body import circle, free_body

FOLDER = Path(__file__).parent
# How fast grains may be thrown, over the drive's highest speed: one that part and side pinched flew up with 5.6 times that.
THROWN = 8.0
# A trough that is wider (m) was drawn in mm.
WIDEST = 20.0


def setup(p: Parameters) -> Setup:
    """The part lies amid the grains at the start: the last body, or one of spheres, which the decks make."""
    body = None if p.part == "sphere" else free_body(p)
    around = body.reach if body else 0.5 * p.part_diameter
    still = math.ceil(p.settle_time * p.motion_frequency)
    moving = motion(drive(p), start=still / p.motion_frequency, folder=FOLDER)
    speed, amplitude_reached = driven(p, moving, still / p.motion_frequency)
    step, numbers = fixed_phases(p.motion_frequency, suitable_step(p, speed), still + p.motion_ramp + p.run_in, p.periods)
    depth = max(2.0 * around, 2.0 * p.grain_diameter)
    reach = amplitude_reached + 2.0 * p.grain_diameter
    leap = 0.5 * (THROWN * speed) ** 2 / p.gravity
    if p.trough == "file":
        mesh = np.asarray(read_stl(FOLDER / "trough.stl").triangles)
        low, high = mesh.min(axis=(0, 1)), mesh.max(axis=(0, 1))
        depth = max(depth, -low[1], high[1])
        lowest = mesh.reshape(-1, 3)[mesh[..., 2].argmin()]
        centre = (float(0.5 * (low[0] + high[0])), float(lowest[2] + around + 2.0 * p.grain_diameter))
        lines = cut(mesh)
        if not len(lines):
            raise DembarkError("trough.stl is not cut by the plane y = 0", f"it reaches from y = {low[1]:g} to {high[1]:g} m",
                               "move it along y")
        if high[0] - low[0] > WIDEST:
            raise DembarkError(f"trough.stl is {high[0] - low[0]:g} m wide", "it was drawn in mm, maybe", "write the file in m")
        places = sites_within(p, lines, (*centre, around))
        box = [(low[0] - reach, high[0] + reach), (-depth, depth), (low[2] - reach, high[2] + reach + depth + leap)]
    else:
        mesh, centre = trough(p.trough_width, p.trough_side, p.strips, 2.0 * p.grain_diameter), (0.0, -0.2 * p.trough_width)
        places, top = sites(p, (*centre, around))
        wide = 0.5 * p.trough_width + reach
        box = [(-wide, wide), (-depth, depth), (-wide, max(p.trough_side, top) + depth + leap)]
    bodies = packing.grains(p, places, box)
    # All centres in one plane.
    bodies = replace(bodies, positions=bodies.positions * [1, 0, 1])
    more = {"free_part": 1, "drive_speed": speed, "begin": still * numbers["period_steps"], "sample": sample_stride(p, speed, step),
            "touches": numbers["steps"] - min(p.impact_periods, p.periods) * numbers["period_steps"],
            # A grain that is farther than this from the middle of the part does not touch it.
            "near": around + 0.5 * packing.largest(p)}
    tables: dict[str, tuple[Number, ...]] = {"motion_words": moving.words}
    if body is None:
        part = prism(circle(p.part_diameter), 2.0 * p.grain_diameter)
        bodies = bodies.joined(np.array([[centre[0], 0.0, centre[1]]]), p.part_diameter, p.part_density, 1)
    else:
        part = body.surface
        # Its middle is at the first sphere a and the last b: x = x_a + along (x_b - x_a) + across (z_b - z_a), and z likewise.
        first, last = (complex(z, x) for x, z in body.places[[0, -1]])
        share = -first / (last - first)
        more |= {"body_spheres": len(body.places), "body_mass": body.mass, "body_moment": body.moment, "body_x": centre[0],
                 "body_z": centre[1], "along": share.real, "across": share.imag}
        more |= {f"{which}_{axis}": place for which, row in (("first", 0), ("last", -1))
                 for axis, place in zip("xz", body.places[row].tolist(), strict=True)}
        tables["body_places"] = tuple(body.places.ravel().tolist())
    return Setup(numbers["steps"], step, bodies, {**numbers, **more, **contacts(p, skin=0.2)}, {"trough": mesh, "part": part}, tables)


def driven(p: Parameters, moving: WallMotion, start: float) -> tuple[float, float]:
    """Highest speed (m/s) of the trough, and how far (m) it gets from its place, when it moves from `start` (s) on."""
    if p.motion != "table":
        return highest_speed(p), amplitude(p)
    times = start + np.arange(0.0, table_length(FOLDER) + 0.01 / p.motion_frequency, 0.01 / p.motion_frequency)
    speed, reach = (float(np.linalg.norm(found, axis=1).max()) for found in (moving.velocity(times), moving.displacement(times)))
    if not speed > 0.0:
        raise DembarkError(f"{TABLE} moves nothing", "the trough of this case shakes", "give rows whose displacements differ")
    return speed, reach


def drive(p: Parameters) -> Parameters:
    """The parameters of the motion for `drive_sense`; a table has its own."""
    if p.motion == "table":
        return p
    own = {"motion": "circular", "motion_sense": p.drive_sense} if p.drive_sense else {"motion": "harmonic", "motion_direction": "z"}
    return SimpleNamespace(**{**vars(p), **own})
