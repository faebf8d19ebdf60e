"""Grains on a free part: touches.dump has the grains near it, and where it is. What they do to it follows from how they move against it:
the force along the normal is that of the law of the contacts at the recorded overlap, friction is not known. All is seen from the part,
which turns; vectors in the plane of the layer are complex numbers z + i x, see `body_motion`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid, trapezoid
from scipy.spatial import cKDTree

from dembark.input_decks.common.part_impacts import ContactRecord, own_modulus, surface_area
from dembark.input_decks.common.vibratory_trough import Plane, body_motion, in_plane
from dembark.postproc import GrainsDump
from dembark.postproc.grains import GrainFrame
from dembark.postproc.measurement import Array, Numbers, Replica
from dembark.postproc.replica import cached_per_replica
from dembark.postproc.walls import MeshWall


@dataclass(frozen=True)
class FreeRecord(ContactRecord):
    """A record of a free part, with vectors along the axes that turn with it; `gap`: size of the change of its momentum less the impulses
    of the recorded forces, the trough and the weight, from the first frame to the last, over the weight times the time between."""

    gap: float


@dataclass(frozen=True)
class Spheres:
    """What makes up the part: spheres of one `radius` (m) at `places` (k,) from the centre of mass (m); its `mass` (kg) and its `moment` of
    inertia (kg m2); `flat`: whether the true part has a flat surface, not that of one sphere."""

    places: Plane
    radius: float
    mass: float
    moment: float
    flat: bool


def spheres_of(frame: GrainFrame, numbers: Mapping[str, float], inertia: float) -> Spheres:
    """The part of a `frame` of all grains: the last one, of moment `inertia` m r^2, or the last `body_spheres` of them."""
    if "body_spheres" not in numbers:
        radius, mass = float(frame.radii[-1]), float(frame.masses[-1])
        return Spheres(np.zeros(1, complex), radius, mass, inertia * mass * radius**2, flat=False)
    own = slice(-int(numbers["body_spheres"]), None)
    centre, turned, _, _ = body_motion(in_plane(frame.positions[own]), in_plane(frame.velocities[own]), numbers)
    places = (in_plane(frame.positions[own]) - centre) / turned
    return Spheres(places, float(frame.radii[-1]), float(numbers["body_mass"]), float(numbers["body_moment"]), flat=True)


def normal_forces(overlaps: Array, closing: Array, radii: Array, masses: Array, p: Numbers) -> Array:
    """Forces (N) of the law of the contacts: Hertz and the dashpot of the restitution, -sqrt(10/3) beta sqrt(S m) v with S = 2 E* sqrt(R
    delta), at `overlaps` (m) and speeds `closing` (m/s), for the reduced `radii` (m) and `masses` (kg)."""
    modulus, log = own_modulus(p), math.log(p["restitution"])
    stiffness = 2.0 * modulus * np.sqrt(radii * overlaps)
    damping = -math.sqrt(10.0 / 3.0) * log / math.hypot(log, math.pi) * np.sqrt(stiffness * masses)
    return np.asarray(2.0 / 3.0 * stiffness * overlaps + damping * closing)


@cached_per_replica
def contact_record(replica: Replica) -> FreeRecord:
    """The record of the grains on the part."""
    p, derived = replica.parameters, replica.derived
    part = spheres_of(next(iter(replica.grains())), derived, p["part_inertia"])
    return read_record(list(GrainsDump(replica.folder / "touches.dump")), part, part_surface(replica), derived, p, replica.time_step)


@cached_per_replica
def part_surface(replica: Replica) -> MeshWall:
    """The part about its centre of mass, before it turned."""
    return MeshWall.from_stl("part", replica.folder / "part.stl")


def read_record(frames: list[GrainFrame], part: Spheres, surface: MeshWall, numbers: Mapping[str, float], p: Numbers,
                time_step: float) -> FreeRecord:
    """The record in `frames`, which all have the `part`, with the derived `numbers` and parameters `p` of the run."""
    def column(name: str) -> Array:
        return np.concatenate([getattr(frame, name) for frame in frames])

    count, ids, places, speeds = p["grain_count"], column("ids"), in_plane(column("positions")), in_plane(column("velocities"))
    rows = np.array([len(frame.ids) for frame in frames])
    number, steps = np.repeat(np.arange(len(frames)), rows), np.array([frame.step for frame in frames])
    # In each frame the spheres of the part come after the grains.
    end = np.cumsum(rows)
    first = end - np.bincount(number[ids > count], minlength=len(frames))
    if part.flat:
        both = np.stack([first, end - 1], axis=1)
        centre, turned, velocity, spin = body_motion(places[both], speeds[both], numbers)
    else:
        centre, velocity, spin = places[first], speeds[first], column("omegas")[first, 1]
        turned = np.exp(1j * cumulative_trapezoid(spin, time_step * steps, initial=0.0))
    of_trough = in_plane(np.concatenate([frame.wall_forces["trough"] for frame in frames])) * (ids > count)
    row = np.flatnonzero(ids <= count)
    here = (places[row] - centre[number[row]]) / turned[number[row]]
    speed = (speeds[row] - velocity[number[row]]) / turned[number[row]]
    masses, radii = column("masses")[row], column("radii")[row]
    # Each grain with each sphere of the part that it touches.
    near = _tree(here).sparse_distance_matrix(_tree(part.places), part.radius + float(radii.max(initial=0.0)), output_type="ndarray")
    near = near[near["v"] < radii[near["i"]] + part.radius]
    one, sphere, apart = near["i"], part.places[near["j"]], near["v"]
    normal = (here[one] - sphere) / apart
    touch = sphere + part.radius * normal
    way = speed[one] - 1j * spin[number[row[one]]] * touch
    overlap, reduced = radii[one] + part.radius - apart, 1.0 / (1.0 / radii + 1.0 / part.radius)
    closing = -(way * np.conj(normal)).real
    force = normal * normal_forces(overlap, closing, reduced[one], 1.0 / (1.0 / masses[one] + 1.0 / part.mass), p)
    # A grain hits with where it is deepest in the part.
    order = np.lexsort((-overlap, one))
    hit, begins = np.unique(one[order], return_index=True)
    best = order[begins]
    lever = (np.conj(touch) * normal).imag[best]
    hitting = 1.0 / (1.0 / masses[hit] + 1.0 / part.mass + lever**2 / part.moment)
    total = _sums(one, force, len(row))
    on_part = _sums(number, of_trough, len(frames)) - _sums(number[row], total * turned[number[row]], len(frames))
    window = time_step * (steps[-1] - steps[0])
    weight = p["gravity"] * part.mass * window
    gap = abs(part.mass * (velocity[-1] - velocity[0]) - trapezoid(on_part, time_step * steps) + weight) / weight
    stride, period = int(numbers["sample"]), int(numbers["period_steps"]) * time_step
    depth = p["grain_diameter"]
    return FreeRecord(
        steps[number[row[hit]]], ids[row[hit]].astype(np.int64), hitting, radii[hit] if part.flat else reduced[hit], reduced[hit],
        closing[best], np.abs((way * np.conj(normal)).imag[best]), _in_space(touch[best]), _in_space(normal[best]), _in_space(total[hit]),
        stride, time_step, int(numbers["touches"]), min(p["impact_periods"], p["periods"]), period, surface_area(surface, depth), gap)


def _tree(places: Plane) -> cKDTree:
    return cKDTree(np.column_stack([places.imag, places.real]))


def _sums(number: NDArray[np.int64], values: Plane, count: int) -> Plane:
    """Sums (count,) of the `values` (n,) of each `number` (n,)."""
    return np.asarray(np.bincount(number, values.real, count) + 1j * np.bincount(number, values.imag, count))


def _in_space(vectors: Plane) -> Array:
    return np.column_stack([vectors.imag, np.zeros(len(vectors)), vectors.real])
